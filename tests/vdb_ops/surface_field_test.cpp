#include "vdb_ops/surface_field.h"

#include <gtest/gtest.h>

#include "tests/support/cube_mesh.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/closed_mesh.h"
#include "vdb_ops/mesh_field.h"
#include "vdb_ops/placed_level_set_field.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/superquadric_field.h"

namespace taihu {
namespace {

/// Whether the surface is made of the level set.
bool is_sampled(const std::shared_ptr<const Field>& field, double voxel_m) {
    const auto grid = rasterize(*field, Lattice{voxel_m, {}, 3});
    const auto of = surface_field(field, grid);
    EXPECT_TRUE(of == field || dynamic_cast<const PlacedLevelSetField*>(of.get()));
    return of != field;
}

TEST(SurfaceField, KeepsEdgesOfMeshesThatAreCoarserThanVoxels) {
    const auto block = std::make_shared<MeshField>(close_mesh(cube(), "cube"));
    EXPECT_FALSE(is_sampled(block, 0.05));
    EXPECT_TRUE(is_sampled(block, 0.4)); // 12 faces of 3 voxels
}

TEST(SurfaceField, SamplesWhatIsSmoothAndSlow) {
    const TriMesh boulder = shape_mesh({.kind = ShapeKind::boulder, .subdivisions = 4});
    EXPECT_TRUE(is_sampled(std::make_shared<MeshField>(close_mesh(boulder, "boulder")), 0.02));
    EXPECT_TRUE(is_sampled(
        std::make_shared<SuperquadricField>(Superquadric{{0.4, 0.5, 0.4}, 1, 1}, Similarity()),
        0.05));
    EXPECT_FALSE(
        is_sampled(std::make_shared<BallsField>(std::vector<Sphere>{{{0, 0, 0}, 0.5}}), 0.05));
}

} // namespace
} // namespace taihu
