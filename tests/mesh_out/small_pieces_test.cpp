#include "mesh_out/small_pieces_detail.h"

#include <gtest/gtest.h>

#include "mesh_out/certificate.h"
#include "tests/support/cube_mesh.h"

namespace taihu {
namespace {

/// cube() with every position twice as a normal, scaled and moved.
void add_cube(TriMesh& mesh, double side_m, const Vec3& at) {
    const auto n = static_cast<std::uint32_t>(mesh.positions.size());
    TriMesh more = cube();
    for (const Vec3& p : more.positions) {
        mesh.positions.push_back(p * (side_m / bounds(more).longest()) + at);
        mesh.normals.push_back(at);
    }
    for (const Triangle& t : more.triangles)
        mesh.triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
}

TEST(SmallPieces, ThoseOfALengthGoAndTheOthersKeepTheirNormals) {
    TriMesh mesh;
    add_cube(mesh, 0.1, {5, 0, 0});
    add_cube(mesh, 3, {0, 0, 0});
    add_cube(mesh, 0.3, {0, 5, 0});
    const std::size_t n = cube().positions.size();
    const auto gone = drop_small_pieces(mesh, 0.2);
    EXPECT_EQ(gone.size(), n);
    for (const Vec3& p : gone)
        EXPECT_NEAR(p.x, 5, 0.2);
    EXPECT_EQ(mesh.positions.size(), 2 * n);
    EXPECT_TRUE(certify(mesh).holds());
    EXPECT_EQ(certify(mesh).n_components, 2u);
    EXPECT_EQ(mesh.normals.front(), (Vec3{0, 0, 0}));
    EXPECT_EQ(mesh.normals.back(), (Vec3{0, 5, 0}));
}

TEST(SmallPieces, TheLargestStaysHoweverSmall) {
    TriMesh mesh;
    add_cube(mesh, 0.1, {5, 0, 0});
    EXPECT_TRUE(drop_small_pieces(mesh, 1).empty());
    EXPECT_EQ(mesh.positions.size(), cube().positions.size());
}

} // namespace
} // namespace taihu
