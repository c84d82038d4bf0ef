#include "vdb_ops/mesh_field.h"

#include <tbb/global_control.h>

#include "stats/core/rng.h"
#include "tests/support/errors.h"
#include "tests/support/grids.h"
#include "tests/support/mesh_oracle.h"
#include "vdb_ops/shapes.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

/// Every `step`-th voxel of the box against brute force.
void expect_exact(const TriMesh& given, double voxel_m, int step) {
    const MeshField field(close_mesh(given, "mesh"));
    const auto grid = rasterize(field, {voxel_m, {}, 3});
    const auto accessor = grid->getConstAccessor();
    const Box box = bounds(given).dilated(4 * voxel_m);
    int n_near = 0;
    for (int i = int(box.lo.x / voxel_m); i <= int(box.hi.x / voxel_m); i += step)
        for (int j = int(box.lo.y / voxel_m); j <= int(box.hi.y / voxel_m); j += step)
            for (int k = int(box.lo.z / voxel_m); k <= int(box.hi.z / voxel_m); k += step) {
                const Vec3 p{i * voxel_m, j * voxel_m, k * voxel_m};
                const ClosedMesh& mesh = field.mesh();
                const double d = mesh_distance(mesh.positions, mesh.triangles, p);
                const float value = accessor.getValue(openvdb::Coord(i, j, k));
                if (d > 1e-9 * voxel_m) { // on the surface itself either side is right
                    ASSERT_EQ(
                        value<0, std::fabs(mesh_winding(mesh.positions, mesh.triangles, p))> 0.5)
                        << i << ' ' << j << ' ' << k;
                }
                // 1e-5 voxel: float rows of leaf-local coordinates.
                ASSERT_NEAR(std::fabs(value), std::min(d, 3 * voxel_m), 1e-5 * voxel_m);
                n_near += d < 3 * voxel_m;
            }
    EXPECT_GT(n_near, 100);
}

TEST(MeshField, BoulderIsExactAgainstBruteForce) {
    expect_exact(shape_mesh({.kind = ShapeKind::boulder, .subdivisions = 3}), 1.0 / 48, 2);
}

TEST(MeshField, TorusIsExactAgainstBruteForce) {
    expect_exact(
        shape_mesh(
            {.kind = ShapeKind::torus, .size_m = {1, 0.3, 1}, .tube_m = 0.3, .subdivisions = 4}),
        1.0 / 40, 2);
}

TEST(MeshField, CubeWithFacesOnVoxelPlanesHasTheRightSigns) {
    expect_exact(shape_mesh({.kind = ShapeKind::box}), 1.0 / 16, 1);
}

TEST(MeshField, ACubeOnVoxelPlanesIsOnePieceAtAnySize) {
    TriMesh cube = shape_mesh({.kind = ShapeKind::box});
    for (Vec3& p : cube.positions)
        p += Vec3{0.5, 0.5, 0.5};
    const MeshField field(close_mesh(cube, "cube"));
    for (const int dim : {10, 20, 33, 100, 250, 400}) {
        const auto grid = rasterize(field, {1.0 / dim, {}, 3});
        const auto accessor = grid->getConstAccessor();
        for (int i = -1; i <= dim + 1; ++i) // voxels on the surface are outside, all of them
            for (int j = -1; j <= dim + 1; j += dim / 10)
                for (const int k : {-1, 0, 1, dim / 2, dim - 1, dim, dim + 1}) {
                    const auto in = [dim](int a) { return a > 0 && a < dim; };
                    ASSERT_EQ(accessor.getValue(openvdb::Coord(i, j, k)) < 0,
                              in(i) && in(j) && in(k))
                        << dim << ": " << i << ' ' << j << ' ' << k;
                    ASSERT_EQ(accessor.getValue(openvdb::Coord(k, i, j)) < 0,
                              in(i) && in(j) && in(k));
                }
    }
}

TEST(MeshField, AMeshFarFromTheOriginLosesNothing) {
    TriMesh far = shape_mesh({.kind = ShapeKind::icosphere, .subdivisions = 2});
    for (Vec3& p : far.positions)
        p += Vec3{1000, -2000, 500};
    expect_exact(far, 1.0 / 24, 2);
}

