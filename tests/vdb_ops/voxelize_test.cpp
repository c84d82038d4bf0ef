#include "vdb_ops/voxelize.h"

#include "tests/support/errors.h"
#include "vdb_ops/shapes.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

TEST(Voxelize, KeepsTheVolumeOfTheMesh) {
    const TriMesh mesh = shape_mesh({.size_m = {1, 0.8, 0.7}, .subdivisions = 4});
    const VoxelizeResult result = voxelize(mesh, "boulder", {.voxel_m = 1.0 / 128});
    EXPECT_NEAR(volume_m3(*result.solid), signed_volume_m3(mesh), 1e-4);
    EXPECT_TRUE(result.diagnosis.lines().empty());
}

TEST(Voxelize, VoxelForPutsDimVoxelsAlongTheLongestAxis) {
    EXPECT_DOUBLE_EQ(voxel_for({{0, 0, 0}, {1, 2, 0.5}}, 256), 2.0 / 256);
    expect_error(Fault::bad_argument, "4..65536", [] { voxel_for({{0, 0, 0}, {1, 1, 1}}, 3); });
    expect_error(Fault::bad_argument, "no extent", [] { voxel_for({}, 64); });
}

TEST(Voxelize, RefusesWhatCannotFitBeforeItStarts) {
    const TriMesh mesh = shape_mesh({.subdivisions = 2});
    expect_error(Fault::unsupported, "refused: voxel size 1.00e-06 m would need about",
                 [&] { voxelize(mesh, "boulder", {.voxel_m = 1e-6}); });
    expect_error(Fault::unsupported, "smallest that fits",
                 [&] { voxelize(mesh, "boulder", {.voxel_m = 1e-6}); });
}

TEST(Voxelize, RefusesFewerThanFourVoxels) {
    const TriMesh grain = shape_mesh({.size_m = {1e-3, 1e-3, 1e-3}, .subdivisions = 1});
    expect_error(Fault::bad_argument, "must be at least 4",
                 [&] { voxelize(grain, "grain", {.voxel_m = 0.5e-3}); });
}

TEST(Voxelize, BadCornersAreCountedAndHarmNothing) {
    TriMesh mesh = shape_mesh({.subdivisions = 2});
    mesh.triangles.push_back({0, 1, 9999});
    mesh.positions.push_back({INFINITY, 0, 0});
    mesh.triangles.push_back({0, 1, static_cast<std::uint32_t>(mesh.positions.size() - 1)});
    EXPECT_EQ(voxelize(mesh, "boulder", {.voxel_m = 0.05}).diagnosis.n_bad, 2u);
}

} // namespace
} // namespace taihu
