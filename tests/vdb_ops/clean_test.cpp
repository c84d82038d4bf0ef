#include "vdb_ops/clean.h"

#include <numbers>

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include "stats/core/rng.h"
#include "tests/support/errors.h"
#include "tests/support/grids.h"
#include "vdb_ops/carve.h"
#include "vdb_ops/combine_field.h"
#include "vdb_ops/level_set_box.h"
#include "vdb_ops/solids_field.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

constexpr double kPi = std::numbers::pi;

double ball_m3(double r) {
    return 4.0 / 3 * kPi * r * r * r;
}

openvdb::FloatGrid::Ptr balls(std::vector<Sphere> spheres, double voxel_m = 0.05) {
    return rasterize(BallsField(spheres), {voxel_m, {}, 3});
}

TEST(Clean, KeepsTheLargestPiece) {
    const auto three = balls({{{}, 1}, {{2, 0, 0}, 0.5}, {{-2, 0, 0}, 0.4}});
    const CleanResult result = clean(*three);
    EXPECT_EQ(result.n_pieces, 3u);
    EXPECT_EQ(result.n_pieces_removed, 2u);
    EXPECT_EQ(result.n_bubbles, 0u);
    EXPECT_NEAR(result.removed_m3, ball_m3(0.5) + ball_m3(0.4), 1e-3);
    EXPECT_EQ(grid_hash(*result.solid), grid_hash(*ball_rock()));
}

TEST(Clean, KeepsAsManyAsAskedFor) {
    const auto three = balls({{{}, 1}, {{2, 0, 0}, 0.5}, {{-2, 0, 0}, 0.4}});
    EXPECT_EQ(clean(*three, {.n_pieces = 2}).n_pieces_removed, 1u);
    const CleanResult all = clean(*three, {.n_pieces = std::nullopt});
    EXPECT_EQ(all.n_pieces_removed, 0u);
    EXPECT_EQ(grid_hash(*all.solid), grid_hash(*three));
}

TEST(Clean, SaysWhenMuchOfTheSolidFellOff) {
    const auto three = balls({{{}, 1}, {{2, 0, 0}, 0.5}, {{-2, 0, 0}, 0.4}});
    const auto said = crumbled_line(clean(*three)); // 0.189 of 1.189
    ASSERT_TRUE(said);
    EXPECT_THAT(*said, testing::HasSubstr("a share of 0.159 of the solid"));
    EXPECT_FALSE(crumbled_line(clean(*three, {.n_pieces = std::nullopt})));
    EXPECT_FALSE(crumbled_line(clean(*balls({{{}, 1}, {{2, 0, 0}, 0.3}}))));
}

TEST(Clean, FillsSealedBubblesAndKeepsOpenHoles) {
    const auto rock = ball_rock();
    const std::vector<Sphere> open = {{{0, 0, 0.9}, 0.4}};
    std::vector<Sphere> both = open;
    both.push_back({{0, 0, -0.3}, 0.3});
    const auto carved = carve(*rock, both).rock;
    const CleanResult result = clean(*carved);
    EXPECT_EQ(result.n_bubbles, 1u);
    EXPECT_EQ(result.n_bubbles_filled, 1u);
    EXPECT_NEAR(result.filled_m3, ball_m3(0.3), 1e-3);
    const auto expected = carve(*rock, open).rock;
    for (auto it = expected->cbeginValueOn(); it; ++it)
        ASSERT_NEAR(result.solid->tree().getValue(it.getCoord()), it.getValue(), 1e-6);
    EXPECT_EQ(result.solid->activeVoxelCount(), expected->activeVoxelCount());
    EXPECT_EQ(grid_hash(*clean(*carved, {.fill_bubbles = false}).solid), grid_hash(*carved));
}

TEST(Clean, ALargeBubbleWithUniformBlocksIsFilled) {
    const auto rock = ball_rock(4, 0.05); // 160 voxels across, bubble of 80
    const CleanResult result = clean(*carve(*rock, std::vector<Sphere>{{{}, 2}}).rock);
    EXPECT_EQ(result.n_bubbles_filled, 1u);
    EXPECT_NEAR(result.filled_m3, ball_m3(2), 0.01);
    EXPECT_EQ(grid_hash(*result.solid), grid_hash(*rock));
}

TEST(Clean, RebuildsDistancesBetweenNearSurfaces) {
    // A small ball two voxels beside a large one: removed, the gap's distances are the large one's
    // again.
    const auto two = balls({{{}, 1}, {{1.4, 0, 0}, 0.3}});
    const CleanResult result = clean(*two);
    const auto expected = ball_rock();
    for (auto it = expected->cbeginValueOn(); it; ++it)
        ASSERT_NEAR(result.solid->tree().getValue(it.getCoord()), it.getValue(), 0.2 * 0.05)
            << it.getCoord();
}

