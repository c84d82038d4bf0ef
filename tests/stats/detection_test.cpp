#include "stats/detection.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stats/core/error.h"
#include "stats/core/rng.h"
#include "stats/density.h"
#include "stats/section_draws.h"
#include "stats/wicksell.h"

namespace taihu {
namespace {

using testing::HasSubstr;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Detection, IsAStepWithoutFrames) {
    Sample sample;
    sample.diameters = {0.5, 1};
    sample.area = 3;
    const Detection detection(sample);
    EXPECT_EQ(detection.limit(), 0.5);
    EXPECT_EQ(detection.area(), 3);
    EXPECT_EQ(detection.share(0.49), 0);
    EXPECT_EQ(detection.share(0.5), 1);
    EXPECT_TRUE(detection.is_flat(0.5, kInfinity));
    const SectionLaw section(Law::exponential(1));
    const auto survival = [&](double d) { return section.survival(d); };
    EXPECT_DOUBLE_EQ(detection.seen(survival, 0, kInfinity), section.survival(0.5));
    EXPECT_DOUBLE_EQ(detection.seen(survival, 1, 2), section.survival(1) - section.survival(2));
}

TEST(Detection, PoolsFramesByTheirAreas) {
    Sample sample;
    sample.diameters = {0.5, 1};
    sample.frames = {{3, 0.2, {}}, {1, {}, {}}}; // the second has the sample's limit, 0.5
    const Detection detection(sample);
    EXPECT_EQ(detection.limit(), 0.2);
    EXPECT_EQ(detection.area(), 4);
    EXPECT_EQ(detection.share(0.3), 0.75);
    EXPECT_EQ(detection.share(0.6), 1);
    EXPECT_FALSE(detection.is_flat(0.3, 0.6));
    EXPECT_TRUE(detection.is_flat(0.3, 0.5));
}

TEST(Detection, CountsWholeProfilesByTheErodedWindow) {
    Sample sample;
    sample.diameters = {0.5, 1};
    sample.frames = {{48, 0.1, Window::rectangle(8, 6)}};
    sample.counting = Counting::whole;
    const Detection detection(sample);
    for (double d = 0.1; d < 6; d += 0.3)
        EXPECT_NEAR(detection.share(d), (8 - d) * (6 - d) / 48, 1e-4) << d; // as documented
    EXPECT_EQ(detection.share(6.1), 0);
    const SectionLaw section(Law::exponential(1));
    double sum = 0; // of the midpoint rule, whose error is of the order 1e-6 here
    constexpr double kStep = 0.001;
    for (double d = 0.1 + kStep / 2; d < 6; d += kStep)
        sum += section.pdf(d) * (8 - d) * (6 - d) / 48 * kStep;
    const auto survival = [&](double d) { return section.survival(d); };
    EXPECT_NEAR(detection.seen(survival, 0, kInfinity), sum, 1e-4); // the table of g
    sample.counting = Counting::centre;
    EXPECT_EQ(Detection(sample).share(7), 1);
}

TEST(Detection, RefusesAProfileThatCannotBeThere) {
    Sample sample;
    sample.diameters = {1, 7};
    sample.frames = {{48, 0.1, Window::rectangle(8, 6)}};
    sample.counting = Counting::whole;
    try {
        const Detection detection(sample);
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::bad_input);
        EXPECT_THAT(e.what(), HasSubstr("diameters[1] is 7 but no whole profile of that size"));
    }
}

// The mean of N_A by whole profiles in windows dropped onto a plane with N_A = 1.5 circles of
// exponential spheres, over its truth.
double whole_profiles_ratio(const Window& window, int runs) {
    constexpr double kTruth = 1.5, kMargin = 4;
    const SectionDraws draws(Law::exponential(2), 0);
    const double side_x = window.width() + 2 * kMargin, side_y = window.height() + 2 * kMargin;
    const auto n = static_cast<std::uint64_t>(kTruth * side_x * side_y);
    double sum = 0;
    for (int run = 0; run < runs; ++run) {
        const Rng rng{static_cast<std::uint64_t>(run), 7},
            sizes{static_cast<std::uint64_t>(run), 8};
        Sample sample;
        for (std::uint64_t i = 0; i < n; ++i) {
            const double x = rng.uniform(i, 0) * side_x - kMargin;
            const double y = rng.uniform(i, 1) * side_y - kMargin;
            const double r = 0.5 * draws.diameter(sizes, i);
            bool whole = window.contains(x, y);
            for (int k = 0; k < 64 && whole; ++k)
                whole = window.contains(x + r * std::cos(k * std::numbers::pi / 32),
                                        y + r * std::sin(k * std::numbers::pi / 32));
            if (whole)
                sample.diameters.push_back(2 * r);
        }
        sample.detection_limit = 0;
        sample.counting = Counting::whole;
        sample.frames = {{window.area(), {}, window}};
        sum += profiles_per_area(sample);
    }
    return sum / runs * side_x * side_y / static_cast<double>(n);
}

// Held to 1 %. The number in a window of 48 is binomial with a mean of about 45 and weights about
// 1.5: the mean of 800 runs has a standard error of 0.6 %; the seeds are fixed.
TEST(HorvitzThompson, IsUnbiasedInARectangle) {
    EXPECT_NEAR(whole_profiles_ratio(Window::rectangle(8, 6), 800), 1, 0.01);
}

TEST(HorvitzThompson, IsUnbiasedInADisc) {
    Image image(200, 200, 1);
    for (int y = 0; y < 200; ++y)
        for (int x = 0; x < 200; ++x)
            *image.at(x, y) = std::hypot(x - 99.5, y - 99.5) <= 98 ? 1.0F : 0.0F;
    EXPECT_NEAR(whole_profiles_ratio(Window::mask(image, 0.04), 800), 1, 0.01);
}

TEST(ExpectedHoles, GrowWithTheVolume) {
    const NumberDensity holes = expected_holes({10, 8, 13, 0.4}, 2.5);
    EXPECT_EQ(holes, (NumberDensity{25, 20, 32.5, 0.4}));
    EXPECT_THROW(expected_holes({}, -1), Error);
    EXPECT_THROW(expected_holes({}, std::nan("")), Error);
}

TEST(ProfilesPerArea, NeedAnArea) {
    Sample sample;
    sample.diameters = {1, 2};
    EXPECT_THROW(profiles_per_area(sample), Error);
    sample.area = 4;
    EXPECT_EQ(profiles_per_area(sample), 0.5);
}

} // namespace
} // namespace taihu
