#include "vdb_ops/closed_mesh.h"

#include "tests/support/errors.h"
#include "vdb_ops/shapes.h"

namespace taihu {
namespace {

using testing::Contains;
using testing::HasSubstr;

TriMesh cube(const Vec3& at = {}, double size = 1) {
    TriMesh mesh = shape_mesh({.kind = ShapeKind::box, .size_m = {size, size, size}});
    for (Vec3& p : mesh.positions)
        p += at;
    return mesh;
}

void append(TriMesh& mesh, const TriMesh& other) {
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
    for (const Triangle& t : other.triangles)
        mesh.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
}

void flip(TriMesh& mesh) {
    for (Triangle& t : mesh.triangles)
        std::swap(t[0], t[1]);
}

double volume(const ClosedMesh& closed) {
    return signed_volume_m3({closed.positions, closed.triangles, {}});
}

TEST(CloseMesh, LeavesAClosedMeshAsItIs) {
    const ClosedMesh closed = close_mesh(cube(), "cube", CloseRule::none);
    EXPECT_EQ(closed.triangles.size(), 12u);
    EXPECT_NEAR(volume(closed), 1, 1e-14);
    EXPECT_TRUE(closed.diagnosis.lines().empty());
}

TEST(CloseMesh, CapsAnOpenLoopAndNamesIt) {
    TriMesh open = cube();
    open.triangles.resize(10); // the face x = 1/2 is made of the last two
    const ClosedMesh closed = close_mesh(open, "cube");
    ASSERT_EQ(closed.diagnosis.loops.size(), 1u);
    EXPECT_EQ(closed.diagnosis.n_open_edges, 4u);
    EXPECT_EQ(closed.diagnosis.loops[0].n_edges, 4u);
    EXPECT_NEAR(closed.diagnosis.loops[0].center.x, 0.5, 1e-14);
    EXPECT_NEAR(closed.diagnosis.loops[0].perimeter_m, 4, 1e-14);
    EXPECT_NEAR(volume(closed), 1, 1e-14); // the hole is flat, so its fan is the face again
    EXPECT_THAT(closed.diagnosis.lines(), Contains(HasSubstr("open: 4 edges in 1 loops")));
}

TEST(CloseMesh, RefusesAnOpenMeshUnderNone) {
    TriMesh open = cube();
    open.triangles.resize(10);
    expect_error(Fault::bad_input, "cube: open: 4 open edges in 1 loops",
                 [&] { close_mesh(open, "cube", CloseRule::none); });
    expect_error(Fault::bad_input, "--close loops",
                 [&] { close_mesh(open, "cube", CloseRule::none); });
}

TEST(CloseMesh, WeldsCornersThatAreGivenTwice) {
    TriMesh soup;
    for (const Triangle& t : cube().triangles)
        for (const std::uint32_t v : t) {
            soup.positions.push_back(cube().positions[v]);
            if (soup.positions.size() % 3 == 0) {
                const auto n = static_cast<std::uint32_t>(soup.positions.size());
                soup.triangles.push_back({n - 3, n - 2, n - 1});
            }
        }
    const ClosedMesh closed = close_mesh(soup, "soup", CloseRule::none);
    EXPECT_EQ(closed.positions.size(), 8u);
    EXPECT_NEAR(volume(closed), 1, 1e-14);
}

TEST(CloseMesh, TurnsFlippedFacesBack) {
    TriMesh mesh = cube();
    std::swap(mesh.triangles[3][0], mesh.triangles[3][1]);
    const ClosedMesh closed = close_mesh(mesh, "cube");
    EXPECT_NEAR(volume(closed), 1, 1e-14);
    EXPECT_EQ(closed.diagnosis.n_flipped_edges, 3u);
}

TEST(CloseMesh, MergesDuplicatesAndTwoSidedFaces) {
    TriMesh twice = cube();
    append(twice, cube());
    EXPECT_EQ(close_mesh(twice, "twice").diagnosis.n_duplicate, 12u);
    TriMesh back = cube();
    flip(back);
    TriMesh both = cube();
    append(both, back);
    const ClosedMesh closed = close_mesh(both, "both");
    EXPECT_TRUE(closed.diagnosis.two_sided);
    EXPECT_NEAR(std::fabs(volume(closed)), 1, 1e-14);
}

TEST(CloseMesh, DropsNonFiniteAndRepeatedCornersByCount) {
    TriMesh mesh = cube();
    mesh.positions.push_back({0, std::nan(""), 0});
    mesh.triangles.push_back({0, 1, 8});
    mesh.triangles.push_back({2, 2, 3});
    mesh.triangles.push_back({0, 1, 99});
    const ClosedMesh closed = close_mesh(mesh, "cube");
    EXPECT_EQ(closed.diagnosis.n_bad, 2u);
    EXPECT_EQ(closed.diagnosis.n_repeated, 1u);
    EXPECT_NEAR(volume(closed), 1, 1e-14);
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
