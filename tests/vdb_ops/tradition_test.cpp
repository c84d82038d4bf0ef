#include "vdb_ops/tradition.h"

#include <cmath>
#include <numbers>

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "tests/support/errors.h"
#include "tests/support/grids.h"
#include "vdb_ops/analytic_field.h"

namespace taihu {
namespace {

constexpr double kPi = std::numbers::pi;

/// A cube of this side with a round hole of a fifth of it in radius, along x or from top to bottom.
openvdb::FloatGrid::Ptr drilled_cube(double side, double voxel_m, bool upright) {
    const Vec3 half = Vec3{0.5, 0.5, 0.5} * side;
    const AnalyticField field({-half, half}, [=](const Vec3& p) {
        const double across = upright ? std::hypot(p.x, p.z) : std::hypot(p.y, p.z);
        return std::max(box_distance(p, half), 0.2 * side - across);
    });
    return rasterize(field, {voxel_m, Vec3{0.31, 0.17, -0.23} * voxel_m, 3});
}

TEST(Tradition, OfABallAllIsKnown) {
    const double r = 0.7;
    const Tradition t = measure_tradition(*ball_rock(r, 0.025), 4.0 / 3 * kPi * r * r * r);
    const TraditionMeasures& m = t.fine;
    EXPECT_EQ(t.coarser, 1);
    EXPECT_FLOAT_EQ(static_cast<float>(t.voxel_m), 0.025f);
    // Volumes on 28 voxels of radius: better than 0.1 %.
    EXPECT_NEAR(m.body_in_hull, 1, 2e-3);
    EXPECT_NEAR(m.body_in_box, kPi / 6, 2e-3);
    EXPECT_NEAR(m.size_m, 2 * r, 2e-3);
    EXPECT_NEAR(m.height_m, 2 * r, 2e-3);
    EXPECT_NEAR(m.slenderness, std::sqrt(6 / kPi), 5e-3);
    // Sections from 20 to 80 % of the height: 1 - y^2, whose median is at half of 0.6. Steps of a
    // voxel there: 0.025 / 0.7 of 2 * 0.6.
    EXPECT_NEAR(m.waist, (1 - 0.36) / (1 - 0.09), 0.05);
    EXPECT_NEAR(m.wall, 1, 0.025 / (2 * r)); // low by up to a voxel
    EXPECT_EQ(m.see_through, 0);
    EXPECT_EQ(m.windows_per_view, 0);
    EXPECT_EQ(m.widest_window_m, 0);
    for (std::size_t k = 0; k < kBallShares.size(); ++k) {
        EXPECT_EQ(m.ways[k], 0);
        EXPECT_EQ(m.open_porosity[k], 0);
    }
    EXPECT_EQ(m.channel_m, 0);
    EXPECT_EQ(m.sealed_voids, 0);
    EXPECT_NEAR(m.area_ratio, 1, 0.01);
    EXPECT_NEAR(m.roughness, 2 * 0.02 * 0.02, 5e-4); // sd^2 / r of the smoothing, by the diameter
    EXPECT_NEAR(m.curvature, 2, 0.03);
    EXPECT_EQ(m.concave_share, 0);
    EXPECT_TRUE(agree(m.volume_m3, t.coarse.volume_m3));
    EXPECT_TRUE(agree(m.curvature, t.coarse.curvature));
}

TEST(Tradition, AHoleAcrossIsSeenThroughAndLeadsNowhereDown) {
    const Tradition t = measure_tradition(*drilled_cube(1, 1 / 48., false), 1);
    const TraditionMeasures& m = t.fine;
    EXPECT_NEAR(m.body_in_hull, 1 - kPi * 0.04, 2e-3);
    EXPECT_NEAR(m.body_in_box, 1 - kPi * 0.04, 3e-3);
    EXPECT_EQ(m.views_with_window, 7 / 32.); // tan(k 5.6 degrees) below 0.4
    EXPECT_NEAR(m.widest_window_m, 0.4, 0.01);
    EXPECT_EQ(m.channel_m, 0);
    // The ball of the outline looks into both mouths.
    const double ball = 0.5 * kOutlineBallShare * m.size_m,
                 deep = ball - std::sqrt(ball * ball - 0.04),
                 mouths = 2 * kPi / 3 * deep * deep * (3 * ball - deep);
    for (std::size_t k = 0; k < kBallShares.size(); ++k) {
        EXPECT_EQ(m.ways[k], 1);
        EXPECT_NEAR(m.open_porosity[k], (kPi * 0.04 - mouths) / (1 - mouths), 0.006)
            << "a third of a voxel of the radius";
    }
    EXPECT_TRUE(agree(m.see_through, t.coarse.see_through));
    EXPECT_TRUE(agree(m.ways[3], t.coarse.ways[3]));
}

TEST(Tradition, AHoleDownIsAChannelAndNotSeenThrough) {
    const TraditionMeasures m = measure_tradition(*drilled_cube(1, 1 / 48., true), 1).fine;
    EXPECT_NEAR(m.channel_m, 0.4, 1 / 48.);
    EXPECT_EQ(m.see_through, 0);
    EXPECT_NEAR(m.waist, 1, 1e-3); // a prism
    EXPECT_NEAR(m.slenderness, 1 / std::sqrt(1 - kPi * 0.04), 3e-3);
}

TEST(Tradition, TwiceTheSizeHasTwiceTheLengths) {
    const TraditionMeasures one = measure_tradition(*drilled_cube(1, 1 / 32., false), 1).fine,
                            two = measure_tradition(*drilled_cube(2, 1 / 16., false), 8).fine;
    // The same voxels: rounding to float alone.
    EXPECT_NEAR(two.volume_m3, 8 * one.volume_m3, 1e-5);
    EXPECT_NEAR(two.size_m, 2 * one.size_m, 1e-5);
    EXPECT_NEAR(two.height_m, 2 * one.height_m, 1e-5);
    EXPECT_NEAR(two.widest_window_m, 2 * one.widest_window_m, 1e-3);
    EXPECT_NEAR(two.wall, one.wall, 1e-4);
    EXPECT_NEAR(two.see_through, one.see_through, 1e-3);
    EXPECT_NEAR(two.area_ratio, one.area_ratio, 1e-4);
    EXPECT_NEAR(two.roughness, one.roughness, 1e-5);
    EXPECT_NEAR(two.curvature, one.curvature, 1e-3);
    EXPECT_EQ(two.ways, one.ways);
}

TEST(Tradition, IsTheSameOnOneThread) {
    const auto rock = drilled_cube(1, 1 / 24., false);
    const Tradition many = measure_tradition(*rock, 1);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const Tradition single = measure_tradition(*rock, 1);
    for (const auto value :
         {&TraditionMeasures::volume_m3, &TraditionMeasures::wall, &TraditionMeasures::see_through,
          &TraditionMeasures::widest_window_m, &TraditionMeasures::area_ratio,
          &TraditionMeasures::roughness, &TraditionMeasures::curvature})
        EXPECT_EQ(many.fine.*value, single.fine.*value);
    EXPECT_EQ(many.coarse.open_porosity, single.coarse.open_porosity);
}

struct CancelledAtOnce final : Progress {
    void stage(std::string_view) override {}
    void fraction(double) override {}
    bool cancelled() const override { return true; }
};

TEST(Tradition, RefusesByName) {
    const auto ball = ball_rock();
    expect_error(Fault::bad_argument, "hull_m3 is 0", [&] { measure_tradition(*ball, 0); });
    expect_error(Fault::bad_argument, "level set", [&] {
        const auto fog = openvdb::FloatGrid::create(0);
        fog->setGridClass(openvdb::GRID_FOG_VOLUME);
        measure_tradition(*fog, 1);
    });
    expect_error(Fault::bad_input, "is empty", [&] {
        const auto empty = openvdb::createLevelSet<openvdb::FloatGrid>(0.1);
        measure_tradition(*empty, 1);
    });
    CancelledAtOnce progress;
    expect_error(Fault::cancelled, "", [&] { measure_tradition(*ball, 1, &progress); });
}

TEST(Tradition, ABoxTooLargeForAnyLatticeIsRefused) {
    const auto grid = openvdb::createLevelSet<openvdb::FloatGrid>(0.1);
    auto accessor = grid->getAccessor();
    for (const int far : {-1'000'000, 1'000'000})
        accessor.setValue({far, far, far}, -0.05f);
    expect_error(Fault::bad_input, "use a larger voxel", [&] { measure_tradition(*grid, 1); });
}

} // namespace
} // namespace taihu
