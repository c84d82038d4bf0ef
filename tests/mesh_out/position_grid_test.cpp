#include "mesh_out/position_grid.h"

#include <gmock/gmock.h>

#include "mesh_out/certificate.h"
#include "mesh_out/extract.h"
#include "stats/core/error.h"
#include "stats/core/rng.h"
#include "tests/support/level_sets.h"

namespace taihu {
namespace {

using testing::HasSubstr;

const Box kBox{{-1.3, 0.2, 5}, {2.1, 0.9, 5.5}};

TEST(PositionGrid, HasTheLargestPowerOfTwoThatMovesNoPointTooFar) {
    for (const double max_move_m : {1e-4, 0.003, 0.01, 0.0137}) {
        const PositionGrid grid = position_grid(kBox, max_move_m);
        EXPECT_EQ(grid.step_m, std::exp2(std::round(std::log2(grid.step_m))));
        EXPECT_LE(grid.step_m * std::sqrt(3.0) / 2, max_move_m);
        EXPECT_GT(2 * grid.step_m * std::sqrt(3.0) / 2, max_move_m);
    }
}

TEST(PositionGrid, HoldsTheBoxAndAStepAroundIt) {
    const PositionGrid grid = position_grid(kBox, 0.01);
    const double last = std::exp2(grid.bits) - 1;
    for (int k = 0; k < 3; ++k) {
        EXPECT_LE(grid.origin[k], kBox.lo[k] - grid.step_m);
        EXPECT_GE(grid.origin[k] + last * grid.step_m, kBox.hi[k] + grid.step_m);
    }
    EXPECT_GT(4.0, std::exp2(grid.bits) * grid.step_m / kBox.longest()); // and not much more
}

TEST(PositionGrid, OriginsAreMultiplesOfTheCoarsestStep) {
    const PositionGrid coarse = position_grid(kBox, 0.08);
    const PositionGrid fine = position_grid(kBox, 0.01, coarse.step_m);
    EXPECT_EQ(coarse.step_m, 8 * fine.step_m);
    for (int k = 0; k < 3; ++k)
        EXPECT_EQ(std::fmod(fine.origin[k], coarse.step_m), 0);
}

TEST(PositionGrid, PointsAreExactInFloat) {
    for (const Vec3& where : {Vec3{}, Vec3{300, -5000, 77}}) {
        const Box box{kBox.lo + where, kBox.hi + where};
        const PositionGrid grid = position_grid(box, 0.001);
        for (int q = 0; q < 1 << grid.bits; q += 7)
            for (int k = 0; k < 3; ++k) {
                const double p = grid.origin[k] + q * grid.step_m;
                if (p > box.hi[k] + grid.step_m)
                    break;
                ASSERT_EQ(static_cast<double>(static_cast<float>(p)), p);
            }
    }
}

void expect_refused(Fault fault, const char* text, const Box& box, double move_m,
                    double origin_step_m = 0) {
    try {
        position_grid(box, move_m, origin_step_m);
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), fault);
        EXPECT_THAT(e.what(), HasSubstr(text));
    }
}

TEST(PositionGrid, NamesTheFinestStepThatFits) {
    // 3.4 m in 2^18 steps: 2^-16 = 1.52588e-05 m would do without the margin, and does with it.
    expect_refused(Fault::numeric, "the finest step that fits is 1.52588e-05 m", kBox, 1e-6);
    // A megametre away float resolves 1/16 m.
    const Vec3 away{1e6, 0, 0};
    expect_refused(Fault::numeric, "the finest step that fits is 0.0625 m",
                   {kBox.lo + away, kBox.hi + away}, 0.01);
}

TEST(PositionGrid, NamesTheArgumentOutOfRange) {
    expect_refused(Fault::bad_argument, "max_move_m is 0", kBox, 0);
    expect_refused(Fault::bad_argument, "origin_step_m is 0.3", kBox, 0.01, 0.3);
    expect_refused(Fault::bad_argument, "origin_step_m is 0.0078125", kBox, 0.1, 0.0078125);
    expect_refused(Fault::bad_argument, "the box is empty", {}, 0.1);
}

/// A ball whose vertices were shaken by up to `shake_m`.
TriMesh shaken_ball(double voxel_m, double shake_m, std::uint64_t seed) {
    TriMesh ball = extract_uniform(*ball_grid(1, voxel_m));
    const Rng rng{.seed = seed, .stream = 1};
    for (std::size_t i = 0; i < ball.positions.size(); ++i)
        ball.positions[i] +=
            (Vec3{rng.uniform(i, 0), rng.uniform(i, 1), rng.uniform(i, 2)} - Vec3{0.5, 0.5, 0.5}) *
            (2 * shake_m);
    return ball;
}

