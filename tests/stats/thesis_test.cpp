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
