#include "stats/thesis.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stats/core/error.h"

namespace taihu {
namespace {

using testing::HasSubstr;

std::vector<Bin> rock_1() {
    std::vector<Bin> bins;
    const std::uint64_t counts[] = {0, 12, 14, 6, 4, 4, 4, 1, 0, 1};
    for (int i = 0; i < 10; ++i)
        bins.push_back({i / 10.0, (i + 1) / 10.0, counts[i]});
    return bins;
}

TEST(ThesisInversion, GivesTheTableOfRock1) {
    const ThesisInversion t = thesis_inversion(rock_1());
    EXPECT_EQ(t.n, 46);
    EXPECT_EQ(t.first_bin, 1u);
    const double f3[] = {0, .3550, .7047, .8116, .8648, .9168, .9769, .9904, .9867, 1};
    const double density[] = {0, 16.329, 16.086, 4.917, 2.450, 2.390, 2.763, .621, 0, .610};
    for (std::size_t i = 0; i < 10; ++i) {
        EXPECT_NEAR(t.f3[i], f3[i], 5e-5) << i; // half of the last digit
        EXPECT_NEAR(t.density[i], density[i], 5.1e-4) << i;
    }
    EXPECT_DOUBLE_EQ(t.f2[1], 12.0 / 46);
    EXPECT_DOUBLE_EQ(t.f2[9], 1);
}

TEST(ThesisInversion, PrintsTable41ToTheLastDigit) {
    const ThesisInversion t = thesis_inversion(rock_1());
    const std::string text = format_thesis_tables(t, thesis_tests(t));
    const auto row = [](std::initializer_list<const char*> cells) {
        std::string line;
        for (const char* cell : cells)
            line += std::string(7 - std::string(cell).size(), ' ') + cell;
        return line;
    };
    EXPECT_THAT(text, HasSubstr("\nF3         " +
                                row({"0", "0.35", "0.70", "0.81", "0.86", "0.92", "0.98", "0.99",
                                     "0.99", "1"}) +
                                "\n"));
    EXPECT_THAT(text, HasSubstr("\nF3' N dD   " +
                                row({"0", "16.33", "16.09", "4.92", "2.45", "2.39", "2.76", "0.62",
                                     "0", "0.61"}) +
                                "\n"));
    EXPECT_THAT(text, HasSubstr("\nF2' N dD   " +
                                row({"0", "12", "14", "6", "4", "4", "4", "1", "0", "1"}) + "\n"));
    // The thesis cuts .565 and .696 to .56 and .69 but rounds the others; here all are rounded.
    EXPECT_THAT(text, HasSubstr("\nF2         " +
                                row({"0", "0.26", "0.57", "0.70", "0.78", "0.87", "0.96", "0.98",
                                     "0.98", "1"}) +
                                "\n"));
    EXPECT_THAT(text, HasSubstr("uniform        72.911  df 6  critical 12.592  rejected\n"));
    EXPECT_THAT(text, HasSubstr("exponential     5.714  df 6  critical 12.592  not rejected\n"));
    EXPECT_THAT(text, HasSubstr("fewer than 5 holes"));
    EXPECT_THAT(text, HasSubstr("115.276"));
}

TEST(ThesisTests, GiveTheChiSquaredValuesOfRock1) {
    const auto tests = thesis_tests(thesis_inversion(rock_1()));
    ASSERT_EQ(tests.size(), 4u);
    // Printed to three decimals.
    EXPECT_EQ(tests[0].law, "uniform");
    EXPECT_NEAR(tests[0].chi_squared, 72.911, 5e-4);
    EXPECT_EQ(tests[2].law, "Poisson");
    EXPECT_NEAR(tests[2].chi_squared, 55.989, 5e-4);
    EXPECT_EQ(tests[3].law, "exponential");
    EXPECT_NEAR(tests[3].chi_squared, 5.714, 5e-4);
    // The normal law's value cannot be had from the data: its verdict can.
    EXPECT_EQ(tests[1].law, "normal");
    EXPECT_TRUE(tests[1].rejected);
    for (const ThesisTest& test : tests) {
        EXPECT_EQ(test.df, 6);
        EXPECT_NEAR(test.critical, 12.592, 5e-4);
        EXPECT_EQ(test.rejected, test.law != "exponential");
        EXPECT_LT(test.least_expected, 5);
    }
}

TEST(ThesisTests, LeaveOutAllBinsBeforeTheFirstFilledOne) {
    auto bins = rock_1();
    bins[1].count = 0;
    const ThesisInversion t = thesis_inversion(bins);
    EXPECT_EQ(t.first_bin, 2u);
    for (const ThesisTest& test : thesis_tests(t)) {
        EXPECT_EQ(test.df, 5); // as for the thesis' rock 2
        EXPECT_NEAR(test.critical, 11.071, 1e-3);
        EXPECT_GE(test.chi_squared, 0);
    }
}

TEST(ThesisInversion, BecomesALawWithoutFalls) {
    const ThesisInversion t = thesis_inversion(rock_1());
    const Law law = empirical_law(t);
    EXPECT_EQ(law.cdf(0.05), 0);
    EXPECT_DOUBLE_EQ(law.cdf(0.25), t.f3[2]);
    EXPECT_DOUBLE_EQ(law.cdf(0.85), t.f3[7]); // f3[8] is lower
    EXPECT_EQ(law.cdf(0.95), 1);
}

void expect_refused(std::vector<Bin> bins, const char* message) {
    try {
        thesis_tests(thesis_inversion(bins));
        ADD_FAILURE() << "no exception for " << message;
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::bad_input);
        EXPECT_THAT(e.what(), HasSubstr(message));
    }
}

TEST(ThesisInversion, RefusesOtherBins) {
    expect_refused({{0, 1, 4}, {1, 2, 5}}, "2 bins; at least 3");
    expect_refused({{1, 2, 4}, {2, 3, 5}, {3, 4, 1}}, "bin 1 begins at 1, not 0");
    expect_refused({{0, 1, 4}, {1, 3, 5}, {3, 4, 1}}, "bin 2 begins at 1, not 1.33");
    expect_refused({{0, 1, 4}, {1, 2, 5}, {2, 3, 0}}, "the last bin is empty");
    expect_refused({{0, 1, 4}, {1, 2, 5}, {2, 3, 1}}, "3 bins from the first filled one on");
    expect_refused({{0, 1, 1}, {1, 2, 0}, {2, 3, 0}, {3, 4, 1000}}, "lies in one bin");
    auto negative = rock_1();
    negative[0].lo = -1;
    expect_refused(negative, "bins[0] is -1..");
}

} // namespace
} // namespace taihu
