#include "mesh_out/part_sheets_detail.h"

#include <cmath>

#include <gtest/gtest.h>

#include "mesh_out/crossings_detail.h"
#include "tests/support/cube_mesh.h"

namespace taihu {
namespace {

const PositionGrid kGrid{{-2, -2, -2}, 1.0 / 64, 8};

/// A pyramid over a square: on the grid, its tip 1/8 above the square.
TriMesh pyramid(double tip_y) {
    return {{{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}, {0.5, tip_y, 0.5}},
            {{0, 1, 2}, {0, 2, 3}, {1, 0, 4}, {2, 1, 4}, {3, 2, 4}, {0, 3, 4}},
            {}};
}

/// Two pyramids over one square, the outer one's tip below the inner one's.
TriMesh crossing() {
    TriMesh mesh = pyramid(0.25);
    TriMesh other = pyramid(0.25 + 1.0 / 32);
    for (Vec3& p : other.positions)
        p.y -= 1.0 / 64;
    other.positions[4].x += 1.0 / 64;
    append(mesh, other);
    return mesh;
}

TEST(PartSheets, MovesVerticesUntilNothingCrosses) {
    TriMesh mesh = crossing();
    const TriMesh before = mesh;
    ASSERT_GT(count_crossings(mesh.positions, mesh.triangles), 0u);
    part_sheets(mesh, kGrid, 0.25);
    EXPECT_EQ(count_crossings(mesh.positions, mesh.triangles), 0u);
    EXPECT_EQ(mesh.triangles, before.triangles);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v)
        for (int k = 0; k < 3; ++k) {
            const double at = (mesh.positions[v][k] - kGrid.origin[k]) / kGrid.step_m;
            EXPECT_EQ(at, std::round(at));
            // Four passes of at most 1/4 along each axis; a few steps do here.
            EXPECT_LE(std::fabs(mesh.positions[v][k] - before.positions[v][k]), 0.25);
        }
}

TEST(PartSheets, LeavesASoundMeshAlone) {
    TriMesh mesh = cube({0.5, 0.5, 0.5});
    const TriMesh before = mesh;
    part_sheets(mesh, kGrid, 0.25);
    EXPECT_EQ(mesh.positions, before.positions);
}

TEST(PartSheets, GoesNoFartherThanItMay) {
    TriMesh mesh = crossing();
    const TriMesh before = mesh;
    part_sheets(mesh, kGrid, 0);
    EXPECT_EQ(mesh.positions, before.positions);
}

} // namespace
} // namespace taihu
