#include "stats/unfold.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stats/core/error.h"
#include "stats/section_draws.h"
#include "stats/wicksell.h"

namespace taihu {
namespace {

using testing::HasSubstr;

// Expected counts of very many sections in classes of 0.1.
Sample expected_counts(const Law& law, int n_bins) {
    const SectionLaw section(law);
    Sample sample;
    for (int i = 0; i < n_bins; ++i) {
        const double lo = 0.1 * i, hi = 0.1 * (i + 1);
        sample.bins.push_back({sample.bins.empty() ? 0 : sample.bins.back().hi, hi,
                               static_cast<std::uint64_t>(std::llround(
                                   2e8 * (section.survival(lo) - section.survival(hi))))});
    }
    return sample;
}

Sample drawn(const Law& law, double limit, std::uint64_t n) {
    const SectionDraws draws(law, limit);
    Sample sample;
    for (std::uint64_t i = 0; i < n; ++i)
        sample.diameters.push_back(draws.diameter({1, 1}, i));
    sample.detection_limit = limit;
    return sample;
}

TEST(SchwartzSaltykov, GivesThePublishedRowOfAFlatLaw) {
    const Unfolding flat =
        schwartz_saltykov(expected_counts(Law(Family::uniform, std::array{0.0, 1.0}), 10));
    // Printed to three digits from 2e6 drawn sections; the truth is 0.1 each.
    constexpr std::array kPrinted = {.086, .103, .105, .107, .107, .107, .106, .106, .101, .072};
    double sum = 0;
    for (const double s : flat.spheres)
        sum += s;
    ASSERT_EQ(flat.spheres.size(), kPrinted.size());
    for (std::size_t i = 0; i < kPrinted.size(); ++i)
        EXPECT_NEAR(flat.spheres[i] / sum / kPrinted[i], 1, 0.02) << i;
    EXPECT_EQ(flat.n_clipped, 0);
}

TEST(SchwartzSaltykov, UndoesSpheresAsLargeAsTheirClass) {
    // One sphere per unit volume of diameter 1 makes these sections per unit area; twice that many.
    Sample sample;
    for (int i = 0; i < 4; ++i)
        sample.bins.push_back(
            {i / 4.0, (i + 1) / 4.0,
             static_cast<std::uint64_t>(std::llround(
                 2e8 * (std::sqrt(1 - i * i / 16.0) - std::sqrt(1 - (i + 1) * (i + 1) / 16.0))))});
    const Unfolding one = schwartz_saltykov(sample);
    EXPECT_NEAR(one.spheres[3], 2e8, 2); // counts are rounded
    EXPECT_NEAR(one.spheres[0], 0, 20);
}

TEST(SchwartzSaltykov, SaysHowManyClassesItClipped) {
    Sample sample;
    sample.bins = {{0, 1, 0}, {1, 2, 1}, {2, 3, 40}};
    sample.detection_limit = 0;
    const Unfolding result = schwartz_saltykov(sample);
    EXPECT_EQ(result.n_clipped, 2);
    EXPECT_EQ(result.spheres[0], 0);
    EXPECT_EQ(result.law().cdf(2), 0);
}

TEST(Em, ConservesTheProfiles) {
    const Sample sample = drawn(Law::exponential(1), 0.2, 300);
    const Unfolding result = unfold_em(sample);
    ASSERT_EQ(result.edges.size(), 13u);
    EXPECT_EQ(result.edges.front(), 0.2);
    double expected = 0; // sections above the limit of the spheres found
    for (std::size_t j = 0; j < 12; ++j)
        expected +=
            result.spheres[j] * std::sqrt(result.edges[j + 1] * result.edges[j + 1] - 0.2 * 0.2);
    EXPECT_NEAR(expected, 300, 1e-9); // each pass keeps the sum
}

// Mean distance from F3 above the limit at its deciles.
double f3_error(const Law& found, const Law& truth, double limit) {
    double sum = 0;
    for (int i = 1; i < 10; ++i) {
        const double hidden = truth.cdf(limit);
        sum += std::abs(found.cdf(truth.quantile(hidden + 0.1 * i * (1 - hidden))) - 0.1 * i) / 9;
    }
    return sum;
}

TEST(Unfolding, ComesNearTheTruthAboveTheLimit) {
    for (const double limit : {0.0, 0.3}) {
        const Law truth = Law::exponential(1);
        const Sample sample = drawn(truth, limit, 3000);
        // Classes of the width 1/2 put spheres at their upper edges: 0.04 of F3; the isotonic
        // estimate has the rate sqrt(log n / n).
        EXPECT_LT(f3_error(schwartz_saltykov(sample, {24}).law(), truth, limit), 0.05);
        EXPECT_LT(f3_error(unfold_em(sample, {24, 64, 0}).law(), truth, limit), 0.05);
        EXPECT_LT(f3_error(unfold_em(sample, {24, 64, 0.1}).law(), truth, limit), 0.06);
        EXPECT_LT(f3_error(unfold_isotonic(sample), truth, limit), 0.05);
    }
}

TEST(Isotonic, IsALawThatBeginsAtTheLimit) {
    const Law law = unfold_isotonic(drawn(Law::exponential(1), 0.3, 200));
    EXPECT_EQ(law.points().front(), (CdfPoint{0.3, 0}));
    EXPECT_EQ(law.points().back().cdf, 1);
}

TEST(Unfolding, SaysWhatItCannotDo) {
    const auto refusal = [](auto work) -> std::string {
        try {
            work();
        } catch (const Error& e) {
            return e.what();
        }
        return "no exception";
    };
    const Sample sample = drawn(Law::exponential(1), 0.3, 20);
    Sample equal;
    equal.diameters.assign(20, 1.0);
    EXPECT_THAT(refusal([&] { schwartz_saltykov(sample, {1}); }),
                HasSubstr("number of classes is 1; must be in 2..1000"));
    EXPECT_THAT(refusal([&] { unfold_em(sample, {12, 0, 0}); }), HasSubstr("iterations is 0"));
    EXPECT_THAT(refusal([&] { unfold_em(sample, {12, 64, 0.5}); }), HasSubstr("smoothing is 0.5"));
    EXPECT_THAT(refusal([&] { unfold_em(equal); }), HasSubstr("lie at the detection limit 1"));
    EXPECT_THAT(refusal([&] { unfold_isotonic(equal); }), HasSubstr("lie at the detection limit"));
    EXPECT_THAT(refusal([&] { unfold_isotonic(expected_counts(Law::exponential(9), 5)); }),
                HasSubstr("in bins; use EM"));
    EXPECT_THAT(refusal([] { Unfolding{{0, 1}, {0}, 0}.law(); }), HasSubstr("no class holds"));
}

} // namespace
} // namespace taihu
