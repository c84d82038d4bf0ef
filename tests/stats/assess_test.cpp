#include "stats/assess.h"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>

#include "stats/core/rng.h"
#include "stats/section_draws.h"
#include "tests/support/errors.h"

namespace taihu {
namespace {

using testing::Contains;
using testing::HasSubstr;

// A photo of 4 m x 3 m with 60 holes of mean 0.1 m, by default anywhere on it.
Measurements photo(double width = 4) {
    Measurements m;
    m.photos.push_back({"stone.jpg", 400, 300, 0.01, false, Window::rectangle(4, 3)});
    const SectionDraws draws(Law::exponential(10), 0.02);
    const Rng rng{3, 9};
    for (std::uint64_t i = 0; i < 60; ++i) {
        Segment s;
        s.diameter = draws.diameter({3, 1}, i);
        const double x = 100 * width * rng.uniform(i, 0), y = 300 * rng.uniform(i, 1);
        s.x1 = s.x2 = x;
        s.y1 = y - 50 * s.diameter;
        s.y2 = y + 50 * s.diameter;
        m.segments.push_back(s);
        m.sample.diameters.push_back(s.diameter);
    }
    m.sample.detection_limit = 0.02;
    m.sample.frames = {{12, {}, m.photos[0].window}};
    m.sample.area = 12;
    return m;
}

Assessment assessed(const Measurements& m, const AssessSettings& settings = {.n_resamples = 99}) {
    return assess(fit_law(m.sample, Family::exponential), m, settings);
}

TEST(Assess, GoodDataRaiseNoAlarm) {
    const Measurements m = photo();
    const Assessment a = assessed(m);
    EXPECT_GT(a.goodness->anderson_darling.p_value, 0.05);
    ASSERT_EQ(a.locations.size(), 1u);
    EXPECT_EQ(a.locations[0].points.size(), 60u);
    EXPECT_EQ(a.locations[0].cells->nx, 3); // along the longer side
    EXPECT_EQ(a.locations[0].cells->ny, 2);
    EXPECT_THAT(a.findings, Contains(HasSubstr("look like sections of exponential holes")));
    EXPECT_THAT(a.findings, Contains(HasSubstr("as if thrown at random")));
    EXPECT_THAT(a.findings, Contains(HasSubstr("counts as searched rock, 12 m^2")));
    EXPECT_FALSE(a.holes);
    EXPECT_FALSE(a.curvature);
}

TEST(Assess, ALawThatEndsIsJudgedByAllOfItsProfiles) {
    Measurements m = photo();
    const AssessSettings settings{.n_resamples = 99, .resolution = 0.01};
    const auto judged = [&] {
        const Fit fit = fit_law(m.sample, Family::constant, {.resolution = 0.01});
        return assess(fit, m, settings).findings;
    };
    EXPECT_THAT(judged(), Contains(HasSubstr("do not look like sections of constant holes")));
    const SectionDraws draws(Law::constant(0.3), 0.02);
    for (std::size_t i = 0; i < m.sample.diameters.size(); ++i)
        m.sample.diameters[i] = 0.01 * std::round(100 * draws.diameter({4, 1}, i));
    EXPECT_THAT(judged(), Contains(HasSubstr("sizes look like sections of constant holes")));
}

TEST(Assess, HolesOnOneSideAreFound) {
    const Assessment a = assessed(photo(1.5));
    EXPECT_LT(a.locations[0].cells->p_value, 0.001);
    EXPECT_LT(a.locations[0].near->p_value, 0.01);
    EXPECT_THAT(a.findings, Contains(HasSubstr("holes crowd together")));
    EXPECT_THAT(a.advice, Contains(HasSubstr("searched equally well")));
}

TEST(Assess, CountsTheHolesOfASolid) {
    const Measurements m = photo();
    const Fit fit = fit_law(m.sample, Family::exponential);
    const double r = 0.35, volume = 4 * std::numbers::pi / 3 * r * r * r;
    const double area = 4 * std::numbers::pi * r * r;
    const Assessment a = assess(fit, m, {.n_resamples = 99, .solid = SolidSize{volume, area}});
    EXPECT_DOUBLE_EQ(a.holes->estimate, fit.n_v->estimate * volume);
    EXPECT_DOUBLE_EQ(*a.holes_biting, fit.n_v->estimate * area * fit.law.mean() / 2);
    EXPECT_NEAR(*a.curvature, r / fit.law.mean(), 1e-12); // rounding
    EXPECT_LT(*a.curvature, 5);
    EXPECT_THAT(a.findings, Contains(HasSubstr("too curved")));
    EXPECT_THAT(a.findings, Contains(HasSubstr("Your rock has about")));
    expect_error(Fault::bad_argument, "volume 0",
                 [&] { assess(fit, m, {.n_resamples = 99, .solid = SolidSize{}}); });
}

TEST(Assess, SaysWhatMayHideBehindLargerHoles) {
    Measurements m = photo();
    m.photos.clear();
    for (Segment& s : m.segments)
        s.has_ends = false;
    m.sample.frames.clear();
    m.sample.area = 8; // dense: the holes make a fifth of the rock
    const Assessment a = assessed(m);
    EXPECT_GT(*a.porosity, 0.1);
    EXPECT_GT(*a.n_v_overlap, fit_law(m.sample, Family::exponential).n_v->estimate);
    EXPECT_THAT(a.findings, Contains(HasSubstr("times as many")));
    EXPECT_TRUE(a.locations.empty());
}

TEST(Assess, AdvisesWhatIsMissing) {
    Measurements m = photo();
    m.sample.frames.clear();
    m.sample.area.reset();
    m.sample.detection_limit.reset();
    m.sample.unit = LengthUnit::pixel;
    const Assessment a = assessed(m);
    for (const char* words : {"ruler", "part of the photo was searched", "not marked any more",
                              "Mark more holes", "slant"})
        EXPECT_THAT(a.advice, Contains(HasSubstr(words)));
    EXPECT_FALSE(a.porosity);
}

TEST(Assess, SurvivesASampleTooSmallToTest) {
    Measurements m = photo();
    m.sample.diameters = {0.1, 0.1, 0.1, 0.1, 0.1, 0.2, 0.3, 0.4, 0.5};
    m.sample.detection_limit = 0.1;
    const Assessment a = assessed(m);
    EXPECT_FALSE(a.goodness);
    EXPECT_THAT(a.findings, Contains(HasSubstr("could not be tested")));
}

TEST(Assess, CanBeStopped) {
    struct Stopped : Progress {
        void stage(std::string_view) override {}
        void fraction(double) override {}
        bool cancelled() const override { return true; }
    } stopped;
    const Measurements m = photo();
    const Fit fit = fit_law(m.sample, Family::exponential);
    expect_error(Fault::cancelled, "", [&] { assess(fit, m, {}, &stopped); });
}

} // namespace
} // namespace taihu
