#include "vdb_ops/closed_mesh.h"

#include <cmath>

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
    const ClosedMesh closed = close_mesh(cube(), "cube", {CloseRule::none});
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
                 [&] { close_mesh(open, "cube", {CloseRule::none}); });
    expect_error(Fault::bad_input, "--close loops",
                 [&] { close_mesh(open, "cube", {CloseRule::none}); });
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

/// Two halves of a cube side by side, `gap` apart, that share nothing.
TriMesh halves(double gap) {
    TriMesh mesh = cube();
    const auto n = static_cast<std::uint32_t>(mesh.positions.size());
    for (std::uint32_t v = 0; v < n; ++v)
        mesh.positions.push_back(mesh.positions[v] + Vec3{0, gap, gap});
    for (std::size_t f = 6; f < 12; ++f)
        for (std::uint32_t& v : mesh.triangles[f])
            v += n;
    return mesh;
}

TEST(CloseMesh, WeldsCracksAtTheLeastToleranceThatClosesThem) {
    // The diagonal of a cube is 1.73: 1e-7 of it lies below all tolerances, 4e-6 between two.
    EXPECT_EQ(close_mesh(halves(1e-7), "cube").diagnosis.weld_share, 1e-6);
    EXPECT_EQ(close_mesh(halves(7e-6), "cube").diagnosis.weld_share, 1e-5);
    const ClosedMesh closed = close_mesh(halves(7e-5), "cube");
    EXPECT_EQ(closed.diagnosis.weld_share, 1e-4);
    EXPECT_EQ(closed.diagnosis.n_open_edges, 0u);
    EXPECT_THAT(closed.diagnosis.lines(), Contains(HasSubstr("(1e-04 of its diagonal)")));
    const RepairedMesh apart = repair_mesh(halves(0.01), std::nullopt, CloseRule::loops);
    EXPECT_EQ(apart.diagnosis.weld_share, 0); // an opening, no crack
    EXPECT_EQ(apart.diagnosis.loops.size(), 2u);
}

TEST(CloseMesh, NamesAShellThatOverlapsItself) {
    TriMesh mesh = cube();
    append(mesh, cube({0.25, 0.25, 0}));
    EXPECT_EQ(close_mesh(mesh, "two").diagnosis.n_overlapping, 0u);
    TriMesh twice; // a ring that runs round twice and through itself
    const int n = 24;
    for (int i = 0; i < n; ++i) {
        const double a = 4 * 3.14159265358979 * i / n, r = 1 + 0.2 * std::sin(a / 2);
        const Vec3 middle{r * std::cos(a), 0.05 * std::cos(a / 2), r * std::sin(a)};
        const Vec3 out = normalized(Vec3{std::cos(a), 0, std::sin(a)});
        for (const Vec3& off : {out * 0.3, Vec3{0, 0.3, 0}, out * -0.3, Vec3{0, -0.3, 0}})
            twice.positions.push_back(middle + off);
        for (std::uint32_t k = 0; k < 4; ++k) {
            const auto at = [&](int ring, std::uint32_t corner) {
                return static_cast<std::uint32_t>(ring % n) * 4 + corner % 4;
            };
            twice.triangles.push_back({at(i, k), at(i, k + 1), at(i + 1, k)});
            twice.triangles.push_back({at(i + 1, k), at(i, k + 1), at(i + 1, k + 1)});
        }
    }
    EXPECT_EQ(close_mesh(twice, "ring").diagnosis.n_overlapping, 1u);
}

TEST(CloseMesh, RefusesWhatHasNoInside) {
    const TriMesh sheet{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}, {}};
    expect_error(Fault::bad_input, "sheet.obj: no inside", [&] { close_mesh(sheet, "sheet.obj"); });
    expect_error(Fault::bad_input, "try --close plane", [&] { close_mesh(sheet, "sheet.obj"); });
    expect_error(Fault::bad_input, "empty: no inside: it has no face",
                 [] { close_mesh({}, "empty"); });
    const TriMesh broken{{{0, std::nan(""), 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, {}};
    expect_error(Fault::bad_input, "no inside: none of its 1 face has three corners that are there",
                 [&] { close_mesh(broken, "broken"); });
    expect_error(Fault::bad_argument, "'winding' makes no closed mesh",
                 [] { close_mesh(cube(), "cube", {CloseRule::winding}); });
}

} // namespace
} // namespace taihu
