#include "stats/location.h"

#include <cmath>
#include <functional>
#include <numbers>

#include "stats/core/rng.h"
#include "tests/support/errors.h"

namespace taihu {
namespace {

const Window kWindow = Window::rectangle(3, 2);

std::vector<PlanePoint> uniform(std::size_t n, std::uint64_t seed) {
    const Rng rng{seed, 9};
    std::vector<PlanePoint> points;
    for (std::size_t i = 0; i < n; ++i)
        points.push_back({3 * rng.uniform(i, 0), 2 * rng.uniform(i, 1)});
    return points;
}

std::vector<PlanePoint> clustered(std::size_t n, std::uint64_t seed) {
    const Rng rng{seed, 10};
    std::vector<PlanePoint> points;
    for (std::size_t i = 0; i < n; ++i) {
        const std::uint64_t parent = 1000 + i % 6;
        points.push_back({0.2 + 2.6 * rng.uniform(parent, 0) + 0.4 * (rng.uniform(i, 0) - 0.5),
                          0.2 + 1.6 * rng.uniform(parent, 1) + 0.4 * (rng.uniform(i, 1) - 0.5)});
    }
    return points;
}

std::vector<PlanePoint> hard_core(std::size_t n, double distance, std::uint64_t seed) {
    const Rng rng{seed, 11};
    std::vector<PlanePoint> points;
    for (std::uint64_t i = 0; points.size() < n; ++i) {
        const PlanePoint p{3 * rng.uniform(i, 0), 2 * rng.uniform(i, 1)};
        bool apart = true;
        for (const PlanePoint& q : points)
            apart = apart && std::hypot(p.x - q.x, p.y - q.y) > distance;
        if (apart)
            points.push_back(p);
    }
    return points;
}

Window disc_window() {
    Image mask(300, 200, 1);
    for (int y = 0; y < 200; ++y)
        for (int x = 0; x < 300; ++x)
            *mask.at(x, y) = std::hypot(x + 0.5 - 150, y + 0.5 - 100) < 100 ? 1.f : 0.f;
    return Window::mask(mask, 0.01);
}

TEST(QuadratTest, CountsEachCell) {
    const std::vector<PlanePoint> points = {{0.1, 0.1}, {0.2, 0.2}, {2.9, 0.5}, {1.5, 1.9}};
    const QuadratTest test = quadrat_test(points, kWindow, 3, 2);
    EXPECT_THAT(test.observed, testing::ElementsAre(2, 0, 1, 0, 1, 0));
    for (const double expected : test.expected)
        EXPECT_DOUBLE_EQ(expected, 4.0 / 6);
    EXPECT_EQ(test.df, 5);
    EXPECT_NEAR(test.statistic, (4 + 1 + 1) / (4.0 / 6) - 4, 1e-12);
    EXPECT_NEAR(test.least_expected, 2.0 / 3, 1e-12);
}

TEST(QuadratTest, WeighsCellsByTheirShareOfTheMask) {
    // A disc of radius 1 in the middle of 3 x 2, in 6 x 2 cells of width 1/2: the outer ones are
    // empty, and those next hold the segment beyond 1/2, acos(.5) - .5 sqrt(.75) = .6142 of pi.
    const std::vector<PlanePoint> points = {{1.5, 1.0}, {1.4, 0.4}, {1.6, 1.2}, {1.5, 0.7}};
    const QuadratTest test = quadrat_test(points, disc_window(), 6, 2);
    EXPECT_EQ(test.expected[0], 0);
    EXPECT_EQ(test.df, 7);
    EXPECT_NEAR(test.expected[1] / 4, 0.6142 / 2 / std::numbers::pi, 0.002); // pixels of 0.01
    EXPECT_NEAR(test.expected[2] / 4, 0.25 - 0.6142 / 2 / std::numbers::pi, 0.002);
}

TEST(QuadratTest, RefusesByName) {
    const auto points = uniform(10, 0);
    expect_error(Fault::bad_argument, "1 x 1 cells", [&] { quadrat_test(points, kWindow, 1, 1); });
    expect_error(Fault::bad_argument, "101 x 2", [&] { quadrat_test(points, kWindow, 101, 2); });
    expect_error(Fault::bad_input, "no points", [] { quadrat_test({}, kWindow, 2, 2); });
    expect_error(Fault::bad_input, "points[1] is (4, 1), not in the window", [] {
        quadrat_test(std::vector<PlanePoint>{{1, 1}, {4, 1}}, kWindow, 2, 2);
    });
    const std::uint64_t few[] = {1, 2, 3};
    expect_error(Fault::bad_argument, "3 cells with 6 points", [&] { thesis_quadrat_test(few); });
}

using Maker = std::function<std::vector<PlanePoint>(std::uint64_t seed)>;

int n_rejected(const Maker& make, int n_runs, double& mean_ratio, double& mean_deviation) {
    int rejected = 0;
    mean_ratio = mean_deviation = 0;
    for (int run = 0; run < n_runs; ++run) {
        const auto seed = static_cast<std::uint64_t>(run);
        const NeighbourTest test = neighbour_test(make(seed), kWindow, 39, seed);
        rejected += test.p_value <= 0.05;
        mean_ratio += test.nearest_ratio / n_runs;
        mean_deviation += test.deviation / n_runs;
    }
    return rejected;
}

TEST(NeighbourTest, AcceptsUniformPointsNineteenTimesInTwenty) {
    double ratio, deviation;
    const int n = n_rejected([](std::uint64_t s) { return uniform(46, s); }, 400, ratio, deviation);
    // Two ranks of 40 are rejected, exactly 5 %: 20 expected with sd 4.4, three of them.
    EXPECT_NEAR(n, 20, 13);
    EXPECT_NEAR(ratio, 1, 0.02); // sd of one ratio about 0.09
}

TEST(NeighbourTest, FlagsClusters) {
    double ratio, deviation;
    const int n =
        n_rejected([](std::uint64_t s) { return clustered(46, s); }, 40, ratio, deviation);
    EXPECT_GE(n, 38);
    EXPECT_LT(ratio, 0.8);
    EXPECT_GT(deviation, 0);
}

TEST(NeighbourTest, FlagsAHardCoreAsRegular) {
    double ratio, deviation;
    const int n =
        n_rejected([](std::uint64_t s) { return hard_core(46, 0.25, s); }, 40, ratio, deviation);
    EXPECT_GE(n, 38);
    EXPECT_GT(ratio, 1.2);
    EXPECT_LT(deviation, -0.05);
}

TEST(NeighbourTest, LIsTheDistanceForRandomPoints) {
    // L(r) = r without edges; in the window pairs are missed, a share of about r perimeter / (pi
    // A).
    const NeighbourTest test = neighbour_test(uniform(2000, 3), kWindow, 19);
    ASSERT_EQ(test.r.size(), 32u);
    EXPECT_DOUBLE_EQ(test.r.back(), 0.5);
    const double r = test.r[3];
    EXPECT_NEAR(test.l[3], r * (1 - 0.5 * r * 10 / (std::numbers::pi * 6)), 0.02 * r);
    for (std::size_t k = 0; k < 32; ++k)
        EXPECT_LE(test.lo[k], test.hi[k]);
}

TEST(NeighbourTest, WorksInAMaskAndIsAFunctionOfItsSeed) {
    std::vector<PlanePoint> points;
    for (const PlanePoint& p : uniform(80, 4))
        if (std::hypot(p.x - 1.5, p.y - 1) < 0.99)
            points.push_back(p);
    const Window disc = disc_window();
    const NeighbourTest a = neighbour_test(points, disc, 99, 1),
                        b = neighbour_test(points, disc, 99, 1);
    EXPECT_EQ(a.hi, b.hi);
    EXPECT_NE(a.hi, neighbour_test(points, disc, 99, 2).hi);
    EXPECT_GT(a.p_value, 0.05);
}

TEST(NeighbourTest, RefusesByName) {
    expect_error(Fault::bad_input, "1 points; 2..10000",
                 [] { neighbour_test(uniform(1, 0), kWindow); });
    expect_error(Fault::bad_argument, "n_simulations is 3",
                 [] { neighbour_test(uniform(9, 0), kWindow, 3); });
    expect_error(Fault::bad_input, "not in the window", [] {
        neighbour_test(std::vector<PlanePoint>{{1, 1}, {9, 9}}, kWindow);
    });
}

} // namespace
} // namespace taihu
