#include "stats/sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stats/core/error.h"

namespace taihu {
namespace {

using testing::HasSubstr;

const Box kBox{{-1, 0, 2}, {1, 3, 2.5}};
constexpr std::uint64_t kMany = 10'000;

// Greatest distance of the empirical CDF of `u` from the uniform one.
double distance_to_uniform(std::vector<double> u) {
    std::sort(u.begin(), u.end());
    double greatest = 0;
    const auto n = static_cast<double>(u.size());
    for (std::size_t i = 0; i < u.size(); ++i)
        greatest = std::max(
            {greatest, u[i] - static_cast<double>(i) / n, static_cast<double>(i + 1) / n - u[i]});
    return greatest;
}

// Kolmogorov's critical value at 1 %; the seeds are fixed, so a pass stays a pass.
const double kCritical = 1.628 / std::sqrt(static_cast<double>(kMany));

TEST(HoleStream, DiametersObeyTheLaw) {
    const double shape_scale[] = {1.7, 0.3};
    for (const Law& law : {Law::exponential(5.54), Law(Family::weibull, shape_scale),
                           Law::empirical({{0, 0}, {0.2, 0.7}, {1, 1}})}) {
        const HoleStream stream(law, kBox, 0.5, 7);
        std::vector<double> u;
        for (std::uint64_t i = 0; i < kMany; ++i)
            u.push_back(law.cdf(2 * stream.hole(i).radius_m / 0.5));
        EXPECT_LT(distance_to_uniform(u), kCritical) << family_name(law.family());
    }
}

TEST(HoleStream, CentresAreUniformInTheBox) {
    const HoleStream stream(Law::constant(1), kBox, 1, 7);
    for (int axis = 0; axis < 3; ++axis) {
        std::vector<double> u;
        for (std::uint64_t i = 0; i < kMany; ++i)
            u.push_back((stream.hole(i).center[axis] - kBox.lo[axis]) / kBox.size()[axis]);
        EXPECT_LT(distance_to_uniform(u), kCritical) << axis;
    }
}

TEST(HoleStream, CoordinatesAndDiametersAreIndependent) {
    const HoleStream stream(Law::exponential(1), {{0, 0, 0}, {1, 1, 1}}, 1, 9);
    double xy = 0, xd = 0;
    for (std::uint64_t i = 0; i < kMany; ++i) {
        const Sphere s = stream.hole(i);
        xy += (s.center.x - 0.5) * (s.center.y - 0.5) * 12 / kMany;
        xd += (s.center.x - 0.5) * (2 * s.radius_m - 1) * std::sqrt(12.0) / kMany;
    }
    // A correlation of independent numbers has the standard error 1 / sqrt(n); three of them.
    EXPECT_NEAR(xy, 0, 0.03);
    EXPECT_NEAR(xd, 0, 0.03);
}

TEST(HoleStream, IsAddressedByNumber) {
    const HoleStream stream(Law::exponential(2), kBox, 1, 3), same(Law::exponential(2), kBox, 1, 3),
        other(Law::exponential(2), kBox, 1, 4);
    const Sphere late = stream.hole(1'000'000'000'000);
    const Sphere first = stream.hole(0);
    EXPECT_EQ(same.hole(0), first); // not touched by what was asked before
    EXPECT_EQ(same.hole(1'000'000'000'000), late);
    EXPECT_NE(other.hole(0), first);
    EXPECT_NE(stream.hole(1), first);
}

// Recorded once: these bits must come out on every machine and of every later version.
TEST(HoleStream, HasGoldenFirstHoles) {
    const HoleStream stream(Law::exponential(4), {{0, 0, 0}, {1, 2, 4}}, 1, 0);
    const Sphere golden[] = {
        {{0x1.85b2a6985e8e3p-1, 0x1.3cb34fe5d7496p-1, 0x1.6dca99efb28f6p+0}, 0x1.96e8ee153aabdp-5},
        {{0x1.f4ac52c1f92d7p-1, 0x1.cb03a124a8e02p-1, 0x1.327820ab0a774p-1}, 0x1.5626280a59798p-6},
        {{0x1.5310927875069p-1, 0x1.324ae8bf1e509p+0, 0x1.ffff22aeff047p+1}, 0x1.667316928631cp-2}};
    for (std::uint64_t i = 0; i < 3; ++i)
        EXPECT_EQ(stream.hole(i), golden[i]) << i;
}

TEST(HoleStream, RefusesBoxesAndScalesThatMakeNoSense) {
    const auto message = [](const Box& box, double scale) -> std::string {
        try {
            HoleStream(Law::constant(1), box, scale, 0);
        } catch (const Error& e) {
            EXPECT_EQ(e.fault(), Fault::bad_argument);
            return e.what();
        }
        return {};
    };
    EXPECT_THAT(message({}, 1), HasSubstr("the box is empty"));
    EXPECT_THAT(message({{0, 0, 0}, {1, 1, std::numeric_limits<double>::infinity()}}, 1),
                HasSubstr("not finite"));
    EXPECT_THAT(message(kBox, 0), HasSubstr("scale_m is 0; must be finite and > 0"));
}

TEST(PoissonCount, HasThePoissonMeanAndVariance) {
    constexpr int kRuns = 4000;
    double sum = 0, squares = 0;
    for (std::uint64_t seed = 0; seed < kRuns; ++seed) {
        const auto n = static_cast<double>(poisson_count(20, {seed, kCountStream}));
        sum += n;
        squares += (n - 20) * (n - 20);
    }
    // Four standard errors: sqrt(20 / 4000), and for the variance sqrt((20 + 2 * 400) / 4000).
    EXPECT_NEAR(sum / kRuns, 20, 0.28);
    EXPECT_NEAR(squares / kRuns, 20, 1.8);
}

TEST(PoissonCount, HasTheChanceOfNone) {
    EXPECT_EQ(poisson_count(0, {0, kCountStream}), 0u);
    int n_none = 0;
    for (std::uint64_t seed = 0; seed < 4000; ++seed)
        n_none += poisson_count(1, {seed, kCountStream}) == 0;
    EXPECT_NEAR(n_none, 4000 * std::exp(-1), 122); // four standard deviations, sqrt(4000 p (1 - p))
}

TEST(PoissonCount, RefusesWhatIsNoMean) {
    EXPECT_THROW(poisson_count(-1, {}), Error);
    EXPECT_THROW(poisson_count(std::nan(""), {}), Error);
    try {
        poisson_count(1e9, {});
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_THAT(e.what(), HasSubstr("must be in 0..1e8"));
    }
}

} // namespace
} // namespace taihu
