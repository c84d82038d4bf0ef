#include "mesh_out/covering_balls_detail.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "stats/core/rng.h"

namespace taihu {
namespace {

std::vector<Vec3> some_points() {
    const Rng rng{3};
    std::vector<Vec3> points;
    for (std::uint64_t i = 0; i < 300; ++i)
        points.push_back({7 * rng.uniform(i, 0) - 2, 2 * rng.uniform(i, 1), rng.uniform(i, 2)});
    return points;
}

bool covered(const std::vector<Sphere>& balls, const Vec3& p) {
    return std::any_of(balls.begin(), balls.end(),
                       [&](const Sphere& s) { return length(p - s.center) <= s.radius_m; });
}

TEST(CoveringBalls, CoverAllPoints) {
    const auto points = some_points();
    for (const double radius_m : {0.01, 0.5, 20.0})
        for (const auto& balls :
             {balls_over_cubes(points, radius_m), balls_apart(points, radius_m)}) {
            EXPECT_LE(balls.size(), points.size());
            for (const Vec3& p : points)
                EXPECT_TRUE(covered(balls, p));
        }
    EXPECT_EQ(balls_apart(points, 20).size(), 1u);
    EXPECT_TRUE(balls_apart({}, 1).empty());
    EXPECT_TRUE(balls_over_cubes({}, 1).empty());
}

TEST(CoveringBalls, ThoseApartHoldNoCentreOfAnother) {
    const auto balls = balls_apart(some_points(), 0.5);
    EXPECT_GT(balls.size(), 20u);
    for (std::size_t i = 0; i < balls.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
            EXPECT_GT(length(balls[i].center - balls[j].center), 0.5);
}

TEST(CoveringBalls, CubesAreCoveredWhole) {
    const auto balls =
        balls_over_cubes(std::vector<Vec3>{{0.26, 0.26, 0.26}, {0.7, 0.7, 0.7}}, 0.5);
    ASSERT_EQ(balls.size(), 1u);
    EXPECT_TRUE(covered(balls, {0.26, 0.74, 0.26}));
}

} // namespace
} // namespace taihu
