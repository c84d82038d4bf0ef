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

TEST(RepairMesh, CapsALoopThatBendsInwardByEarsNotByAFan) {
    // A prism over an L, open at the top: a fan from the middle would reach over the notch.
    const std::vector<Vec3> outline = {{0, 0, 0},  {4, 0, 0},  {4, 0, -1},
                                       {1, 0, -1}, {1, 0, -4}, {0, 0, -4}};
    TriMesh mesh;
    for (const double y : {0.0, 1.0})
        for (const Vec3& p : outline)
            mesh.positions.push_back({p.x, y, p.z});
    for (std::uint32_t k = 0; k < 6; ++k) {
        const std::uint32_t next = (k + 1) % 6;
        mesh.triangles.push_back({k, next, next + 6});
        mesh.triangles.push_back({k, next + 6, k + 6});
    }
    const RepairedMesh closed = repair(mesh);
    EXPECT_EQ(closed.diagnosis.loops.size(), 2u);
    EXPECT_NEAR(closed.cap_area_m2[0], 2 * 7, 1e-12); // an L of 4 + 3, nothing twice
    EXPECT_NEAR(volume(closed), 7, 1e-12);
}

TEST(RepairMesh, TakesAsLongAsTheLoopIsLong) {
    // A strip of 2 * 10^5 faces has one loop of as many edges.
    TriMesh strip;
    constexpr std::uint32_t n = 100'000;
    for (std::uint32_t i = 0; i <= n; ++i)
        for (const double y : {0.0, 1.0})
            strip.positions.push_back({double(i), y, 0});
    for (std::uint32_t i = 0; i < n; ++i) {
        strip.triangles.push_back({2 * i, 2 * i + 2, 2 * i + 1});
        strip.triangles.push_back({2 * i + 1, 2 * i + 2, 2 * i + 3});
    }
    ASSERT_EQ(repair(strip).diagnosis.loops.size(), 1u); // CTest's time limit is the test
    EXPECT_EQ(repair(strip).diagnosis.loops[0].n_edges, 2 * n + 2);
}

TEST(RepairMesh, TakesAsLongAsFacesAreManyRoundOneEdge) {
    TriMesh book;
    book.positions = {{0, 0, 0}, {0, 1, 0}};
    for (std::uint32_t i = 0; i < 100'000; ++i) {
        book.positions.push_back({std::cos(0.001 * i), 0, std::sin(0.001 * i)});
        book.triangles.push_back({0, 1, i + 2});
    }
    EXPECT_EQ(repair_mesh(book, 0, CloseRule::none).diagnosis.n_nonmanifold_edges, 1u);
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
    EXPECT_EQ(repair_mesh(soup, 0, CloseRule::none).diagnosis.n_open_edges, 4u);
    EXPECT_EQ(repair_mesh(soup, 1e-5, CloseRule::none).diagnosis.n_open_edges, 0u);
    EXPECT_EQ(repair_mesh(soup, std::nullopt, CloseRule::none).diagnosis.weld_share, 1e-6);
}

TEST(RepairMesh, WeldsOnlyCornersOnOpenEdges) {
    TriMesh mesh = cube(); // one crack, and a closed grain far smaller than the tolerance
    mesh.positions.push_back(mesh.positions[mesh.triangles[0][0]] + Vec3{1e-6, 0, 0});
    mesh.triangles[0][0] = 8;
    append(mesh, cube({2, 0, 0}, 1e-6));
    const RepairedMesh repaired = repair_mesh(mesh, 1e-4, CloseRule::none);
    EXPECT_EQ(repaired.triangles.size(), 24u);
    EXPECT_EQ(repaired.diagnosis.n_repeated, 0u);
}

} // namespace
} // namespace taihu
