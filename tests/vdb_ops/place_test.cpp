#include "vdb_ops/place.h"

#include <numbers>

#include "tests/support/errors.h"
#include "tests/support/grids.h"
#include "vdb_ops/carve.h"

namespace taihu {
namespace {

Placement count(std::uint64_t n) {
    Placement p;
    p.count = n;
    p.scale_m = 0.1;
    return p;
}

TEST(PlaceHoles, CountGivesThatManyCentresInside) {
    const PlacedHoles placed = place_holes(Law::exponential(1), count(500), *ball_rock());
    ASSERT_EQ(placed.holes.size(), 500u);
    double mean = 0, r5 = 0;
    for (const Sphere& h : placed.holes) {
        EXPECT_LT(length(h.center), 1.001);
        mean += 2 * h.radius_m / 500;
        r5 += length_squared(h.center) / 500;
    }
    // Four standard errors: sd of an exponential is its mean; E r^2 = 3/5 with sd 0.26 in a unit
    // ball.
    EXPECT_NEAR(mean, 0.1, 4 * 0.1 / std::sqrt(500));
    EXPECT_NEAR(r5, 0.6, 4 * 0.26 / std::sqrt(500));
}

TEST(PlaceHoles, ALongerListBeginsWithTheShorterOne) {
    const auto rock = ball_rock();
    const auto few = place_holes(Law::exponential(1), count(20), *rock).holes;
    const auto many = place_holes(Law::exponential(1), count(50), *rock).holes;
    EXPECT_TRUE(std::equal(few.begin(), few.end(), many.begin()));
}

TEST(PlaceHoles, PorosityIsReachedByTheLevelSetItself) {
    const auto rock = ball_rock(1, 0.02);
    for (const double target : {0.1, 0.25, 0.5}) {
        Placement p;
        p.porosity = target;
        p.scale_m = 0.1;
        p.seed = 3;
        const PlacedHoles placed = place_holes(Law::exponential(1), p, *rock);
        // The promise of 0.005 is about the level set, not about the samples it was counted on.
        const auto carved = carve(*rock, placed.holes).rock;
        EXPECT_NEAR(carved_volume(*rock, *carved).porosity(), target, 0.005);
    }
}

TEST(PlaceHoles, DensityIsAPoissonProcessOfTouchingBalls) {
    // Balls of one radius r that touch a unit ball have centres within 1 + r: N = density * volume.
    Placement p;
    p.density_m3 = 50;
    p.scale_m = 1;
    const double r = 0.3, mean = 50 * 4.0 / 3 * std::numbers::pi * std::pow(1 + r, 3);
    double sum = 0;
    constexpr int kRuns = 20;
    for (int seed = 0; seed < kRuns; ++seed) {
        p.seed = static_cast<std::uint64_t>(seed);
        const PlacedHoles placed = place_holes(Law::constant(2 * r), p, *ball_rock());
        sum += static_cast<double>(placed.holes.size());
        for (const Sphere& h : placed.holes)
            ASSERT_LT(length(h.center),
                      1 + r + 0.01); // voxel 0.05: distances there are exact to 1 %
    }
    EXPECT_NEAR(sum / kRuns, mean, 4 * std::sqrt(mean / kRuns) + 0.01 * mean);
}

TEST(PlaceHoles, InABoxWorksTheSame) {
    const Box box{{0, 0, 0}, {1, 2, 3}};
    for (const Sphere& h : place_holes(Law::exponential(1), count(200), box).holes)
        EXPECT_TRUE(box.contains(h.center));
    Placement p;
    p.porosity = 0.3;
    p.scale_m = 0.2;
    EXPECT_NEAR(*place_holes(Law::exponential(1), p, box).porosity, 0.3, 0.005);
}

TEST(PlaceHoles, RefusesByName) {
    const auto rock = ball_rock();
    const Law law = Law::exponential(1);
    expect_error(Fault::bad_argument, "0 of count, porosity and density",
                 [&] { place_holes(law, {}, *rock); });
    Placement p = count(3);
    p.porosity = 0.2;
    expect_error(Fault::bad_argument, "2 of count", [&] { place_holes(law, p, *rock); });
    p = count(3);
    p.scale_m = 0;
    expect_error(Fault::bad_argument, "scale", [&] { place_holes(law, p, *rock); });
    Placement full;
    full.porosity = 1;
    expect_error(Fault::bad_argument, "0..0.95", [&] { place_holes(law, full, *rock); });
    Placement
        coarse; // balls a thousand times the rock: nearly every one takes all of it or nothing
    coarse.porosity = 0.05;
    expect_error(Fault::numeric, "one hole apart",
                 [&] { place_holes(Law::constant(1000), coarse, *rock); });
    expect_error(Fault::bad_argument, "no volume", [&] { place_holes(law, count(3), Box{}); });
}

} // namespace
} // namespace taihu
