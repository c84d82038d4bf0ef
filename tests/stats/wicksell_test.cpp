#include "stats/wicksell.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <boost/math/special_functions/bessel.hpp>
#include <gtest/gtest.h>

#include "stats/core/error.h"

namespace taihu {
namespace {

SectionLaw section(Family family, std::vector<double> parameters) {
    return SectionLaw(Law(family, parameters));
}

constexpr double kDiameters[] = {0.001, 0.03, 0.2, 0.7, 1.0, 2.5, 6.0, 11.0};

// The quadrature is promised to 1e-12; 1e-10 is what the project asks for.
constexpr double kRelative = 1e-10;

TEST(SectionLaw, QuadratureAgreesWithTheClosedFormOfTheExponentialLaw) {
    const SectionLaw closed(Law::exponential(2)); // gamma and Weibull with shape 1 are the same law
    const SectionLaw gamma = section(Family::gamma, {1, 0.5});
    const SectionLaw weibull = section(Family::weibull, {1, 0.5});
    for (const double d : kDiameters) {
        EXPECT_NEAR(gamma.pdf(d) / closed.pdf(d), 1, kRelative) << d;
        EXPECT_NEAR(gamma.survival(d) / closed.survival(d), 1, kRelative) << d;
        EXPECT_NEAR(weibull.pdf(d) / closed.pdf(d), 1, kRelative) << d;
        EXPECT_NEAR(weibull.survival(d) / closed.survival(d), 1, kRelative) << d;
    }
}

TEST(SectionLaw, RayleighsLawIsItsOwnSection) {
    const SectionLaw rayleigh = section(Family::weibull, {2, 1.3});
    for (const double d : {0.001, 0.03, 0.2, 0.7, 1.0, 2.5, 6.0}) {
        EXPECT_NEAR(rayleigh.pdf(d) / rayleigh.law().pdf(d), 1, kRelative) << d;
        EXPECT_NEAR(rayleigh.survival(d) / std::exp(-d * d / 1.69), 1, kRelative) << d;
    }
}

TEST(SectionLaw, GammaOfShapeTwoHasABesselDensity) {
    const double s = 3;
    const SectionLaw gamma = section(Family::gamma, {2, 1 / s});
    for (const double d : kDiameters)
        EXPECT_NEAR(gamma.pdf(d) / (s * s * s * d * d * boost::math::cyl_bessel_k(1, s * d) / 2), 1,
                    kRelative)
            << d;
}

TEST(SectionLaw, HalfNormalHasABesselDensity) {
    const double s = 0.8;
    const SectionLaw half = section(Family::truncated_normal, {0, s});
    for (const double d : {0.001, 0.03, 0.2, 0.7, 1.0, 2.5}) {
        const double x = d * d / (4 * s * s);
        EXPECT_NEAR(half.pdf(d) /
                        (d / (2 * s * s) * std::exp(-x) * boost::math::cyl_bessel_k(0, x)),
                    1, kRelative)
            << d;
    }
}

TEST(SectionLaw, ConstantSpheresGiveTheLawOfAChord) {
    const SectionLaw constant(Law::constant(2));
    EXPECT_DOUBLE_EQ(constant.cdf(1.2), 0.2); // 1 - sqrt(1 - 0.36)
    EXPECT_DOUBLE_EQ(constant.pdf(1.2), 1.2 / (2 * 1.6));
    EXPECT_EQ(constant.survival(2), 0);
    EXPECT_EQ(constant.pdf(2), std::numeric_limits<double>::infinity());
    EXPECT_EQ(constant.pdf(2.1), 0);
}

TEST(SectionLaw, ANarrowLawApproachesTheConstantOne) {
    const SectionLaw constant(Law::constant(1));
    for (const auto& narrow :
         {section(Family::lognormal, {0, 0.001}), section(Family::gamma, {1e4, 1e-4}),
          section(Family::truncated_normal, {1, 0.001}), section(Family::weibull, {1000, 1}),
          section(Family::uniform, {0.999, 1.001})})
        for (const double d : {0.1, 0.5, 0.9})
            // The widths are 1e-2 (gamma) and 1e-3; the section sees their square, 1e-4, times the
            // curvature of sqrt(1 - d^2 / D^2), 12 at 0.9, and the Weibull's mean is off by 6e-4.
            EXPECT_NEAR(narrow.survival(d), constant.survival(d), 2e-3)
                << family_name(narrow.law().family());
}

TEST(SectionLaw, DensityIsTheSlopeOfTheSurvival) {
    for (const auto& law :
         {SectionLaw(Law::exponential(5)), section(Family::gamma, {0.4, 0.3}),
          section(Family::lognormal, {-1.3, 0.54}), section(Family::uniform, {0.2, 0.9}),
          section(Family::truncated_normal, {0.3, 0.2}), section(Family::weibull, {3, 0.4}),
          SectionLaw(Law::empirical({{0, 0}, {0.1, 0.5}, {0.25, 0.5}, {0.6, 1}}))})
        for (const double d : {0.013, 0.08, 0.17, 0.33, 0.51}) {
            const double h = 1e-5 * d;
            // Central difference: cancellation of 1e-13 / (h f2) is the larger error.
            EXPECT_NEAR((law.survival(d - h) - law.survival(d + h)) / (2 * h) / law.pdf(d), 1, 1e-5)
                << family_name(law.law().family()) << " at " << d;
        }
}

TEST(SectionLaw, PiecesOfAnEmpiricalLawAddUpToTheUniformOne) {
    const SectionLaw whole = section(Family::uniform, {0.5, 1.5});
    const SectionLaw pieces(Law::empirical({{0.5, 0}, {0.7, 0.2}, {1.2, 0.7}, {1.5, 1}}));
    for (const double d : {0.1, 0.5, 0.6, 0.9, 1.3}) {
        EXPECT_NEAR(pieces.pdf(d), whole.pdf(d), 1e-14);
        EXPECT_NEAR(pieces.survival(d), whole.survival(d), 1e-14);
    }
}

TEST(SectionLaw, MeanProfileFollowsFromTheSecondMoment) {
    // E[d] = pi E[D^2] / (4 mu) = int survival, by the midpoint rule in d / (1 + d).
    for (const auto& law : {SectionLaw(Law::exponential(1.5)), section(Family::gamma, {3, 0.2}),
                            section(Family::lognormal, {-0.5, 0.4})}) {
        double sum = 0;
        constexpr int kSteps = 1000;
        for (int i = 0; i < kSteps; ++i) {
            const double s = (i + 0.5) / kSteps;
            sum += law.survival(s / (1 - s)) / ((1 - s) * (1 - s)) / kSteps;
        }
        const double expected = std::numbers::pi / 4 * law.law().moment(2) / law.law().mean();
        EXPECT_NEAR(sum / expected, 1, 1e-5); // error of the midpoint rule, 1 / (24 kSteps^2)
    }
}

TEST(SectionLaw, LogarithmsGoOnWhereValuesUnderflow) {
    const SectionLaw law(Law::exponential(1));
    EXPECT_NEAR(law.log_pdf(49.999), std::log(law.pdf(49.999)), 1e-12);
    // Both sides of the change to the asymptotic series at x = 50; the slopes there are
    // -0.98995 and -0.99015.
    EXPECT_NEAR(law.log_pdf(50 + 1e-9) - law.log_pdf(50 - 1e-9), -1.98e-9, 1e-12);
    EXPECT_NEAR(law.log_survival(50 + 1e-9) - law.log_survival(50 - 1e-9), -1.98e-9, 1e-12);
    // log(x K1(x)) = -x + log(pi x / 2) / 2 + 3 / (8 x) - ... far out.
    EXPECT_NEAR(law.log_survival(1e4),
                -1e4 + 0.5 * std::log(std::numbers::pi * 1e4 / 2) + 3.0 / 8e4, 1e-8);
    EXPECT_EQ(law.survival(1e4), 0);
}

TEST(SectionLaw, QuantileUndoesTheCdf) {
    for (const auto& law : {SectionLaw(Law::exponential(5)), section(Family::gamma, {2.5, 0.1}),
                            SectionLaw(Law::constant(3))})
        for (const double u : {0.01, 0.3, 0.5, 0.99})
            EXPECT_NEAR(law.cdf(law.quantile(u)), u, 1e-12);
    EXPECT_THROW(SectionLaw(Law::exponential(5)).quantile(0), Error);
}

TEST(SectionLaw, EndsAtNothing) {
    for (const auto& law : {SectionLaw(Law::exponential(5)), section(Family::gamma, {0.4, 0.3}),
                            section(Family::gamma, {0.01, 1}), section(Family::lognormal, {0, 4}),
                            section(Family::weibull, {0.1, 1})}) {
        EXPECT_EQ(law.pdf(0), 0);
        EXPECT_EQ(law.survival(0), 1);
        EXPECT_EQ(law.survival(-1), 1);
        EXPECT_NEAR(law.survival(1e-9 * law.law().mean()), 1, 1e-6); // 1 - F2 ~ 1 - d^2 log(d) ..
        EXPECT_NEAR(law.pdf(1e30), 0, 1e-30);
    }
}

} // namespace
} // namespace taihu
