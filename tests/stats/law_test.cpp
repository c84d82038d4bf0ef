#include "stats/law.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stats/core/error.h"
#include "stats/core/portable_math.h"

namespace taihu {
namespace {

using testing::HasSubstr;

Law make(Family family, std::vector<double> parameters) {
    return Law(family, parameters);
}

// One or more of each family, skewed, narrow and with an infinite density at 0 among them.
std::vector<Law> laws() {
    return {Law::exponential(5.54),
            make(Family::gamma, {2.5, 0.1}),
            make(Family::gamma, {0.4, 3}),
            make(Family::gamma, {300, 0.01}), // its gamma function overflows
            make(Family::weibull, {1.257, 0.25}),
            make(Family::weibull, {0.7, 2}),
            make(Family::lognormal, {-1.3, 0.54}),
            make(Family::truncated_normal, {0.3, 0.2}),
            make(Family::truncated_normal, {-1, 0.5}),
            make(Family::uniform, {0.2, 0.9}),
            Law::empirical({{0, 0}, {0.1, 0.5}, {0.2, 0.5}, {0.6, 1}})};
}

std::string name(const Law& law) {
    return std::string(family_name(law.family()));
}

TEST(Law, DensityIsTheSlopeOfTheCdf) {
    for (const Law& law : laws())
        for (double u = 0.0513; u < 0.95; u += 0.05) {
            const double x = law.quantile(u), h = 1e-5 * x;
            // Central difference: truncation of h^2 f'' / 6 and cancellation of 1e-16 / h.
            EXPECT_NEAR((law.cdf(x + h) - law.cdf(x - h)) / (2 * h) / law.pdf(x), 1, 1e-7)
                << name(law) << " at " << x;
        }
}

// Moments by the midpoint rule in u: E[D^k] = int quantile(u)^k du, on a grid refined at both ends.
double moment_by_quantiles(const Law& law, int k) {
    double sum = 0;
    constexpr int kSteps = 20'000;
    for (int i = 0; i < kSteps; ++i) {
        // u = 3 s^2 - 2 s^3 has no slope at the ends, where the quantile is steep.
        const double s = (i + 0.5) / kSteps;
        sum += std::pow(law.quantile(s * s * (3 - 2 * s)), k) * 6 * s * (1 - s) / kSteps;
    }
    return sum;
}

TEST(Law, MomentsAreThoseOfItsQuantiles) {
    for (const Law& law : laws())
        for (int k = 0; k <= 3; ++k)
            // The midpoint rule at the steep upper end: 1e-3 for the cube of a Weibull with 0.7.
            EXPECT_NEAR(law.moment(k) / moment_by_quantiles(law, k), 1, 2e-3)
                << name(law) << " k " << k;
}

TEST(Law, ScaledIsTheSameLawInAnotherUnit) {
    for (const Law& law : laws())
        for (const double u : {0.1, 0.5, 0.97}) // rounding of the scaled parameters
            EXPECT_NEAR(scaled(law, 25).quantile(u) / (25 * law.quantile(u)), 1, 1e-12)
                << name(law);
    EXPECT_EQ(scaled(Law::constant(2), 0.5), Law::constant(1));
    EXPECT_THROW(scaled(Law::constant(2), 0), Error);
}

TEST(Law, HasTheMomentsOfTheTextbook) {
    EXPECT_DOUBLE_EQ(Law::exponential(4).mean(), 0.25);
    EXPECT_DOUBLE_EQ(Law::exponential(4).moment(3), 6.0 / 64);
    EXPECT_DOUBLE_EQ(make(Family::gamma, {2, 3}).moment(2), 54);
    EXPECT_DOUBLE_EQ(make(Family::weibull, {1, 3}).moment(2), 18);
    EXPECT_DOUBLE_EQ(make(Family::lognormal, {0, 1}).mean(), std::exp(0.5));
    // Half a normal law: sd sqrt(2 / pi), and the second moment of the whole one.
    EXPECT_DOUBLE_EQ(make(Family::truncated_normal, {0, 2}).mean(),
                     2 * std::sqrt(2 / std::acos(-1.0)));
    EXPECT_DOUBLE_EQ(make(Family::truncated_normal, {0, 2}).moment(2), 4);
    EXPECT_DOUBLE_EQ(make(Family::uniform, {1, 3}).moment(2), 26.0 / 6);
    EXPECT_DOUBLE_EQ(Law::constant(0.5).moment(3), 0.125);
}

TEST(Law, PortableQuantilesUseOnlyOurLogarithm) {
    EXPECT_EQ(Law::exponential(3).quantile(0.25), -portable_log(0.75) / 3);
    EXPECT_EQ(make(Family::uniform, {1, 2}).quantile(0.25), 1.25);
    EXPECT_EQ(Law::constant(7).quantile(0.99), 7);
    const Law table = Law::empirical({{0, 0}, {1, 0.5}, {2, 0.5}, {4, 1}});
    EXPECT_EQ(table.quantile(0.25), 0.5);
    EXPECT_EQ(table.quantile(0.5), 1); // the smallest with that share, though 2 has it too
    EXPECT_EQ(table.quantile(0.75), 3);
    EXPECT_EQ(table.quantile(1), 4);
}

TEST(Law, EndsAreTheSupport) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    EXPECT_EQ(Law::exponential(2).quantile(0), 0);
    for (const Law& law : laws()) {
        EXPECT_EQ(law.cdf(-1), 0) << name(law);
        EXPECT_EQ(law.pdf(-1), 0) << name(law);
        EXPECT_EQ(law.cdf(0), 0) << name(law);
        EXPECT_EQ(law.cdf(kInfinity), 1) << name(law);
        EXPECT_GE(law.quantile(1), law.quantile(0.999)) << name(law);
    }
    EXPECT_EQ(Law::constant(2).cdf(1.999), 0);
    EXPECT_EQ(Law::constant(2).cdf(2), 1);
}

void expect_refused(Family family, std::vector<double> parameters, const char* message) {
    try {
        make(family, parameters);
        ADD_FAILURE() << "no exception for " << message;
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::bad_argument);
        EXPECT_THAT(e.what(), HasSubstr(message));
    }
}

