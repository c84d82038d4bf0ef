#include "vdb_ops/foot.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/errors.h"
#include "vdb_ops/clean.h"
#include "vdb_ops/level_set_box.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/solids_field.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

constexpr double kVoxel = 0.02;

openvdb::FloatGrid::Ptr grid_of(const AnalyticSolid& solid) {
    return rasterize(SolidsField({solid}), {kVoxel, {0.003, 0.007, 0.001}, 3});
}

TEST(Foot, ABoxStandsAsItIs) {
    const auto foot = find_foot(*grid_of({BoxSolid{{0.3, 0.6, 0.4}}, {}}), 20);
    ASSERT_TRUE(foot);
    EXPECT_EQ(foot->cut_m, 0);
    // It falls over its shorter side; everything within a voxel.
    EXPECT_NEAR(foot->tilt_deg, std::atan(0.3 / 0.6) * 180 / std::numbers::pi, 1.5);
    EXPECT_NEAR(foot->contact_m2, 0.6 * 0.8, 0.06);
    EXPECT_NEAR(foot->outline_m2, foot->contact_m2, 1e-9);
    EXPECT_NEAR(foot->y_m, -0.6, 1e-6);
    EXPECT_LE(length(foot->center_of_mass), 1.5 * kVoxel);
}

TEST(Foot, ABallIsCutUntilItStands) {
    for (const double tilt : {8.0, 20.0}) {
        const auto ball = grid_of({BallSolid{0.5}, {}});
        const auto foot = find_foot(*ball, tilt);
        ASSERT_TRUE(foot);
        // A plane h above the bottom cuts a circle of radius sqrt(2 r h - h^2); the centre of mass
        // of the rest is close to the middle for small h.
        const auto exact = [&](double h) {
            return std::atan2(std::sqrt(2 * 0.5 * h - h * h), foot->center_of_mass.y - foot->y_m) *
                   180 / std::numbers::pi;
        };
        EXPECT_GE(foot->tilt_deg, tilt);
        // The layer below the plane counts; half a voxel of its circle.
        EXPECT_LE(foot->tilt_deg, exact(foot->cut_m) + 1.2);
        EXPECT_GE(foot->tilt_deg, exact(foot->cut_m - kVoxel / 2) - 1.2);
        const auto cut = cut_below(*ball, foot->y_m);
        EXPECT_GT(foot->cut_m, 0);
        EXPECT_NEAR(level_set_box(*cut).lo.y, foot->y_m, 1e-6);
        // Less a voxel at the foot's edge.
        const auto again = find_foot(*cut, 0.75 * tilt);
        ASSERT_TRUE(again);
        EXPECT_EQ(again->cut_m, 0);
    }
    EXPECT_LT(find_foot(*grid_of({BallSolid{0.5}, {}}), 8)->cut_m,
              find_foot(*grid_of({BallSolid{0.5}, {}}), 20)->cut_m);
}

TEST(Foot, ALeaningColumnIsCutFarther) {
    const auto column = [](double lean_rad) {
        return grid_of({CylinderSolid{0.25, 0.6}, Similarity::rotation({0, 0, 1}, lean_rad)});
    };
    const auto upright = find_foot(*column(0), 8), leaning = find_foot(*column(0.3), 8);
    ASSERT_TRUE(upright && leaning);
    EXPECT_EQ(upright->cut_m, 0);
    EXPECT_GT(leaning->cut_m, 0.05);
    EXPECT_FALSE(find_foot(*column(0), 50));
}

TEST(Foot, CleaningDropsWhatTheCutSetsFree) {
    // Two columns on a bowl: once the bowl is cut away, the thinner one falls.
    const auto part = [](double x, double radius) {
        return AnalyticSolid{CylinderSolid{radius, 0.5}, Similarity::translation({x, 0.5, 0})};
    };
    const SolidsField columns({{BallSolid{0.14}, {}}, part(-0.1, 0.1), part(0.12, 0.05)});
    const auto solid = rasterize(columns, {0.01, {}, 3});
    EXPECT_EQ(clean(*solid).n_pieces, 1u);
    const CleanResult stood = clean(*solid, {.foot_deg = 8});
    ASSERT_TRUE(stood.foot);
    EXPECT_GT(stood.foot->cut_m, 0.05);
    EXPECT_GE(stood.foot->tilt_deg, 8);
    EXPECT_EQ(clean(*stood.solid).n_pieces, 1u);
    EXPECT_NEAR(volume_m3(*solid) - volume_m3(*stood.solid), stood.foot_m3 + stood.removed_m3,
                1e-9);
}

TEST(Foot, RefusesTiltsOutOfRangeAndWhatCannotStand) {
    const auto ball = grid_of({BallSolid{0.5}, {}});
    for (const double tilt : {0.0, -1.0, 61.0, std::nan("")})
        expect_error(Fault::bad_argument, "must be > 0 and <= 60", [&] { find_foot(*ball, tilt); });
    const auto column = grid_of({CylinderSolid{0.1, 0.6}, {}}); // half of it: atan(0.1 / 0.3)
    expect_error(Fault::numeric, "stands tilted by 25 degrees on no cut",
                 [&] { clean(*column, {.foot_deg = 25}); });
}

} // namespace
} // namespace taihu
