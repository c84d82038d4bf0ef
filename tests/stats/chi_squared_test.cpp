#include "stats/chi_squared.h"

#include <cmath>
#include <limits>
#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stats/core/error.h"
#include "stats/core/rng.h"
#include "stats/fit.h"
#include "stats/wicksell.h"

namespace taihu {
namespace {

using testing::HasSubstr;

TEST(ChiSquared, RefusesNoFreedom) {
    EXPECT_THROW(chi_squared_critical(0, 0.05), Error);
    EXPECT_THROW(chi_squared_critical(3, 1), Error);
    EXPECT_THROW(chi_squared_survival(-1, 3), Error);
    EXPECT_THROW(chi_squared_survival(1, 0), Error);
}

Sample rock_1() {
    Sample sample;
    const std::uint64_t counts[] = {0, 12, 14, 6, 4, 4, 4, 1, 0, 1};
    for (int i = 0; i < 10; ++i)
        sample.bins.push_back({i / 10.0, (i + 1) / 10.0, counts[i]});
    return sample;
}

TEST(ChiSquaredTest, FindsTheExponentialLawFitForTheThesisRock) {
    const Sample sample = rock_1();
    const ChiSquaredTest test =
        chi_squared_test(sample, fit_law(sample, Family::exponential).law, 1);
    // Known to the digits given, by another program.
    EXPECT_NEAR(test.statistic, 2.39, 0.005);
    EXPECT_EQ(test.df, 3);
    EXPECT_NEAR(test.p_value, 0.50, 0.005);
    EXPECT_EQ(test.edges.front(), 0.1);
    EXPECT_EQ(test.edges.back(), 1);
    EXPECT_EQ(std::accumulate(test.observed.begin(), test.observed.end(), 0.0), 46);
    // 0.707 profiles are expected past the last bin; the sum of rounded terms has three digits.
    EXPECT_NEAR(std::accumulate(test.expected.begin(), test.expected.end(), 0.0), 45.293, 1e-3);
    for (const double e : test.expected)
        EXPECT_GE(e, 5);
}

TEST(ChiSquaredTest, RejectsAnotherRate) {
    EXPECT_LT(chi_squared_test(rock_1(), Law::exponential(12), 0).p_value, 1e-3);
}

TEST(ChiSquaredTest, JoinsASmallFirstBinToItsNeighbour) {
    Sample sample;
    sample.bins = {{0, 0.001, 1}, {0.001, 0.5, 20}, {0.5, 1, 20}, {1, 1.5, 10}};
    const ChiSquaredTest test = chi_squared_test(sample, Law::exponential(2), 0);
    EXPECT_EQ(test.edges.front(), 0);
    EXPECT_EQ(test.edges[1], 0.5);
    EXPECT_EQ(test.observed.front(), 21);
}

TEST(ChiSquaredTest, PassesTheTruthAsOftenAsItSays) {
    const SectionLaw truth(Law::exponential(1));
    int n_rejected = 0;
    constexpr int kRuns = 200;
    for (int run = 0; run < kRuns; ++run) {
        Sample sample;
        sample.detection_limit = 0;
        for (std::uint64_t i = 0; i < 60; ++i)
            sample.diameters.push_back(
                truth.quantile(Rng{static_cast<std::uint64_t>(run), 1}.uniform(i)));
        const ChiSquaredTest test = chi_squared_test(sample, truth.law(), 0);
        EXPECT_EQ(test.observed.size(), 10u);
        EXPECT_EQ(test.edges.back(), std::numeric_limits<double>::infinity());
        n_rejected += test.p_value < 0.05;
    }
    // 10 of 200 with a standard deviation of 3.1; three of them.
    EXPECT_NEAR(n_rejected, 10, 9.3);
}

TEST(ChiSquaredTest, RefusesTooFewProfiles) {
    Sample sample;
    sample.diameters = {1, 2, 3, 4, 5, 6, 7, 8, 9};
    try {
        chi_squared_test(sample, Law::exponential(1), 1);
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::bad_input);
        EXPECT_THAT(e.what(), HasSubstr("9 profiles make 1 cells"));
    }
}

} // namespace
} // namespace taihu
