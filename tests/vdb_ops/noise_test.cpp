#include "vdb_ops/noise.h"

#include <cmath>

#include <gmock/gmock.h>

#include "tests/support/errors.h"
#include "tests/support/fields.h"

namespace taihu {
namespace {

/// H from second differences of transects through the noise, at lags within its band.
double fitted_hurst(const FractalNoise& noise, double first_m, double last_m) {
    constexpr int kLines = 60, kPoints = 400;
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    int n = 0;
    for (double lag = first_m; lag <= last_m * 1.001; lag *= 2, ++n) {
        double sum = 0;
        for (std::uint64_t l = 0; l < kLines; ++l) {
            const Vec3 from = random_vec(l) * 50, to = normalized(random_vec(l, 7));
            for (int i = 0; i < kPoints; ++i) {
                const Vec3 p = from + to * (0.37 * lag * i);
                const double d =
                    noise.at(p) - 0.5 * (noise.at(p - to * lag) + noise.at(p + to * lag));
                sum += d * d;
            }
        }
        const double x = std::log2(lag), y = 0.5 * std::log2(sum);
        sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
    return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

TEST(FractalNoise, TransectsHaveTheHurstExponentAskedFor) {
    for (const double hurst : {0.4, 0.6, 0.8, 1.0}) {
        const FractalNoise noise({2, 2.0 / 256, hurst, {0, 1, 0}, 1, 5});
        // From four of the shortest waves to an eighth of the longest. 0.1 is the bar; the octaves
        // at hand end somewhere, which bends the line at both ends.
        EXPECT_NEAR(fitted_hurst(noise, 2.0 / 64, 0.25), hurst, 0.1) << hurst;
    }
}

TEST(FractalNoise, HasMeanZeroAndRmsOneWhateverItsBand) {
    for (const double smallest : {1.0, 0.25, 0.03}) {
        const FractalNoise noise({1, smallest, 0.7, {0, 1, 0}, 1, 9});
        double sum = 0, squares = 0;
        constexpr int kPoints = 20000;
        for (std::uint64_t i = 0; i < kPoints; ++i) {
            const double v = noise.at(random_vec(i) * 300);
            sum += v, squares += v * v;
            ASSERT_LE(std::fabs(v), FractalNoise::kMost);
        }
        // 20,000 values that are nearly independent: four standard errors are 0.03 and 0.04.
        EXPECT_NEAR(sum / kPoints, 0, 0.03);
        EXPECT_NEAR(std::sqrt(squares / kPoints), 1, 0.04);
    }
}

TEST(FractalNoise, FollowsTheSeedAndThePointAlone) {
    NoiseSettings s{0.5, 0.05, 0.8, {0, 1, 0}, 1, 3};
    const FractalNoise a(s), again(s);
    s.seed = 4;
    const FractalNoise other(s);
    double product = 0;
    for (std::uint64_t i = 0; i < 2000; ++i) {
        const Vec3 p = random_vec(i) * 20;
        ASSERT_EQ(a.at(p), again.at(p));
        product += a.at(p) * other.at(p) / 2000;
    }
    EXPECT_LT(std::fabs(product), 0.1); // 1 / sqrt(2000) is 0.022
}

TEST(FractalNoise, LeavesOutWavesThatAreTooShortAndKeepsTheRest) {
    const NoiseSettings s{1, 0.125, 0.5, {0, 1, 0}, 1, 3};
    const FractalNoise all(s), coarse(s, 0.4);
    NoiseSettings two = s;
    two.smallest_m = 0.5;
    const FractalNoise alone(two);
    // Weights 2^-k/2: four octaves have squares of 1.875, the first two 1.5.
    const double share = std::sqrt(1.5 / 1.875);
    for (std::uint64_t i = 0; i < 100; ++i) {
        const Vec3 p = random_vec(i) * 20;
        EXPECT_NEAR(coarse.at(p), share * alone.at(p), 1e-12);
        EXPECT_NE(coarse.at(p), all.at(p));
    }
}

TEST(FractalNoise, StretchedItChangesSlowerAlongTheDirection) {
    const FractalNoise noise({0.5, 0.5, 0.8, {0, 0, 2}, 4, 3});
    double along = 0, across = 0;
    for (std::uint64_t i = 0; i < 4000; ++i) {
        const Vec3 p = random_vec(i) * 20;
        along += std::pow(noise.at(p + Vec3{0, 0, 0.01}) - noise.at(p), 2);
        across += std::pow(noise.at(p + Vec3{0.01, 0, 0}) - noise.at(p), 2);
    }
    EXPECT_NEAR(std::sqrt(across / along), 4, 0.4); // 4000 points: a tenth
}

TEST(FractalNoise, RidgesAreThinAndHigh) {
    const FractalNoise noise({0.5, 0.5, 0.8, {0, 1, 0}, 1, 3});
    double mean = 0, highest = 0;
    for (std::uint64_t i = 0; i < 5000; ++i) {
        const double v = noise.ridged(random_vec(i) * 20);
        ASSERT_GE(v, 0);
        ASSERT_LE(v, 1);
        mean += v / 5000;
        highest = std::max(highest, v);
    }
    EXPECT_GT(highest, 0.99);
    EXPECT_LT(mean, 0.5);
}

TEST(CellNoise, FindsTheTwoNearestOfAllPoints) {
    const CellNoise noise({1, 1, 0.8, {0, 1, 0}, 1, 3});
    for (std::uint64_t i = 0; i < 2000; ++i) {
        const Vec3 p = random_vec(i) * 20, step = random_vec(i, 9) * 1e-3;
        const auto a = noise.at(p), b = noise.at(p + step);
        ASSERT_LE(a.nearest, std::sqrt(3.0)); // the point of the cube it lies in
        ASSERT_LE(a.nearest, a.second);
        // Distances to points change by no more than the step does: none is missed.
        ASSERT_LE(std::fabs(a.nearest - b.nearest), length(step) * 1.0001);
        ASSERT_LE(std::fabs(a.second - b.second), length(step) * 1.0001);
        ASSERT_LE(std::fabs(a.facet), 2);
    }
}

TEST(BedNoise, IsLevelInEachBedAndStepsAtTheJoints) {
    const BedNoise noise({0.1, 0.1, 0.8, {0, 1, 0}, 1, 3});
    int level = 0, n = 0;
    for (double y = 0; y < 20; y += 0.013, ++n) {
        const double v = noise.at({0, y, 0});
        ASSERT_LE(v, 0.5);
        ASSERT_GE(v, -0.85);
        level += std::fabs(noise.at({0, y + 0.001, 0}) - v) < 1e-9;
    }
    EXPECT_NEAR(1. * level / n, 0.75, 0.05); // three quarters of a bed, which sways
}

TEST(Noise, RefusesWhatIsOutOfRange) {
    const auto refused = [](NoiseSettings s, const char* what) {
        expect_error(Fault::bad_argument, what, [&] { FractalNoise noise(s); });
    };
    refused({0, 0, 0.8, {0, 1, 0}, 1, 0}, "noise: largest_m is 0, must be 1e-09..1e+06");
    refused({1, 2, 0.8, {0, 1, 0}, 1, 0}, "smallest_m is 2");
    refused({1, 1e-6, 0.8, {0, 1, 0}, 1, 0}, "smallest_m is 1e-06");
    refused({1, 1, 0, {0, 1, 0}, 1, 0}, "hurst is 0");
    refused({1, 1, std::nan(""), {0, 1, 0}, 1, 0}, "hurst is nan");
    refused({1, 1, 1, {0, 1, 0}, 1e3, 0}, "stretch is 1000");
    refused({1, 1, 1, {0, 0, 0}, 1, 0}, "along has no length; give a direction");
}

} // namespace
} // namespace taihu
