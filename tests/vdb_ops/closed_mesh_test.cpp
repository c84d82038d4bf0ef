#include "vdb_ops/closed_mesh.h"

#include "tests/support/cube_mesh.h"
#include "tests/support/errors.h"

namespace taihu {
namespace {

using testing::Contains;
using testing::HasSubstr;

double volume(const ClosedMesh& closed) {
    return signed_volume_m3({closed.positions, closed.triangles, {}});
}

TEST(CloseMesh, LeavesAClosedMeshAsItIs) {
    const ClosedMesh closed = close_mesh(cube(), "cube", CloseRule::none);
    EXPECT_EQ(closed.triangles.size(), 12u);
    EXPECT_NEAR(volume(closed), 1, 1e-14);
    EXPECT_TRUE(closed.diagnosis.lines().empty());
}

TEST(CloseMesh, NamesTheLoopsThatWereCapped) {
    TriMesh open = cube();
    open.triangles.resize(10);
    EXPECT_THAT(close_mesh(open, "cube").diagnosis.lines(),
                Contains(HasSubstr("open: 4 edges in 1 loops, closed with caps = 17 % of the")));
}

TEST(CloseMesh, RefusesAnOpenMeshUnderNone) {
    TriMesh open = cube();
    open.triangles.resize(10);
    expect_error(Fault::bad_input, "cube: open: 4 open edges in 1 loops",
                 [&] { close_mesh(open, "cube", CloseRule::none); });
    expect_error(Fault::bad_input, "--close loops",
                 [&] { close_mesh(open, "cube", CloseRule::none); });
}

TEST(CloseMesh, AShellTurnedInwardInsideAnotherIsACavity) {
    TriMesh inner = cube({}, 0.5);
    flip(inner);
    TriMesh mesh = cube();
    append(mesh, inner);
    const ClosedMesh closed = close_mesh(mesh, "nested");
    EXPECT_EQ(closed.diagnosis.n_solids, 1u);
    EXPECT_EQ(closed.diagnosis.n_cavities, 1u);
    EXPECT_EQ(closed.diagnosis.n_inverted, 0u);
}

TEST(CloseMesh, AnInvertedMeshIsNamed) {
    TriMesh mesh = cube();
    flip(mesh);
    EXPECT_EQ(close_mesh(mesh, "cube").diagnosis.n_inverted, 1u);
}

TEST(CloseMesh, WeldsCracksWhenNothingElseHasAnInside) {
    TriMesh soup; // each corner off by up to 1e-6 of the size: twelve loose faces
    const TriMesh base = cube();
    for (std::size_t i = 0; i < base.triangles.size(); ++i) {
        for (const std::uint32_t v : base.triangles[i])
            soup.positions.push_back(base.positions[v] +
                                     Vec3{1e-6 * double(i % 3), -1e-6 * double(i % 2), 0});
        const auto n = static_cast<std::uint32_t>(soup.positions.size());
        soup.triangles.push_back({n - 3, n - 2, n - 1});
    }
    const ClosedMesh closed = close_mesh(soup, "cracked");
    EXPECT_GT(closed.diagnosis.weld_tolerance_m, 0);
    EXPECT_NEAR(volume(closed), 1, 1e-4);
    EXPECT_THAT(closed.diagnosis.lines(), Contains(HasSubstr("cracks welded")));
}

TEST(CloseMesh, RefusesWhatHasNoInside) {
    const TriMesh sheet{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}, {}};
    expect_error(Fault::bad_input, "sheet.obj: no inside", [&] { close_mesh(sheet, "sheet.obj"); });
    expect_error(Fault::bad_input, "no inside", [] { close_mesh({}, "empty"); });
}

} // namespace
} // namespace taihu
