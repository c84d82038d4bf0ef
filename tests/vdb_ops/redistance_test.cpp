#include "vdb_ops/redistance.h"

#include <tbb/global_control.h>

#include "tests/support/errors.h"
#include "tests/support/fields.h"
#include "tests/support/grids.h"
#include "vdb_ops/combine_field.h"
#include "vdb_ops/offset_field.h"
#include "vdb_ops/solids_field.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

using openvdb::Coord;

openvdb::FloatGrid::Ptr solid_grid(const AnalyticSolid& solid, double voxel_m) {
    return rasterize(SolidsField({solid}), {voxel_m, {0.003, 0.001, 0.002}, 3});
}

/// The largest error of the band's values in voxels, within `within` voxels of the surface.
double worst(const openvdb::FloatGrid& grid, double within,
             const std::function<double(const Vec3&)>& exact) {
    const double voxel = grid.voxelSize().x();
    double most = 0;
    for (auto it = grid.cbeginValueOn(); it; ++it) {
        const openvdb::Vec3d p = grid.indexToWorld(it.getCoord());
        const double d = exact({p.x(), p.y(), p.z()}) / voxel;
        if (std::fabs(d) <= within)
            most = std::max(most, std::fabs(double(*it) / voxel - d));
    }
    return most;
}

double steepest_in_band(const openvdb::FloatGrid& grid) {
    const auto accessor = grid.getConstAccessor();
    double most = 0;
    for (auto it = grid.cbeginValueOn(); it; ++it)
        for (int axis = 0; axis < 3; ++axis)
            for (const int step : {-1, 1}) {
                Coord next = it.getCoord();
                next[axis] += step;
                most = std::max(most, std::fabs(double(accessor.getValue(next)) - double(*it)));
            }
    return most / grid.voxelSize().x();
}

TEST(Redistance, LeavesTrueDistancesAsTheyAre) {
    const AnalyticSolid ball{BallSolid{1}, {}};
    const auto exact = [&](const Vec3& p) { return distance_m(ball, p); };
    const auto grid = solid_grid(ball, 1.0 / 24);
    const auto again = redistance(*grid);
    // Value over gradient is second order, 1 / 6r^2; upwind differences are first order in 1 / 2r.
    EXPECT_LE(worst(*again, 0.7, exact), 1e-3);
    EXPECT_LE(worst(*again, 3, exact), 0.1);
    EXPECT_LE(steepest_in_band(*again), 1 + 1e-3);
    EXPECT_NEAR(volume_m3(*again), volume_m3(*grid), 2e-4 * volume_m3(*grid));
}

TEST(Redistance, MakesDistancesTrueBeyondTheEdgesOfIntersections) {
    // The intersection of two half spaces and a ball, as it comes, is sharp beyond its edge.
    const auto slab = [](double angle) {
        return std::make_shared<SolidsField>(
            std::vector<AnalyticSolid>{{HalfSpaceSolid{}, Similarity::rotation({1, 0, 0}, angle)}});
    };
    const auto ball = std::make_shared<SolidsField>(std::vector<AnalyticSolid>{{BallSolid{1}, {}}});
    const CombineField wedge(Combine::intersect, {slab(0.8), slab(-0.8), ball});
    const double voxel = 1.0 / 32;
    const auto grid = rasterize(wedge, {voxel, {0, 0.001, 0}, 3});
    const auto again = redistance(*grid, 5);
    // Above the middle of the edge the nearest point is on the edge: y = 0.
    double before = 0, after = 0;
    for (int k = 1; k <= 4; ++k) {
        const double d = (k * voxel + 0.001) / voxel;
        before = std::max(before, d - double(grid->tree().getValue({0, k, 0})) / voxel);
        after = std::max(after, std::fabs(d - double(again->tree().getValue({0, k, 0})) / voxel));
    }
    EXPECT_GT(before, 0.6);                    // cos 0.8 = 0.7 of the distance, up to the band's 3
    EXPECT_LE(after, 0.25);                    // an edge is rounded by the grid to about that
    EXPECT_LE(steepest_in_band(*again), 1.06); // two estimates meet: 0.06
}

TEST(Redistance, MakesBlendsTrue) {
    // Where two planes blend, the field is flatter than a distance.
    const auto ball = [](double x) {
        return std::make_shared<SolidsField>(
            std::vector<AnalyticSolid>{{BallSolid{0.5}, Similarity::translation({x, 0, 0})}});
    };
    const auto grid =
        rasterize(CombineField(Combine::unite, {ball(-0.45), ball(0.45)}, 0.4), {0.025, {}, 3});
    const auto again = redistance(*grid);
    const auto slope = [](const openvdb::FloatGrid& g) { // along y in the middle plane
        double least = 9;
        for (int y = 8; y < 30; ++y) {
            const float a = g.tree().getValue({0, y, 0}), b = g.tree().getValue({0, y + 1, 0});
            if (std::fabs(a) < 0.06f && std::fabs(b) < 0.06f)
                least = std::min(least, double(b - a) / 0.025);
        }
        return least;
    };
    EXPECT_LT(slope(*grid), 0.85);
    EXPECT_GT(slope(*again), 0.95);
    // The surface stays: a voxel^2 / 8r of the neck's curvature.
    EXPECT_NEAR(volume_m3(*again), volume_m3(*grid), 1e-3 * volume_m3(*grid));
}

