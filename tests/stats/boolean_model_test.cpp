#include "stats/boolean_model.h"

#include <cmath>
#include <numbers>

#include "tests/support/errors.h"

namespace taihu {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(BooleanModel, ExponentialBallsHaveTheirClosedForms) {
    const double rate = 3, n = 4, t = kPi * n / (rate * rate * rate), q = std::exp(-t);
    const BooleanModel m = boolean_model(Law::exponential(rate), n);
    // Closed forms of the same expressions: rounding alone.
    EXPECT_NEAR(m.porosity, 1 - q, 1e-14);
    EXPECT_NEAR(m.s_v, 2 * kPi * n / (rate * rate) * q, 1e-13);
    EXPECT_NEAR(m.chi_v, n * q * (1 - t + kPi * kPi * t * t / 48), 1e-13);
    EXPECT_NEAR(m.n_a, n / rate, 1e-14);
    EXPECT_NEAR(m.n_a_seen, q * n / rate, 1e-14);
    EXPECT_EQ(m.a_a, m.porosity);
    EXPECT_NEAR(m.l_a, kPi / 4 * m.s_v, 1e-14);
}

TEST(BooleanModel, EqualBallsHaveTheirClosedForms) {
    const double r = 0.4, n = 1.5, h = 4.0 / 3 * kPi * r * r * r * n, q = std::exp(-h);
    const BooleanModel m = boolean_model(Law::constant(2 * r), n);
    EXPECT_NEAR(m.porosity, 1 - q, 1e-14);
    EXPECT_NEAR(m.s_v, 4 * kPi * r * r * n * q, 1e-13);
    EXPECT_NEAR(m.chi_v, n * q * (1 - 3 * h + 3 * kPi * kPi * h * h / 32), 1e-13);
    const double ed = 2 * r, ed2 = 4 * r * r;
    EXPECT_NEAR(m.chi_a, q * (n * ed - std::pow(kPi, 3) / 64 * std::pow(n * ed2, 2)), 1e-13);
}

TEST(BooleanModel, BallsFarApartKeepTheirOwnNumbers) {
    const Law ball = Law::constant(1);
    const BooleanModel sparse = boolean_model(ball, 1e-9);
    EXPECT_NEAR(sparse.chi_v, 1e-9, 1e-17); // what overlaps is of order n_v^2
    EXPECT_NEAR(sparse.m_v, 2 * kPi * 1e-9, 1e-16);
    EXPECT_EQ(boolean_model(ball, 0).porosity, 0);
}

TEST(BooleanModel, OverlapCorrectionTurnsSeenIntoAll) {
    const BooleanModel m = boolean_model(Law::exponential(2), 3);
    EXPECT_NEAR(overlap_corrected_n_a(m.n_a_seen, m.a_a), m.n_a, 1e-14);
}

TEST(BooleanModel, HiddenProfilesAreAddedAgain) {
    const Law law = Law::exponential(2);
    for (const double n_v : {1e-6, 0.5, 2.0}) { // n_v v below 1: the root that is reached from 0
        const double seen = n_v * (1 - boolean_model(law, n_v).a_a);
        EXPECT_NEAR(*overlap_corrected_n_v(law, seen), n_v, 1e-12 * n_v); // rounding alone
    }
    EXPECT_EQ(*overlap_corrected_n_v(law, 0), 0);
    EXPECT_FALSE(overlap_corrected_n_v(law, 1)); // n v exp(-n v) is 1 / e at most: 0.937 here
}

TEST(BooleanModel, EqualBallsMakeASpongeAt31Percent) {
    for (const double d : {0.01, 1.0, 30.0}) {
        const double porosity = *sponge_porosity(Law::constant(d));
        EXPECT_NEAR(porosity, 1 - std::exp(-0.3772), 1e-4); // the root of 1 - 3 n + 3 pi^2 n^2 / 32
        const double n = -std::log(1 - porosity) / (kPi / 6 * d * d * d);
        EXPECT_NEAR(boolean_model(Law::constant(d), n).chi_v / n, 0, 1e-14);
    }
    EXPECT_NEAR(*sponge_porosity(Law::exponential(7)), 0.755, 1e-3);
    const double broad[] = {0.0, 1.5};
    EXPECT_FALSE(sponge_porosity(Law(Family::lognormal, broad)));
}

/// The holes' covariance when the mean of 2 D^3 - 3 D^2 r + r^3 over balls larger than r is `lens`.
double covariance_of(const Law& law, double n_v, double lens) {
    const double v = kPi / 6 * law.moment(3);
    return 1 - 2 * std::exp(-n_v * v) + std::exp(-n_v * (2 * v - kPi / 12 * lens));
}

TEST(BooleanModel, CovarianceHasItsClosedForms) {
    const double n = 1.3;
    for (const double r : {0.0, 0.1, 0.5, 0.9, 2.0, 30.0}) {
        // Exponential: E[(D - r)^2 (2 D + r); D > r] = exp(-L r) (12 / L^3 + 6 r / L^2).
        const double rate = 2.5;
        EXPECT_NEAR(boolean_covariance(Law::exponential(rate), n, r),
                    covariance_of(Law::exponential(rate), n,
                                  std::exp(-rate * r) *
                                      (12 / std::pow(rate, 3) + 6 * r / std::pow(rate, 2))),
                    1e-9); // 1e-13 of r^3 at most
        const double d = 0.8, lens = r < d ? (d - r) * (d - r) * (2 * d + r) : 0;
        EXPECT_NEAR(boolean_covariance(Law::constant(d), n, r),
                    covariance_of(Law::constant(d), n, lens), 1e-9);
    }
}

TEST(BooleanModel, CovarianceGoesFromPorosityToItsSquare) {
    const double uniform[] = {0.2, 1.0}, broad[] = {-1.0, 0.7};
    const Law table = Law::empirical({{0.1, 0}, {0.4, 0.7}, {1.2, 1}});
    for (const Law& law : {Law(Family::uniform, uniform), Law(Family::lognormal, broad), table}) {
        const BooleanModel model = boolean_model(law, 0.9);
        const double p = model.porosity;
        EXPECT_NEAR(boolean_covariance(law, 0.9, 0), p, 1e-14);
        EXPECT_NEAR(boolean_covariance(law, 0.9, 1e6), p * p, 1e-14);
        // At 0 it falls by S_V / 4 a unit.
        const double h = 1e-5;
        EXPECT_NEAR((p - boolean_covariance(law, 0.9, h)) / h, model.s_v / 4, 1e-4 * model.s_v);
        double before = p;
        for (double r = 0.05; r < 3; r += 0.05) {
            const double c = boolean_covariance(law, 0.9, r);
            EXPECT_LE(c, before + 1e-12);
            EXPECT_GE(c, p * p - 1e-12);
            before = c;
        }
    }
}

TEST(BooleanModel, RefusesByName) {
    expect_error(Fault::bad_argument, "the distance is -1",
                 [] { boolean_covariance(Law::exponential(1), 1, -1); });
    expect_error(Fault::bad_argument, "n_v is -1", [] { boolean_model(Law::exponential(1), -1); });
    expect_error(Fault::bad_argument, "a share 1 of holes", [] { overlap_corrected_n_a(3, 1); });
    expect_error(Fault::bad_argument, "n_v is -2",
                 [] { overlap_corrected_n_v(Law::exponential(1), -2); });
}

} // namespace
} // namespace taihu
