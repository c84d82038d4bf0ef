#include "vdb_ops/porous.h"

#include <cmath>
#include <numbers>

#include <tbb/global_control.h>

#include "stats/boolean_model.h"
#include "tests/support/errors.h"
#include "tests/support/grids.h"
#include "vdb_ops/analytic_field.h"
#include "vdb_ops/carve.h"
#include "vdb_ops/place.h"

namespace taihu {
namespace {

constexpr double kPi = std::numbers::pi;

openvdb::FloatGrid::Ptr box_rock(const Vec3& half, double voxel_m) {
    const AnalyticField field({-half, half}, [=](const Vec3& p) { return box_distance(p, half); });
    return rasterize(field, {voxel_m, {}, 3});
}

TEST(Pores, OneHoleHasItsSurfaceChordsAndCorrelation) {
    const double r = 0.25;
    const auto base = box_rock({0.5, 0.5, 0.5}, 0.0125);
    const std::vector<Sphere> hole = {{{0.03, -0.02, 0.05}, r}};
    const PoreMeasures m = measure_pores(*carve(*base, hole).rock, base.get(), {20'000, 1});
    const double side = 1 - 2 * m.margin_m, volume = side * side * side;
    EXPECT_NEAR(m.margin_m, 0.0125, 1e-12);
    const double p = 4.0 / 3 * kPi * r * r * r / volume, s_v = 4 * kPi * r * r / volume;
    // Four standard errors of the lines, of which one in twelve meets the hole: 1600 chords, whose
    // lengths have a cv of 0.35.
    EXPECT_NEAR(m.s_v_m1.value, s_v, 4 * m.s_v_line_se_m1);
    EXPECT_LT(m.s_v_line_se_m1, 0.03 * s_v);
    EXPECT_NEAR(m.porosity.value, p, 4 * 0.03 * p);
    ASSERT_TRUE(m.hole_chords.mean_m);
    EXPECT_NEAR(m.hole_chords.mean_m->value, 4 * r / 3, 4 * 0.35 / 40 * 4 * r / 3);
    // Of a ball's chords, the share below x is (x / 2r)^2.
    for (std::size_t q = 0; q < kQuantiles.size(); ++q)
        EXPECT_NEAR(*m.hole_chords.quantiles_m[q], 2 * r * std::sqrt(kQuantiles[q]), 0.01) << q;
    EXPECT_NEAR(m.pores->mean_m, 2 * r, 0.0125);
    EXPECT_NEAR(m.pores->greatest_m, 2 * r, 0.0125);
    EXPECT_EQ(m.euler_faces, 2); // a piece and a cavity
    EXPECT_EQ(m.euler_corners, 2);
    // A set of isotropic lines gives the ball's own set covariance, over the box's for the pairs.
    const auto lens = [&](double t) { return kPi / 12 * (2 * r - t) * (2 * r - t) * (4 * r + t); };
    for (const CorrelationPoint& c : m.correlation) {
        const double t = c.distance_m;
        // The isotropic set covariance of a cube, for t below its side.
        const double pairs =
            volume - 1.5 * side * side * t + 2 / kPi * side * t * t - t * t * t / (4 * kPi);
        const double exact = t < 2 * r ? lens(t) / pairs : 0;
        EXPECT_NEAR(c.both->value, exact, 0.04 * p + 0.02 * exact) << t;
    }
}

TEST(Pores, BooleanHolesAreAsPredicted) {
    const double d = 0.1, n_v = 500, voxel_m = 0.0125;
    const Law law = Law::constant(d);
    const BooleanModel model = boolean_model(law, n_v);
    const auto base = box_rock({0.5, 0.5, 0.5}, voxel_m);
    Placement placement;
    placement.density_m3 = n_v;
    placement.seed = 5;
    const auto rock = carve(*base, place_holes(law, placement, *base).holes).rock;
    const PoreMeasures m = measure_pores(*rock, base.get());
    // Four standard errors from the blocks, which 24 rocks confirm to 15 %, and 3 % of the surface
    // that holes of eight voxels lose where they meet in ridges (at five voxels more: 2 %).
    const auto expect = [](const Estimate& found, double exact, double lost,
                           const std::string& what) {
        ASSERT_TRUE(found.se) << what;
        EXPECT_NEAR(found.value, exact, 4 * *found.se + lost * exact) << what;
        EXPECT_LT(*found.se, 0.15 * exact) << what; // or there is nothing to fail
        EXPECT_GT(*found.se, 0.005 * exact) << what;
    };
    expect(m.porosity, model.porosity, 0, "porosity");
    expect(m.s_v_m1, model.s_v, 0.03, "surface");
    expect(*m.solid_chords.mean_m, 4 * (1 - model.porosity) / model.s_v, 0.03, "solid chord");
    expect(*m.hole_chords.mean_m, 4 * model.porosity / model.s_v, 0.03, "hole chord");
    for (const CorrelationPoint& c : m.correlation)
        expect(*c.both, boolean_covariance(law, n_v, c.distance_m), 0,
               "pairs at " + std::to_string(c.distance_m));
    // Chords between balls thrown at random are exponential.
    const Estimate mean = *m.solid_chords.mean_m;
    for (std::size_t q = 2; q < kQuantiles.size(); ++q) {
        const double exact = -mean.value * std::log(1 - kQuantiles[q]);
        EXPECT_NEAR(*m.solid_chords.quantiles_m[q], exact, 4 * *mean.se / mean.value * exact);
    }
    double above = 1;
    for (const double share : m.solid_chords.shares)
        above -= share;
    EXPECT_NEAR(above, 0.01, 0.002); // the bins end where 1 % is left
    // Hardly a hole is smaller than it was thrown, some have merged.
    EXPECT_NEAR(m.pores->quantiles_m[2], d, voxel_m);
    EXPECT_GE(m.pores->greatest_m, d - voxel_m);
}

TEST(Pores, WithoutABaseEnclosedVoidsAreFilled) {
    // A cube with a round hole from side to side: its mouths are where the faces were.
    const double r = 0.15;
    const AnalyticField field({{-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}}, [=](const Vec3& p) {
        return std::max(box_distance(p, {0.5, 0.5, 0.5}), r - std::hypot(p.y - 0.1, p.z));
    });
    const auto rock = rasterize(field, {0.02, Vec3{0.003, 0.007, 0.009}, 3});
    const PoreMeasures m = measure_pores(*rock, nullptr, {10'000, 2});
    const double side = 1 - 2 * m.margin_m;
    EXPECT_NEAR(m.porosity.value, kPi * r * r / (side * side), 0.006); // 8 %: four errors of lines
    EXPECT_NEAR(m.s_v_m1.value, 2 * kPi * r / (side * side), 4 * m.s_v_line_se_m1);
    EXPECT_NEAR(m.pores->quantiles_m[2], 2 * r, 0.02);
    EXPECT_EQ(m.euler_faces, 0); // a ring
    EXPECT_EQ(m.euler_corners, 0);
}

TEST(Pores, ABaseOnAnotherLatticeDoes) {
    const std::vector<Sphere> hole = {{{0.03, -0.02, 0.05}, 0.25}};
    const auto rock = carve(*box_rock({0.5, 0.5, 0.5}, 0.02), hole).rock;
    const auto base = box_rock({0.5, 0.5, 0.5}, 0.017);
    const PoreMeasures m = measure_pores(*rock, base.get(), {10'000, 1});
    const double side = 1 - 2 * m.margin_m, volume = side * side * side;
    EXPECT_NEAR(m.s_v_m1.value, 4 * kPi * 0.0625 / volume, 4 * m.s_v_line_se_m1);
    EXPECT_NEAR(m.pores->mean_m, 0.5, 0.02);
}

TEST(Pores, TwiceTheSizeHasTwiceTheLengths) {
    const std::vector<Sphere> one = {{{0.1, -0.1, 0.05}, 0.2}, {{-0.2, 0.1, 0}, 0.15}};
    std::vector<Sphere> two = one;
    for (Sphere& hole : two)
        hole = {hole.center * 2, hole.radius_m * 2};
    const auto measure = [](const std::vector<Sphere>& holes, double scale) {
        const auto base = box_rock(Vec3{0.5, 0.5, 0.5} * scale, scale / 64);
        return measure_pores(*carve(*base, holes).rock, base.get(), {2000, 3});
    };
    const PoreMeasures a = measure(one, 1), b = measure(two, 2);
    // Powers of two: the same lines, up to the last bits of floats.
    EXPECT_NEAR(b.porosity.value, a.porosity.value, 1e-5);
    EXPECT_NEAR(b.s_v_m1.value, a.s_v_m1.value / 2, 1e-4);
    EXPECT_NEAR(b.walls->mean_m, 2 * a.walls->mean_m, 1e-4);
    EXPECT_NEAR(b.pores->quantiles_m[1], 2 * a.pores->quantiles_m[1], 1e-4);
    EXPECT_NEAR(b.hole_chords.mean_m->value, 2 * a.hole_chords.mean_m->value, 1e-4);
    EXPECT_NEAR(b.correlation[4].distance_m, 2 * a.correlation[4].distance_m, 1e-12);
    EXPECT_NEAR(b.correlation[4].both->value, a.correlation[4].both->value, 1e-5);
}

TEST(Pores, AreTheSameOnOneThread) {
    const std::vector<Sphere> holes = {{{0.1, -0.1, 0.05}, 0.2}, {{-0.2, 0.1, 0}, 0.25}};
    const auto base = box_rock({0.5, 0.5, 0.5}, 1 / 32.);
    const auto rock = carve(*base, holes).rock;
    const PoreMeasures many = measure_pores(*rock, base.get(), {1000, 3});
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const PoreMeasures single = measure_pores(*rock, base.get(), {1000, 3});
    EXPECT_EQ(many.s_v_m1.value, single.s_v_m1.value);
    EXPECT_EQ(many.s_v_m1.se, single.s_v_m1.se);
    EXPECT_EQ(many.correlation[7].both->value, single.correlation[7].both->value);
    EXPECT_EQ(many.solid_chords.quantiles_m, single.solid_chords.quantiles_m);
    EXPECT_EQ(many.walls->mean_m, single.walls->mean_m);
    EXPECT_EQ(many.pores->quantiles_m, single.pores->quantiles_m);
    EXPECT_NE(many.s_v_m1.value, measure_pores(*rock, base.get(), {1000, 4}).s_v_m1.value);
}

TEST(Pores, ASolidWithoutHolesHasNone) {
    const auto ball = ball_rock();
    const PoreMeasures m = measure_pores(*ball, ball.get(), {1000, 0});
    EXPECT_EQ(m.porosity.value, 0);
    EXPECT_EQ(m.s_v_m1.value, 0);
    EXPECT_FALSE(m.pores);
    EXPECT_FALSE(m.solid_chords.mean_m);
    EXPECT_FALSE(m.hole_chords.quantiles_m[0]);
    EXPECT_NEAR(m.walls->mean_m, 2, 0.05);
    EXPECT_EQ(m.euler_faces, 1);
}

struct CancelledAtOnce final : Progress {
    void stage(std::string_view) override {}
    void fraction(double) override {}
    bool cancelled() const override { return true; }
};

TEST(Pores, RefuseByName) {
    const auto ball = ball_rock();
    for (const std::uint64_t n : {std::uint64_t{99}, std::uint64_t{10'000'001}})
        expect_error(Fault::bad_argument, "n_lines is " + std::to_string(n), [&] {
            measure_pores(*ball, nullptr, {n, 0});
        });
    const auto empty = openvdb::createLevelSet<openvdb::FloatGrid>(0.1);
    expect_error(Fault::bad_input, "is empty", [&] { measure_pores(*empty); });
    expect_error(Fault::bad_input, "is empty", [&] { measure_pores(*ball, empty.get()); });
    expect_error(Fault::bad_input, "deeper than a voxel", [&] {
        const auto crumb = ball_rock(0.04, 0.05); // its middle is less deep than a voxel
        measure_pores(*ball, crumb.get());
    });
    expect_error(Fault::bad_input, "check their units", [&] {
        const auto planet = ball_rock(1e9, 1e8);
        measure_pores(*ball_rock(0.01, 0.0005), planet.get());
    });
    CancelledAtOnce progress;
    expect_error(Fault::cancelled, "", [&] { measure_pores(*ball, nullptr, {}, &progress); });
}

} // namespace
} // namespace taihu
