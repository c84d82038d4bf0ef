#include "vdb_ops/cube_lists_detail.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "stats/core/rng.h"

namespace taihu {
namespace {

constexpr double kWidth = 3;
constexpr int kSize = 8;
const openvdb::Coord kCubes(4, 3, 5);

VoxelBall some_ball(std::uint64_t i) {
    const Rng rng{4, 1};
    return {{60 * rng.uniform(i, 0) - 10, 50 * rng.uniform(i, 1) - 10, 60 * rng.uniform(i, 2) - 10},
            i % 10 == 0 ? 14 + 12 * rng.uniform(i, 3) : 4 * rng.uniform(i, 3)};
}

/// Distances to the nearest and the farthest voxel of a cube.
std::pair<double, double> reach(const Vec3& p, int i, int j, int k) {
    double nearest = 1e300, farthest = 0;
    for (int v = 0; v < kSize * kSize * kSize; ++v) {
        const double d = length(
            Vec3{i * kSize + v / 64 - p.x, j * kSize + v / 8 % 8 - p.y, k * kSize + v % 8 - p.z});
        nearest = std::min(nearest, d);
        farthest = std::max(farthest, d);
    }
    return {nearest, farthest};
}

TEST(CubeLists, HoldTheBallsWhoseBandsMeetACubeThatNoBallCovers) {
    constexpr std::uint32_t kBalls = 60;
    CubeLists lists(kSize, kCubes, kWidth);
    CubeLists::Hits hits;
    for (std::uint32_t b = 0; b < kBalls; ++b)
        lists.find(some_ball(b), b, hits);
    lists.sort({&hits, 1});
    int n_covered = 0, n_listed = 0;
    for (int i = 0; i < kCubes.x(); ++i)
        for (int j = 0; j < kCubes.y(); ++j)
            for (int k = 0; k < kCubes.z(); ++k) {
                std::vector<std::uint32_t> expected;
                bool covered = false;
                for (std::uint32_t b = 0; b < kBalls; ++b) {
                    const auto [nearest, farthest] = reach(some_ball(b).center, i, j, k);
                    if (nearest < some_ball(b).r + kWidth)
                        expected.push_back(b);
                    covered = covered || farthest <= some_ball(b).r - kWidth;
                }
                const std::size_t cube = lists.index(i, j, k);
                const auto listed = lists.balls(cube);
                if (covered)
                    expected.clear();
                EXPECT_TRUE(
                    std::equal(listed.begin(), listed.end(), expected.begin(), expected.end()));
                EXPECT_EQ(lists.cover(cube), covered            ? Cover::inside
                                             : expected.empty() ? Cover::outside
                                                                : Cover::surface);
                n_covered += covered;
                n_listed += static_cast<int>(expected.size());
            }
    EXPECT_GT(n_covered, 2);
    EXPECT_GT(n_listed, 100);
}

TEST(CubeLists, LookAtNoMoreThanTheBoxOfABall) {
    const CubeLists lists(kSize, kCubes, kWidth);
    EXPECT_EQ(lists.n_looked_at({{12, 12, 12}, 0.5}), 1); // 8..15 each way
    EXPECT_EQ(lists.n_looked_at({{12, 12, 12}, 2}), 27);
    EXPECT_EQ(lists.n_looked_at({{12, 12, 12}, 1e9}), 60);
    EXPECT_EQ(lists.n_looked_at({{-100, 12, 12}, 5}), 0);
}

} // namespace
} // namespace taihu