TEST(WidenBand, KeepsTheBandAndReachesOn) {
    const AnalyticSolid box{BoxSolid{{0.6, 0.5, 0.4}}, {}};
    const auto exact = [&](const Vec3& p) { return distance_m(box, p); };
    const auto grid = solid_grid(box, 0.03);
    for (const float width : {3.f, 5.f, 12.f}) {
        const auto wide = widen_band(*grid, width);
        EXPECT_NEAR(wide->background(), width * 0.03f, 1e-6);
        EXPECT_GE(wide->activeVoxelCount(), grid->activeVoxelCount());
        for (auto it = grid->cbeginValueOn(); it; ++it)
            ASSERT_EQ(wide->tree().getValue(it.getCoord()), *it);
        // First order beyond the corners, where the solution is a cone.
        EXPECT_LE(worst(*wide, width, exact), 0.12 * width);
        EXPECT_LE(steepest_in_band(*wide), 1 + 2e-5);
    }
    // Far inside and outside, beyond all leaves.
    const auto wide = widen_band(*grid, 5);
    EXPECT_LT(wide->tree().getValue(Coord(0)), 0);
    EXPECT_GT(wide->tree().getValue(Coord(200)), 0);
}

TEST(WidenBand, IsExactBesidePlanes) {
    const AnalyticSolid box{BoxSolid{{2, 2, 2}}, {}};
    const auto wide = widen_band(*solid_grid(box, 0.1), 10);
    for (int k = -9; k <= 9; ++k)
        EXPECT_NEAR(wide->tree().getValue({0, 20 + k, 0}), k * 0.1 + 0.001, 1e-5);
}

TEST(Redistance, IsTheSameOnAnyNumberOfThreads) {
    const auto grid =
        solid_grid({BoxSolid{{0.6, 0.5, 0.4}}, Similarity::rotation({1, 2, 3}, 0.7)}, 0.02);
    const std::string narrow = grid_hash(*redistance(*grid)),
                      wide = grid_hash(*widen_band(*grid, 9));
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(grid_hash(*redistance(*grid)), narrow);
    EXPECT_EQ(grid_hash(*widen_band(*grid, 9)), wide);
}

TEST(Redistance, TakesEmptyGridsAndSingleVoxels) {
    const auto none = rasterize(SolidsField({}), {0.1, {}, 3});
    EXPECT_EQ(redistance(*none)->activeVoxelCount(), 0u);
    EXPECT_EQ(widen_band(*none, 6)->activeVoxelCount(), 0u);
    auto dot = openvdb::FloatGrid::create(0.3f);
    dot->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
    dot->setGridClass(openvdb::GRID_LEVEL_SET);
    dot->tree().setValueOn(Coord(7), -0.05f); // at the corner of a leaf, without any band
    const auto again = redistance(*dot);
    EXPECT_LT(again->tree().getValue(Coord(7)), 0);
    EXPECT_GT(again->tree().getValue(Coord(8)), 0);
}

struct Stop final : Progress {
    void stage(std::string_view) override {}
    void fraction(double) override {}
    bool cancelled() const override { return true; }
};

TEST(Redistance, RefusesWidthsOutOfRangeAndStops) {
    const auto grid = ball_rock();
    expect_error(Fault::bad_argument, "half_width_vox is 1, must be 2..1000",
                 [&] { redistance(*grid, 1); });
    expect_error(Fault::bad_argument, "must be 3..1000", [&] { widen_band(*grid, 2); });
    expect_error(Fault::bad_argument, "must be 3..1000", [&] { widen_band(*grid, 2000); });
    auto fog = openvdb::FloatGrid::create(0);
    expect_error(Fault::bad_argument, "not a level set", [&] { redistance(*fog); });
    auto far = openvdb::FloatGrid::create(0.3f);
    far->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
    far->setGridClass(openvdb::GRID_LEVEL_SET);
    far->tree().setValueOn(Coord(0, 2147483647, 0), -0.05f);
    expect_error(Fault::bad_argument, "beyond voxel 2^30", [&] { redistance(*far); });
    Stop stop;
    EXPECT_THROW(redistance(*grid, 3, &stop), Error);
}

} // namespace
} // namespace taihu