TEST(Law, NamesTheParameterThatIsOutOfRange) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    expect_refused(Family::exponential, {0}, "exponential law: rate is 0; must be in 1e-12..");
    expect_refused(Family::gamma, {-2, 1}, "gamma law: shape is -2; must be in 0.01..1");
    expect_refused(Family::weibull, {2, nan}, "weibull law: scale is nan");
    expect_refused(Family::lognormal, {0, 5}, "lognormal law: sd_log is 5; must be in 0.001..4");
    expect_refused(Family::truncated_normal, {-7, 1}, "mean is -7 with sd 1");
    expect_refused(Family::uniform, {2, 1}, "lo is 2 and hi is 1; lo must be below hi");
    expect_refused(Family::constant, {1, 2}, "2 parameters; give 1");
    expect_refused(Family::empirical, {}, "give its points");
}

void expect_table_refused(std::vector<CdfPoint> points, const char* message) {
    try {
        Law::empirical(std::move(points));
        ADD_FAILURE() << "no exception for " << message;
    } catch (const Error& e) {
        EXPECT_THAT(e.what(), HasSubstr(message));
    }
}

TEST(Law, NamesThePointThatIsWrong) {
    expect_table_refused({{0, 0}}, "1 points; give at least 2");
    expect_table_refused({{0, 0}, {1, 0.5}, {1, 1}}, "point 2: diameter 1 does not rise");
    expect_table_refused({{0, 0}, {1, 0.5}, {2, 0.4}}, "point 2: the CDF falls to 0.4");
    expect_table_refused({{0, 0.1}, {1, 1}}, "point 0: the CDF begins at 0.1, must be 0");
    expect_table_refused({{0, 0}, {1, 0.9}}, "point 1: the CDF ends at 0.9, must be 1");
    expect_table_refused({{-1, 0}, {1, 1}}, "point 0: diameter is -1");
}

TEST(Law, RefusesWhatIsNoShare) {
    EXPECT_THROW(Law::exponential(1).quantile(1.5), Error);
    EXPECT_THROW(Law::exponential(1).quantile(std::nan("")), Error);
    EXPECT_THROW(Law::exponential(1).moment(-1), Error);
}

TEST(Law, FamiliesAreFoundByName) {
    for (const Law& law : laws())
        EXPECT_EQ(family_from_name(family_name(law.family())), law.family());
    try {
        family_from_name("exponentail");
        ADD_FAILURE();
    } catch (const Error& e) {
        EXPECT_THAT(e.what(), HasSubstr("did you mean 'exponential'?"));
    }
}

} // namespace
} // namespace taihu
