#include "stats/likelihood_detail.h"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

namespace taihu {
namespace {

struct Case {
    Family family;
    double shape;
};

constexpr std::array kCases = {Case{Family::gamma, -1.5},
                               Case{Family::gamma, 0.7},
                               Case{Family::weibull, 0.3},
                               Case{Family::weibull, 2.0},
                               Case{Family::lognormal, -3.0},
                               Case{Family::lognormal, -0.7},
                               Case{Family::truncated_normal, -2.0},
                               Case{Family::truncated_normal, 1.0},
                               Case{Family::uniform, 0.4}};

TEST(UnitSection, AgreesWithTheSectionLaw) {
    for (const auto& [family, shape] : kCases) {
        const SectionLaw exact(law_at(family, 0, shape));
        UnitSection table(family, shape);
        table.cover(-6, 1.5);
        for (double x = -6; x < 1.5; x += 0.0137) {
            const double log_pdf = exact.log_pdf(std::exp(x));
            const double log_survival = exact.log_survival(std::exp(x));
            // As documented; the greatest is that of Weibull's tail, which steepens fastest.
            if (log_pdf > -20) {
                EXPECT_NEAR(table.log_pdf(x), log_pdf, 3e-5) << family_name(family) << " " << x;
            }
            if (log_survival > -20) {
                EXPECT_NEAR(table.log_survival(x), log_survival, 3e-5)
                    << family_name(family) << " " << x;
            }
        }
    }
}

// Weibull's tail falls out of the range of a double within a step of the table.
TEST(UnitSection, FarOutNothingIsLeft) {
    for (const auto& [family, shape] : kCases) {
        UnitSection table(family, shape);
        table.cover(-1, 14);
        bool is_far = false;
        for (double x = -1; x < 14; x += 0.0137) {
            EXPECT_FALSE(is_far && table.log_survival(x) > -40) << family_name(family) << " " << x;
            is_far = is_far || table.log_survival(x) < -50;
        }
        EXPECT_TRUE(is_far) << family_name(family);
    }
}

TEST(UnitSection, GrowsWithoutForgetting) {
    UnitSection table(Family::gamma, 0.7);
    table.cover(-1, 0);
    const double before = table.log_pdf(-0.5);
    table.cover(-4, 2);
    EXPECT_EQ(table.log_pdf(-0.5), before);
}

TEST(LawAt, HasTheMeanItWasAskedFor) {
    for (const auto& [family, shape] : kCases)
        EXPECT_NEAR(law_at(family, 0.7, shape).mean(), std::exp(0.7), 1e-12) << family_name(family);
    EXPECT_NEAR(law_at(Family::exponential, 0.7, 0).mean(), std::exp(0.7), 1e-12);
    EXPECT_NEAR(law_at(Family::constant, 0.7, 0).mean(), std::exp(0.7), 1e-12);
}

TEST(LogPrior, IsPaidByDensitiesThatAreInfiniteAtZero) {
    for (const Family family : {Family::gamma, Family::weibull}) {
        EXPECT_DOUBLE_EQ(log_prior(family, std::log(0.25)), std::log(0.25));
        EXPECT_EQ(log_prior(family, 0), 0);
        EXPECT_EQ(log_prior(family, 2), 0);
    }
    EXPECT_EQ(log_prior(Family::lognormal, -2), 0);
    EXPECT_EQ(log_prior(Family::exponential, 0), 0);
}

TEST(Likelihood, IsTheSumOfLogDensities) {
    Sample sample;
    sample.diameters = {0.5, 0.5, 0.9, 1.7};
    sample.detection_limit = 0.4;
    const Detection detection(sample);
    for (const auto& [family, shape] : kCases) {
        if (family == Family::uniform)
            continue; // ends before the greatest profile
        Likelihood likelihood(sample, detection, family, {});
        const SectionLaw section(law_at(family, 0.2, shape));
        double sum = log_prior(family, shape);
        for (const double d : sample.diameters)
            sum += section.log_pdf(d) - section.log_survival(0.4);
        if (sum > -60) { // as above
            EXPECT_NEAR(likelihood(0.2, shape), sum, 1e-4) << family_name(family);
        }
        EXPECT_NEAR(likelihood.seen(0.2, shape), section.survival(0.4), 1e-6);
        // The mean over a short interval is the density in its middle.
        Likelihood rounded(sample, detection, family, 1e-3);
        if (sum > -60) {
            EXPECT_NEAR(rounded(0.2, shape), sum, 1e-3) << family_name(family);
        }
    }
}

} // namespace
} // namespace taihu
