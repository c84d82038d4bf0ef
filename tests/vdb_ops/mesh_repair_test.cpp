#include "vdb_ops/mesh_repair.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/cube_mesh.h"

namespace taihu {
namespace {

RepairedMesh repair(const TriMesh& mesh) {
    return repair_mesh(mesh, 0, CloseRule::loops);
}

double volume(const RepairedMesh& repaired) {
    return signed_volume_m3({repaired.positions, repaired.triangles, {}});
}

TEST(RepairMesh, CapsAnOpenLoop) {
    TriMesh open = cube();
    open.triangles.resize(10); // the face x = 1/2 is made of the last two
    const RepairedMesh closed = repair(open);
    ASSERT_EQ(closed.diagnosis.loops.size(), 1u);
    EXPECT_EQ(closed.diagnosis.n_open_edges, 4u);
    EXPECT_EQ(closed.diagnosis.loops[0].n_edges, 4u);
    EXPECT_NEAR(closed.diagnosis.loops[0].center.x, 0.5, 1e-14);
    EXPECT_NEAR(closed.diagnosis.loops[0].perimeter_m, 4, 1e-14);
    EXPECT_NEAR(volume(closed), 1, 1e-14); // the hole is flat, so its fan is the face again
}

TEST(RepairMesh, WeldsCornersThatAreGivenTwice) {
    TriMesh soup;
    for (const Triangle& t : cube().triangles)
        for (const std::uint32_t v : t) {
            soup.positions.push_back(cube().positions[v]);
            if (soup.positions.size() % 3 == 0) {
                const auto n = static_cast<std::uint32_t>(soup.positions.size());
                soup.triangles.push_back({n - 3, n - 2, n - 1});
            }
        }
    const RepairedMesh closed = repair_mesh(soup, 0, CloseRule::none);
    EXPECT_EQ(closed.positions.size(), 8u);
    EXPECT_NEAR(volume(closed), 1, 1e-14);
}

TEST(RepairMesh, TurnsFlippedFacesBack) {
    TriMesh mesh = cube();
    std::swap(mesh.triangles[3][0], mesh.triangles[3][1]);
    const RepairedMesh closed = repair(mesh);
    EXPECT_NEAR(volume(closed), 1, 1e-14);
    EXPECT_EQ(closed.diagnosis.n_flipped_edges, 3u);
}

TEST(RepairMesh, MergesDuplicatesAndTwoSidedFaces) {
    TriMesh twice = cube();
    append(twice, cube());
    EXPECT_EQ(repair(twice).diagnosis.n_duplicate, 12u);
    TriMesh back = cube();
    flip(back);
    TriMesh both = cube();
    append(both, back);
    const RepairedMesh closed = repair(both);
    EXPECT_TRUE(closed.diagnosis.two_sided);
    EXPECT_NEAR(std::fabs(volume(closed)), 1, 1e-14);
}

TEST(RepairMesh, DropsNonFiniteAndRepeatedCornersByCount) {
    TriMesh mesh = cube();
    mesh.positions.push_back({0, std::nan(""), 0});
    mesh.triangles.push_back({0, 1, 8});
    mesh.triangles.push_back({2, 2, 3});
    mesh.triangles.push_back({0, 1, 99});
    const RepairedMesh closed = repair(mesh);
    EXPECT_EQ(closed.diagnosis.n_bad, 2u);
    EXPECT_EQ(closed.diagnosis.n_repeated, 1u);
    EXPECT_NEAR(volume(closed), 1, 1e-14);
}

TEST(RepairMesh, LeavesOpenEdgesUnderNone) {
    TriMesh open = cube();
    open.triangles.resize(10);
    const RepairedMesh repaired = repair_mesh(open, 0, CloseRule::none);
    EXPECT_EQ(repaired.triangles.size(), 10u);
    EXPECT_EQ(repaired.diagnosis.n_open_edges, 4u);
    EXPECT_TRUE(repaired.diagnosis.loops.empty());
}

TEST(RepairMesh, NumbersShellsByTheirFirstFace) {
    TriMesh two = cube();
    append(two, cube({3, 0, 0}));
    const RepairedMesh repaired = repair(two);
    EXPECT_EQ(repaired.cap_area_m2, std::vector<double>(2, 0));
    EXPECT_EQ(repaired.shell_of.front(), 0u);
    EXPECT_EQ(repaired.shell_of.back(), 1u);
}

TEST(RepairMesh, WeldsWithinATolerance) {
    TriMesh soup = cube();
    soup.positions.push_back(soup.positions[soup.triangles[0][0]] + Vec3{1e-6, 0, 0});
    soup.triangles[0][0] = 8;
    EXPECT_EQ(repair_mesh(soup, 0, CloseRule::none).positions.size(), 9u);
    EXPECT_EQ(repair_mesh(soup, 1e-5, CloseRule::none).positions.size(), 8u);
}

} // namespace
} // namespace taihu