TEST(Clean, OfAHoledRockLeavesOnePieceWithoutBubblesAndIsIdempotent) {
    std::vector<Sphere> holes;
    for (std::uint64_t i = 0; i < 400; ++i) {
        const Rng rng{21, 1};
        holes.push_back(
            {{2 * rng.uniform(i, 0) - 1, 2 * rng.uniform(i, 1) - 1, 2 * rng.uniform(i, 2) - 1},
             0.05 + 0.12 * rng.uniform(i, 3)});
    }
    const auto carved = carve(*ball_rock(1, 0.025), holes).rock;
    const CleanResult once = clean(*carved);
    EXPECT_GT(once.n_pieces_removed, 0u);
    EXPECT_GT(once.n_bubbles_filled, 0u);
    EXPECT_NEAR(volume_m3(*once.solid), volume_m3(*carved) - once.removed_m3 + once.filled_m3,
                1e-9);
    const CleanResult twice = clean(*once.solid);
    EXPECT_EQ(twice.n_pieces, 1u);
    EXPECT_EQ(twice.n_bubbles, 0u);
    EXPECT_EQ(grid_hash(*twice.solid), grid_hash(*once.solid));
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(grid_hash(*clean(*carved).solid), grid_hash(*once.solid));
}

/// Two balls, a third that is loose, and a bar between the first two.
openvdb::FloatGrid::Ptr dumb_bell(double bar_radius_m, double voxel_m) {
    const auto ends = std::make_shared<BallsField>(
        std::array<Sphere, 3>{{{{-1.5, 0, 0}, 1}, {{1.5, 0, 0}, 0.8}, {{5, 0, 0}, 0.5}}});
    const Similarity turn = Similarity::rotation({0, 0, 1}, kPi / 2); // from Y to X
    const auto bar = std::make_shared<SolidsField>(
        std::vector<AnalyticSolid>{{CylinderSolid{bar_radius_m, 1.5, 0}, turn}});
    return rasterize(CombineField(Combine::unite, {ends, bar}), {voxel_m, {}, 3});
}

TEST(Clean, CutsNecksThatAreThinner) {
    // With a bar within the half band, and one of 20 voxels with uniform blocks inside it.
    for (const double voxel_m : {0.05, 0.02}) {
        const auto rock = dumb_bell(0.2, voxel_m);
        const CleanResult uncut = clean(*rock, {.min_neck_m = 0.3});
        EXPECT_EQ(uncut.n_necked, 0u);
        EXPECT_EQ(grid_hash(*uncut.solid), grid_hash(*clean(*rock).solid));
        const CleanResult cut = clean(*rock, {.min_neck_m = 0.5});
        EXPECT_EQ(cut.n_necked, 1u);
        EXPECT_EQ(cut.n_pieces_removed, 1u); // the loose ball
        const double left_m3 = volume_m3(*cut.solid);
        // The large ball, and at most the bar.
        EXPECT_GT(left_m3, 0.999 * ball_m3(1));
        EXPECT_LT(left_m3, ball_m3(1) + kPi * 0.04 * 1.3);
        EXPECT_NEAR(volume_m3(*rock) - cut.necked_m3 - cut.removed_m3, left_m3, 1e-9);
        EXPECT_LT(level_set_box(*cut.solid).hi.x, 0.7);
        EXPECT_NEAR(level_set_box(*cut.solid).lo.x, -2.5, 0.1 * voxel_m);
        EXPECT_EQ(clean(*cut.solid).n_pieces, 1u);
        const CleanResult both = clean(*rock, {.n_pieces = 2, .min_neck_m = 0.5});
        EXPECT_EQ(both.n_necked, 0u);
        EXPECT_EQ(both.n_pieces_removed, 1u);
    }
}

TEST(Clean, ACutIsALevelSet) {
    const CleanResult cut = clean(*dumb_bell(0.25, 0.02), {.min_neck_m = 0.6});
    // Signs change where there are distances alone, and those are of the surface beside them.
    for (auto it = cut.solid->cbeginValueOn(); it; ++it)
        for (int axis = 0; axis < 3; ++axis) {
            openvdb::Coord next = it.getCoord();
            ++next[axis];
            const float other = cut.solid->tree().getValue(next);
            // A step of one voxel, and as much again where the cut's steps meet the bar.
            ASSERT_LE(std::fabs(other - *it), 2.0f * 0.02f) << it.getCoord();
        }
    const auto values = cut.solid->getConstAccessor();
    for (int x = -130; x < 60; ++x)
        ASSERT_FALSE(values.getValue({x, 0, 0}) < 0 && values.getValue({x + 1, 0, 0}) >= 0.06f);
}

TEST(Clean, RefusesNecksOfAllPieces) {
    expect_error(Fault::bad_argument, "how many pieces stay",
                 [] { clean(*ball_rock(), {.n_pieces = std::nullopt, .min_neck_m = 0.1}); });
    expect_error(Fault::bad_argument, "min_neck_m is -1",
                 [] { clean(*ball_rock(), {.min_neck_m = -1}); });
}

TEST(Clean, RefusesNothing) {
    const auto gone = carve(*ball_rock(), std::vector<Sphere>{{{}, 2}}).rock;
    expect_error(Fault::bad_input, "nothing is left", [&] { clean(*gone); });
}

} // namespace
} // namespace taihu