TEST(MeshField, AnInvertedMeshGivesTheSameSolid) {
    TriMesh mesh = shape_mesh({.kind = ShapeKind::boulder, .subdivisions = 3});
    const MeshField right(close_mesh(mesh, "mesh"));
    for (Triangle& t : mesh.triangles)
        std::swap(t[1], t[2]);
    const MeshField wrong(close_mesh(mesh, "mesh"));
    const Lattice lattice{1.0 / 40, {}, 3};
    // Turning a face reverses the order of its corners, so the last bit of a distance may differ.
    const auto a = rasterize(right, lattice), b = rasterize(wrong, lattice);
    for (auto it = a->cbeginValueOn(); it; ++it)
        ASSERT_NEAR(it.getValue(), b->tree().getValue(it.getCoord()), 1e-6);
}

TEST(MeshField, WallsInsideAUnionVanish) {
    TriMesh two = shape_mesh({.kind = ShapeKind::box});
    const auto base = static_cast<std::uint32_t>(two.positions.size());
    for (const Vec3& p : shape_mesh({.kind = ShapeKind::box}).positions)
        two.positions.push_back(p + Vec3{0.53, 0.01, 0.02});
    for (std::size_t t = 0; t < 12; ++t)
        two.triangles.push_back(
            {two.triangles[t][0] + base, two.triangles[t][1] + base, two.triangles[t][2] + base});
    const auto grid = rasterize(MeshField(close_mesh(two, "two")), {1.0 / 32, {}, 3});
    // The wall x = 1/2 of the first box runs through the inside of the second.
    EXPECT_FLOAT_EQ(grid->tree().getValue(openvdb::Coord(16, 0, 0)), -3.f / 32);
    EXPECT_NEAR(volume_m3(*grid), 1 + 1 - 0.47 * 0.99 * 0.98, 0.002);
}

TEST(MeshField, ACavityIsRemoved) {
    TriMesh mesh =
        shape_mesh({.kind = ShapeKind::icosphere, .size_m = {2, 2, 2}, .subdivisions = 4});
    TriMesh inner = shape_mesh({.kind = ShapeKind::icosphere, .subdivisions = 4});
    const double outer_m3 = signed_volume_m3(mesh), inner_m3 = signed_volume_m3(inner);
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), inner.positions.begin(), inner.positions.end());
    for (const Triangle& t : inner.triangles)
        mesh.triangles.push_back({t[1] + base, t[0] + base, t[2] + base});
    const auto grid = rasterize(MeshField(close_mesh(mesh, "hollow")), {1.0 / 32, {}, 3});
    EXPECT_GT(grid->tree().getValue(openvdb::Coord(0)), 0);
    EXPECT_NEAR(volume_m3(*grid), outer_m3 - inner_m3, 1e-3);
}

TEST(MeshField, ASolidInsideACavityIsThere) {
    TriMesh mesh;
    double expected = 0;
    for (const auto& [size, sign] : {std::pair(2.0, 1), std::pair(1.6, -1), std::pair(0.8, 1)}) {
        const TriMesh ball = shape_mesh(
            {.kind = ShapeKind::icosphere, .size_m = {size, size, size}, .subdivisions = 3});
        const auto base = static_cast<std::uint32_t>(mesh.positions.size());
        mesh.positions.insert(mesh.positions.end(), ball.positions.begin(), ball.positions.end());
        for (Triangle t : ball.triangles) {
            if (sign < 0)
                std::swap(t[0], t[1]);
            mesh.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
        }
        expected += sign * signed_volume_m3(ball);
    }
    const auto grid = rasterize(MeshField(close_mesh(mesh, "nested")), {1.0 / 32, {}, 3});
    EXPECT_LT(grid->tree().getValue(openvdb::Coord(0)), 0);
    EXPECT_GT(grid->tree().getValue(openvdb::Coord(0, 0, 19)), 0);
    EXPECT_NEAR(volume_m3(*grid), expected, 2e-3);
}

TEST(MeshField, IsBitIdenticalOnOneThreadAndMany) {
    const MeshField field(close_mesh(shape_mesh({}), "boulder"));
    const std::string many = grid_hash(*rasterize(field, {1.0 / 128, {}, 3}));
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(grid_hash(*rasterize(field, {1.0 / 128, {}, 3})), many);
}

} // namespace
} // namespace taihu
