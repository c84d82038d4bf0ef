#include "stats/bootstrap.h"

#include <array>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stats/core/error.h"
#include "stats/section_draws.h"

namespace taihu {
namespace {

using testing::HasSubstr;

constexpr std::array kAt = {0.3, 1.0, 2.5};

Sample drawn(std::uint64_t n) {
    const SectionDraws draws(Law::exponential(1), 0.2);
    Sample sample;
    for (std::uint64_t i = 0; i < n; ++i)
        sample.diameters.push_back(draws.diameter({3, 1}, i));
    sample.detection_limit = 0.2;
    return sample;
}

TEST(Band, IsThatOfTheRateForAnExponential) {
    const Sample sample = drawn(100);
    const Fit fit = fit_law(sample, Family::exponential);
    const Band band = f3_band(sample, fit.law, kAt, {.n_resamples = 400});
    EXPECT_EQ(band.n_failed, 0u);
    for (std::size_t i = 0; i < kAt.size(); ++i) {
        EXPECT_EQ(band.f3[i], fit.law.cdf(kAt[i]));
        // The profile interval carried to F3; ends of 400 resamples have a standard error of about
        // a tenth of the width, and the two methods differ by less than that.
        const double lo = 1 - std::exp(-fit.intervals[0].lo * kAt[i]);
        const double hi = 1 - std::exp(-fit.intervals[0].hi * kAt[i]);
        EXPECT_NEAR(band.lo[i], lo, 0.25 * (hi - lo));
        EXPECT_NEAR(band.hi[i], hi, 0.25 * (hi - lo));
    }
}

TEST(Band, IsTheSameEveryTime) {
    const Sample sample = drawn(30);
    const Law law = Law::exponential(1);
    const Band a = f3_band(sample, law, kAt, {.n_resamples = 40, .seed = 5});
    const Band b = f3_band(sample, law, kAt, {.n_resamples = 40, .seed = 5});
    const Band c = f3_band(sample, law, kAt, {.n_resamples = 40, .seed = 6});
    EXPECT_EQ(a.lo, b.lo);
    EXPECT_NE(a.lo, c.lo);
}

TEST(Band, KnowsBinsAndWindows) {
    Sample binned;
    binned.bins = {{0.2, 0.5, 12}, {0.5, 1, 20}, {1, 2, 14}};
    const Law law = likeliest_law(binned, Family::exponential);
    const Band in_bins = f3_band(binned, law, kAt, {.n_resamples = 60});
    EXPECT_LT(in_bins.lo[1], law.cdf(1));
    EXPECT_GT(in_bins.hi[1], law.cdf(1));
    Sample framed = drawn(60);
    framed.frames = {{400, {}, Window::rectangle(20, 20)}};
    framed.counting = Counting::whole;
    const Law seen = likeliest_law(framed, Family::exponential);
    const Band in_window = f3_band(framed, seen, kAt, {.n_resamples = 60});
    EXPECT_LT(in_window.lo[1], seen.cdf(1));
    EXPECT_GT(in_window.hi[1], seen.cdf(1));
}

class Stopped : public Progress {
    void stage(std::string_view) override {}
    void fraction(double) override {}
    bool cancelled() const override { return true; }
};

TEST(Band, SaysWhatItCannotDo) {
    const Sample sample = drawn(30);
    const auto refusal = [&](const Law& law, const BandSettings& settings, Progress* progress) {
        try {
            f3_band(sample, law, kAt, settings, progress);
        } catch (const Error& e) {
            return std::string(e.what());
        }
        return std::string("no exception");
    };
    const Law law = Law::exponential(1);
    EXPECT_THAT(refusal(law, {.n_resamples = 3}, nullptr), HasSubstr("n_resamples is 3"));
    EXPECT_THAT(refusal(law, {.level = 95}, nullptr), HasSubstr("level is 95"));
    EXPECT_THAT(refusal(Law::empirical({{0, 0}, {1, 1}}), {}, nullptr), HasSubstr("empirical law"));
    Stopped stopped;
    EXPECT_THROW(f3_band(sample, law, kAt, {}, &stopped), Error);
}

} // namespace
} // namespace taihu
