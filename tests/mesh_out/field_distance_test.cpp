#include "mesh_out/field_distance.h"

#include <cmath>

#include <gmock/gmock.h>

#include "mesh_out/extract.h"
#include "stats/core/error.h"
#include "stats/core/rng.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/carve.h"
#include "vdb_ops/placed_level_set_field.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/shapes.h"

namespace taihu {
namespace {

const BallsField kBall(std::vector<Sphere>{{{0, 0, 0}, 0.5}});

TriMesh icosphere(int subdivisions) {
    return shape_mesh({.kind = ShapeKind::icosphere, .subdivisions = subdivisions});
}

/// How far the faces of an inscribed mesh lie below the ball, at most.
double depth(const TriMesh& mesh) {
    double most = 0;
    for (const Triangle& t : mesh.triangles)
        most = std::max(
            most,
            0.5 - length((mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3));
    return most;
}

TEST(FieldDistance, OfAnInscribedMeshIsTheDepthOfItsFaces) {
    const TriMesh mesh = icosphere(2);
    const auto probe = kBall.probe(bounds(mesh).dilated(1), 1);
    const double limit_m = 0.5 * depth(mesh);
    const FieldDistance d = field_distance(mesh, *probe, icosphere(5), 0.01, limit_m);
    EXPECT_NEAR(d.max_to_field_m, depth(mesh), 0.02 * depth(mesh)); // samples miss the middles
    // Back, from points of the ball, to the nearest face below them.
    EXPECT_NEAR(d.max_from_field_m, depth(mesh), 0.05 * depth(mesh));
    EXPECT_DOUBLE_EQ(d.max_m, std::max(d.max_to_field_m, d.max_from_field_m));
    EXPECT_GT(d.rms_m, 0.4 * d.max_m);
    EXPECT_LT(d.rms_m, d.max_m);
    ASSERT_FALSE(d.beyond.empty());
    for (const Vec3& p : d.beyond)
        EXPECT_LT(length(p), 0.5 + 1e-6); // the mesh's own, or the finer one's
}

TEST(FieldDistance, WhatIsKeptApartCountsApart) {
    TriMesh mesh = icosphere(4);
    mesh.positions[0] *= 1.2; // a spike of 0.1
    const Sphere spike{mesh.positions[0], 0.15};
    const auto probe = kBall.probe(bounds(mesh).dilated(1), 1);
    const TriMesh surface = icosphere(4);
    const FieldDistance all = field_distance(mesh, *probe, surface, 0.01, 0.02);
    EXPECT_NEAR(all.max_m, 0.1, 1e-6);
    EXPECT_EQ(all.worst, mesh.positions[0]);
    const FieldDistance rest = field_distance(mesh, *probe, surface, 0.01, 0.02, {&spike, 1});
    EXPECT_NEAR(rest.max_apart_m, 0.1, 1e-6);
    EXPECT_LT(rest.max_m, 0.02);
    EXPECT_TRUE(rest.beyond.empty());
    EXPECT_EQ(rest.n_samples, all.n_samples);
}

TEST(FieldDistance, IsNotMisledByValuesThatAreNoDistances) {
    // Walls of a voxel between many holes: between its voxels the level set is anything but even.
    std::vector<Sphere> holes;
    const Rng rng{5, 0};
    for (std::uint64_t i = 0; i < 400; ++i)
        holes.push_back({{rng.uniform(i, 0) - .5, rng.uniform(i, 1) - .5, rng.uniform(i, 2) - .5},
                         0.05 + 0.03 * rng.uniform(i, 3)});
    const double voxel_m = 1. / 48;
    const auto block =
        rasterize(*shape_field({.kind = ShapeKind::box, .size_m = {1, 1, 1}}), {voxel_m, {}, 3});
    const openvdb::FloatGrid::Ptr rock = carve(*block, holes).rock;
    const TriMesh mesh = extract_uniform(*rock);
    const PlacedLevelSetField field(rock->deepCopy());
    const auto probe = field.probe(bounds(mesh).dilated(8 * voxel_m), 4 * voxel_m);
    const FieldDistance d = field_distance(mesh, *probe, mesh, voxel_m, 0.25 * voxel_m);
    EXPECT_GT(d.beyond.size(), 100);      // it is rough
    EXPECT_LT(d.max_to_field_m, voxel_m); // every vertex is in a cell with the surface
}

TEST(FieldDistance, RefusesWhatIsNone) {
    const TriMesh mesh = icosphere(1);
    const auto probe = kBall.probe(bounds(mesh).dilated(1), 1);
    const auto refused = [&](const TriMesh& a, double spacing_m) {
        try {
            field_distance(a, *probe, mesh, spacing_m, 1);
        } catch (const Error& e) {
            return std::string(e.what());
        }
        return std::string();
    };
    EXPECT_THAT(refused({}, 0.1), testing::HasSubstr("a mesh is empty"));
    EXPECT_THAT(refused(mesh, 1e-9), testing::HasSubstr("spacing_m is 0.0"));
}

} // namespace
} // namespace taihu
