#include "mesh_out/creases.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/cube_mesh.h"
#include "tests/support/errors.h"
#include "vdb_ops/icosphere.h"

namespace taihu {
namespace {

TEST(Creases, ACubeKeepsItsEdgesAndItsFacesStayFlat) {
    const CreasedMesh creased = with_creases(cube(), 60);
    EXPECT_EQ(creased.mesh.positions.size(), 24u); // four to a face
    EXPECT_EQ(creased.mesh.triangles.size(), 12u);
    for (const Triangle& t : creased.mesh.triangles) {
        const auto& p = creased.mesh.positions;
        const Vec3 n = normalized(cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]]));
        for (const std::uint32_t v : t)
            EXPECT_LT(length(creased.mesh.normals[v] - n), 1e-12);
    }
}

TEST(Creases, ABallHasNoneAndItsNormalsAreItsRadii) {
    const TriMesh ball = icosphere(3); // edges turn by 8 degrees
    const CreasedMesh smooth = with_creases(ball, 30);
    EXPECT_EQ(smooth.mesh.positions.size(), ball.positions.size());
    for (std::size_t i = 0; i < smooth.mesh.positions.size(); ++i) // of its five or six faces
        EXPECT_GT(dot(smooth.mesh.normals[i], normalized(smooth.mesh.positions[i])),
                  std::cos(0.02));
    EXPECT_EQ(with_creases(ball, 0).mesh.positions.size(), 3 * ball.triangles.size());
}

TEST(Creases, WeldsEqualPositionsAndLeavesOutWhatHasNoArea) {
    TriMesh torn = cube();
    torn.positions.push_back(torn.positions[torn.triangles[0][0]]);
    torn.triangles[0][0] = static_cast<std::uint32_t>(torn.positions.size() - 1);
    torn.triangles.push_back({0, 1, 1});
    const CreasedMesh creased = with_creases(torn, 180);
    EXPECT_EQ(creased.mesh.positions.size(), 8u);
    EXPECT_EQ(creased.n_degenerate, 1u);
}

TEST(Creases, RefusesWhatItCannotShade) {
    expect_error(Fault::bad_argument, "must be 0..180", [] { with_creases(cube(), 181); });
    TriMesh flat = cube();
    flat.triangles = {{0, 0, 1}};
    expect_error(Fault::bad_input, "no triangle has an area", [&] { with_creases(flat, 60); });
}

} // namespace
} // namespace taihu
