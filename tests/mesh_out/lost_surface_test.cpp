#include "mesh_out/lost_surface_detail.h"

#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "mesh_out/extract.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/clean.h"
#include "vdb_ops/combine_field.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

using Balls = std::vector<Sphere>;

std::shared_ptr<const Field> balls(Balls of) {
    return std::make_shared<BallsField>(std::move(of));
}

std::vector<Vec3> lost(const openvdb::FloatGrid& solid, const Field& field) {
    const auto probe = field.probe({{-60, -60, -60}, {60, 60, 60}}, 2);
    const LabelledMesh seen = extract(solid, &field, {.bound_vox = 0.25});
    return lost_surface(solid, *probe, SurfaceDistance({seen.positions, seen.triangles, {}}), 0.2);
}

std::vector<Vec3> lost(const Field& field) {
    return lost(*rasterize(field, Lattice{1, {}, 3}), field);
}

TEST(LostSurface, NothingIsLostWhereVoxelsSeeAll) {
    EXPECT_TRUE(lost(*balls({{{0.3, 0.2, 0.1}, 20}})).empty());
    EXPECT_TRUE(lost(*balls({{{0.3, 0.2, 0.1}, 20}, {{-9, 41, 2}, 12}})).empty());
}

TEST(LostSurface, FindsAWallBetweenTwoLayersOfVoxels) {
    // Two holes of radius 30 leave a wall that is 0.3 voxels thick in its middle, between x = 0 and
    // x = 1, where no lattice point is.
    const DifferenceField wall(balls({{{0, 0, 0}, 50}}),
                               balls({{{-29.65, 0, 0}, 30}, {{30.65, 0, 0}, 30}}));
    const auto points = lost(wall);
    const auto probe = wall.probe({{-60, -60, -60}, {60, 60, 60}}, 2);
    // Thinner than 0.35 + 0.3 voxels on either side of a layer up to r: r^2 / 30 < 0.35.
    std::size_t n_middle = 0;
    for (const Vec3& p : points) {
        EXPECT_NEAR(probe->at(p).value_m, 0, 1e-4); // of a voxel: to what projections go
        n_middle += std::hypot(p.y, p.z) < 3 && p.x > 0.3 && p.x < 0.7;
    }
    EXPECT_GT(n_middle, 112u); // half of 8 about each of the 28 lattice points of that disc
    // Every point of that disc has one within half a voxel.
    for (double y = -2; y <= 2; y += 0.5)
        for (double z = -2; z <= 2; z += 0.5) {
            double least = 9;
            for (const Vec3& p : points)
                least = std::min(least, length(p - Vec3{0.35, y, z}));
            EXPECT_LT(least, 0.5);
        }
}

TEST(LostSurface, FindsTheEdgeOfAWedgeBeyondTheLastVoxel) {
    // What two balls of radius 30 have in common, 4 voxels thick, is a lens whose rim is sharp: the
    // extracted surface ends where voxels do, or runs along the rim.
    const auto field = std::make_shared<CombineField>(
        Combine::intersect, std::vector<std::shared_ptr<const Field>>{
                                balls({{{-28.1, 0.3, 0.2}, 30}}), balls({{{28.1, 0.3, 0.2}, 30}})});
    const double rim = std::sqrt(30 * 30 - 28.1 * 28.1);
    for (const Vec3& p : lost(*field)) {
        EXPECT_NEAR(std::hypot(p.y - 0.3, p.z - 0.2), rim, 1.5); // nowhere but near the rim
        EXPECT_NEAR(field->probe({{-60, -60, -60}, {60, 60, 60}}, 2)->at(p).value_m, 0, 1e-4);
    }
}

TEST(LostSurface, FindsABallBetweenVoxels) {
    const auto field = balls({{{0, 0, 0}, 10}, {{20.5, 0.5, 0.5}, 0.6}});
    const auto points = lost(*field);
    ASSERT_FALSE(points.empty());
    for (const Vec3& p : points)
        EXPECT_NEAR(length(p - Vec3{20.5, 0.5, 0.5}), 0.6, 1e-4);
}

TEST(LostSurface, WhatWasFilledOrRemovedIsNotLost) {
    // Bubbles and specks that one to eight lattice points see.
    const DifferenceField field(
        balls({{{0.3, 0.2, 0.1}, 20}, {{30, 0, 0}, 1.2}, {{-31.5, 0.4, 0.4}, 1.1}}),
        balls({{{1, 2, 3}, 0.9}, {{-8.5, 0.5, 0.5}, 1.2}, {{0.5, 11, -4}, 1.4}}));
    const auto solid = rasterize(field, Lattice{1, {}, 3});
    EXPECT_FALSE(lost(field).empty());
    const CleanResult cleaned = clean(*solid);
    ASSERT_EQ(cleaned.n_bubbles_filled, 3u);
    ASSERT_EQ(cleaned.n_pieces_removed, 2u);
    EXPECT_TRUE(lost(*cleaned.solid, field).empty());
}

} // namespace
} // namespace taihu