TEST(SnapToGrid, LeavesAClosedManifoldOnGridsThatAreFarTooCoarse) {
    for (std::uint64_t seed = 0; seed < 4; ++seed)
        for (const double step_vox : {0.25, 0.5, 1.0, 1.5}) {
            const double voxel_m = 0.0625;
            const TriMesh ball = shaken_ball(voxel_m, 0.3 * voxel_m, seed);
            const PositionGrid grid =
                position_grid(bounds(ball), step_vox * voxel_m * std::sqrt(3.0) / 2);
            const SnapResult snapped = snap_to_grid(ball, grid);
            const Certificate c = certify(snapped.mesh, {.self_intersections = false});
            EXPECT_TRUE(c.holds()) << testing::PrintToString(faults(c)) << " at step " << step_vox;
            EXPECT_EQ(c.n_merged_positions, 0u);
            EXPECT_EQ(c.genus, 0);
            EXPECT_EQ(snapped.mesh.triangles.size() + 2 * snapped.n_collapsed,
                      ball.triangles.size());
            for (const Vec3& p : snapped.mesh.positions)
                for (int k = 0; k < 3; ++k) {
                    const double q = (p[k] - grid.origin[k]) / grid.step_m;
                    ASSERT_EQ(q, std::floor(q));
                    ASSERT_GE(q, 0);
                    ASSERT_LT(q, std::exp2(grid.bits));
                }
            // Rounding, and for those that had to give way a few steps more.
            EXPECT_LE(snapped.max_move_m, 4 * grid.step_m);
        }
}

TEST(SnapToGrid, OnlyRoundsWhereTheGridIsFine) {
    const TriMesh ball = shaken_ball(0.125, 0.01, 9);
    const PositionGrid grid = position_grid(bounds(ball), 1e-4);
    const SnapResult snapped = snap_to_grid(ball, grid);
    EXPECT_EQ(snapped.n_collapsed + snapped.n_moved, 0u);
    EXPECT_LE(snapped.max_move_m, 1e-4);
    ASSERT_EQ(snapped.mesh.triangles, ball.triangles);
    for (std::size_t i = 0; i < ball.positions.size(); ++i)
        EXPECT_LE(length(snapped.mesh.positions[i] - ball.positions[i]), 1e-4);
}

TEST(SnapToGrid, ChangesNothingTheSecondTime) {
    const TriMesh ball = shaken_ball(0.125, 0.03, 2);
    const PositionGrid grid = position_grid(bounds(ball), 0.05);
    const TriMesh once = snap_to_grid(ball, grid).mesh;
    const SnapResult twice = snap_to_grid(once, grid);
    EXPECT_EQ(twice.mesh.positions, once.positions);
    EXPECT_EQ(twice.mesh.triangles, once.triangles);
    EXPECT_EQ(twice.max_move_m, 0);
}

TEST(SnapToGrid, CutsAFlatFaceIntoItsNeighbourInsteadOfMovingIt) {
    // A pyramid over a square whose base has a thin face that rounds to a line: (0,0), (2,0.1),
    // (4,0).
    const TriMesh thin = {
        {{0, 0, 0}, {2, 0.1, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {2, 2, 4}},
        {{0, 1, 2}, {1, 3, 2}, {0, 4, 1}, {1, 4, 3}, {0, 2, 5}, {2, 3, 5}, {3, 4, 5}, {4, 0, 5}},
        {}};
    ASSERT_TRUE(certify(thin).holds());
    const PositionGrid grid = position_grid(bounds(thin), 0.87); // steps of 1
    ASSERT_EQ(grid.step_m, 1);
    const SnapResult snapped = snap_to_grid(thin, grid);
    EXPECT_EQ(snapped.n_collapsed + snapped.n_moved, 0u);
    EXPECT_EQ(snapped.mesh.triangles.size(), thin.triangles.size());
    const Certificate c = certify(snapped.mesh);
    EXPECT_TRUE(c.holds()) << testing::PrintToString(faults(c));
    EXPECT_DOUBLE_EQ(c.volume_m3, 4 * 4 * 4 / 3.0);
}

TEST(SnapToGrid, KeepsNormalsWithTheirVertices) {
    TriMesh ball = shaken_ball(0.125, 0.03, 2);
    for (std::size_t i = 0; i < ball.positions.size(); ++i)
        ball.normals.push_back(normalized(ball.positions[i]));
    const SnapResult snapped = snap_to_grid(ball, position_grid(bounds(ball), 0.15));
    ASSERT_GT(snapped.n_collapsed, 0u);
    ASSERT_EQ(snapped.mesh.normals.size(), snapped.mesh.positions.size());
    for (std::size_t i = 0; i < snapped.mesh.normals.size(); ++i)
        EXPECT_GT(dot(snapped.mesh.normals[i], normalized(snapped.mesh.positions[i])), 0.8);
}

TEST(SnapToGrid, RefusesAGridThatCannotHoldTheSurface) {
    const TriMesh ball = shaken_ball(0.125, 0.01, 1);
    try {
        snap_to_grid(ball, position_grid(bounds(ball), 10)); // 8 m steps for 2 m of rock
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::numeric);
        EXPECT_THAT(e.what(), HasSubstr("use a finer grid"));
    }
    try {
        snap_to_grid(ball, position_grid({{0, 0, 0}, {1, 1, 1}}, 0.01));
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::bad_argument);
        EXPECT_THAT(e.what(), HasSubstr("outside of the grid"));
    }
}

} // namespace
} // namespace taihu
