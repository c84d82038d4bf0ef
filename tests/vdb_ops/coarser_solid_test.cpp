#include "vdb_ops/coarser_solid.h"

#include <numbers>

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include "stats/core/error.h"
#include "tests/support/grids.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/clean.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

constexpr double kVoxel = 0.05;

double ball_m3(double r) {
    return 4.0 / 3 * std::numbers::pi * r * r * r;
}

openvdb::FloatGrid::Ptr balls(const std::vector<Sphere>& spheres) {
    return rasterize(BallsField(spheres), {kVoxel, {}, 3});
}

openvdb::FloatGrid::Ptr without(const std::vector<Sphere>& holes) {
    const DifferenceField field(std::make_shared<BallsField>(std::vector<Sphere>{{{0, 0, 0}, 1}}),
                                std::make_shared<BallsField>(holes));
    return rasterize(field, {kVoxel, {}, 3});
}

/// A cave of radius 0.5 that a pipe of radius 0.045 leads to.
openvdb::FloatGrid::Ptr cave() {
    std::vector<Sphere> holes = {{{0, 0, 0}, 0.5}};
    for (double x = 0.5; x < 1.05; x += 0.01)
        holes.push_back({{x, 0, 0}, 0.045});
    return without(holes);
}

TEST(CoarserSolid, GrowsOnTheVoxelsAskedFor) {
    const auto result = coarser_solid(*balls({{{}, 1}}), {.coarser = 2, .grow_m = 0.06});
    EXPECT_NEAR(result.solid->voxelSize()[0], 2 * kVoxel, 1e-12);
    // Half a percent: linear surfaces between voxels of a tenth of the radius.
    EXPECT_NEAR(volume_m3(*result.solid), ball_m3(1.06), 0.005 * ball_m3(1.06));
    EXPECT_TRUE(result.closed.empty());
}

TEST(CoarserSolid, ThinWallsStayWhole) {
    // A hollow ball with a wall of a voxel and a half, less than one of the result.
    const auto shell = without({{{0, 0, 0}, 1 - 1.5 * kVoxel}});
    const auto result = coarser_solid(*shell, {.coarser = 2, .grow_m = kVoxel});
    EXPECT_EQ(clean(*result.solid).n_bubbles, 1u); // and is not filled: it was sealed before
    EXPECT_TRUE(result.closed.empty());
    const auto lost = coarser_solid(*shell, {.coarser = 4, .grow_m = 0});
    EXPECT_EQ(clean(*lost.solid).n_bubbles, 0u);
}

TEST(CoarserSolid, FillsWhatOnlyANarrowWayLeadsTo) {
    const auto result = coarser_solid(*cave(), {.coarser = 1, .grow_m = kVoxel});
    ASSERT_FALSE(result.closed.empty());
    EXPECT_LE(length(result.closed[0].center), kVoxel);
    EXPECT_NEAR(result.closed[0].radius_m, 0.5, kVoxel); // of the largest ball between samples
    for (std::size_t i = 1; i < result.closed.size(); ++i)
        EXPECT_LE(result.closed[i].radius_m, result.closed[i - 1].radius_m);
    EXPECT_NEAR(volume_m3(*result.solid), ball_m3(1 + kVoxel), 0.01 * ball_m3(1));
}

TEST(CoarserSolid, LeavesOpenWhatIsWideEnough) {
    const auto result = coarser_solid(*cave(), {.coarser = 1, .grow_m = 0.2 * kVoxel});
    EXPECT_TRUE(result.closed.empty());
    EXPECT_EQ(clean(*result.solid).n_bubbles, 0u);
    EXPECT_NEAR(volume_m3(*result.solid), ball_m3(1.01) - ball_m3(0.49), 0.01);
}

TEST(CoarserSolid, PartsMakeNoDifference) {
    // 320 voxels apart, so in two parts.
    const double far_m = 320 * kVoxel;
    const auto two =
        coarser_solid(*balls({{{}, 0.5}, {{far_m, 0, 0}, 0.5}}), {.coarser = 2, .grow_m = 0.02});
    const auto one = coarser_solid(*balls({{{}, 0.5}}), {.coarser = 2, .grow_m = 0.02});
    const auto a = two.solid->getConstAccessor(), b = one.solid->getConstAccessor();
    for (int x = -8; x <= 8; ++x)
        for (int y = -8; y <= 8; ++y)
            for (int z = -8; z <= 8; ++z) {
                ASSERT_EQ(a.getValue({x, y, z}), b.getValue({x, y, z}));
                // Rounding of the field, so far from the origin.
                ASSERT_NEAR(a.getValue({x + 160, y, z}), b.getValue({x, y, z}), 1e-5);
            }
}

TEST(CoarserSolid, IsTheSameOnOneThreadAndMany) {
    const auto many = coarser_solid(*cave(), {.coarser = 2, .grow_m = kVoxel});
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    const auto one = coarser_solid(*cave(), {.coarser = 2, .grow_m = kVoxel});
    EXPECT_EQ(grid_hash(*many.solid), grid_hash(*one.solid));
    EXPECT_EQ(many.closed, one.closed);
}

TEST(CoarserSolid, IsNullWhereNoVoxelIsInside) {
    const auto crumb = balls({{{0.1, 0.1, 0.1}, 0.06}});
    EXPECT_EQ(coarser_solid(*crumb, {.coarser = 8, .grow_m = 0}).solid, nullptr);
    EXPECT_NE(coarser_solid(*crumb, {.coarser = 1, .grow_m = 0}).solid, nullptr);
}

void expect_refused(const CoarserSettings& settings, const char* text) {
    try {
        coarser_solid(*balls({{{}, 0.5}}), settings);
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::bad_argument);
        EXPECT_THAT(e.what(), testing::HasSubstr(text));
    }
}

TEST(CoarserSolid, NamesTheSettingOutOfRange) {
    expect_refused({.coarser = 0}, "coarser is 0, must be 1..8");
    expect_refused({.coarser = 9}, "coarser is 9");
    expect_refused({.coarser = 1, .grow_m = -1}, "grow_m is -1, must be 0..0.05");
    expect_refused({.coarser = 2, .grow_m = 0.11}, "grow_m is 0.11, must be 0..0.1");
    expect_refused({.coarser = 1, .grow_m = NAN}, "grow_m is nan");
}

} // namespace
} // namespace taihu
