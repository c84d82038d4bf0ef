#include "vdb_ops/place.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "stats/sampler.h"
#include "tests/support/errors.h"
#include "tests/support/grids.h"
#include "vdb_ops/carve.h"
#include "vdb_ops/hole_region_detail.h"

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

const Box kUnit{{0, 0, 0}, {1, 1, 1}};

// Every pattern that takes a count.
std::vector<Pattern> counted_patterns() {
    return {UniformPattern{}, ClusterSettings{ClusterSettings::Shape::thomas, 20, 0.07},
            ClusterSettings{ClusterSettings::Shape::matern, 20, 0.15}, JointsPattern{3, 0.02},
            HardCorePattern{0.005}};
}

Placement with(Pattern pattern, Placement p) {
    p.pattern = std::move(pattern);
    return p;
}

std::vector<double> nearest_distances(const std::vector<Sphere>& holes) {
    std::vector<double> nearest(holes.size(), 1e300);
    for (std::size_t i = 0; i < holes.size(); ++i)
        for (std::size_t j = 0; j < holes.size(); ++j)
            if (j != i)
                nearest[i] = std::min(nearest[i], length(holes[i].center - holes[j].center));
    return nearest;
}

double least_gap(const std::vector<Sphere>& holes) {
    double least = 1e300;
    for (std::size_t i = 0; i < holes.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
            least = std::min(least, length(holes[i].center - holes[j].center) - holes[i].radius_m -
                                        holes[j].radius_m);
    return least;
}

TEST(PlacePattern, CountGivesThatManyCentresInsideAgainAndAgain) {
    const auto rock = ball_rock();
    for (const Pattern& pattern : counted_patterns()) {
        const Placement p = with(pattern, count(300));
        const auto holes = place_holes(Law::exponential(1), p, *rock).holes;
        ASSERT_EQ(holes.size(), 300u) << pattern_name(pattern);
        for (const Sphere& h : holes)
            EXPECT_LT(length(h.center), 1.001) << pattern_name(pattern);
        EXPECT_EQ(place_holes(Law::exponential(1), p, *rock).holes, holes);
        Placement other = p;
        other.seed = 1;
        EXPECT_NE(place_holes(Law::exponential(1), other, *rock).holes, holes);
    }
}

TEST(PlacePattern, ALongerListBeginsWithTheShorterOneUnlessItIsAHardCore) {
    for (const Pattern& pattern : counted_patterns()) {
        Placement few = with(pattern, count(40)), many = with(pattern, count(90));
        few.height = many.height = HeightShare{0.3, 1};
        const auto a = place_holes(Law::exponential(1), few, kUnit).holes;
        const auto b = place_holes(Law::exponential(1), many, kUnit).holes;
        EXPECT_EQ(std::equal(a.begin(), a.end(), b.begin()),
                  !std::holds_alternative<HardCorePattern>(pattern))
            << pattern_name(pattern);
    }
}

TEST(PlacePattern, UniformHolesAreThoseOfAHoleStream) {
    const auto holes = place_holes(Law::exponential(2), count(50), kUnit).holes;
    const HoleStream stream(Law::exponential(2), kUnit, 0.1, 0);
    for (std::uint64_t i = 0; i < 50; ++i)
        EXPECT_EQ(holes[i], stream.hole(i));
}

TEST(PlacePattern, PorosityIsReachedByTheLevelSetItself) {
    const auto rock = ball_rock(1, 0.03);
    for (const Pattern& pattern : {Pattern{JointsPattern{3, 0.02}}, Pattern{HardCorePattern{0.005}},
                                   counted_patterns()[1]}) {
        Placement p = with(pattern, {});
        p.porosity = 0.1;
        p.scale_m = 0.1;
        const auto holes = place_holes(Law::constant(1.5), p, *rock).holes;
        EXPECT_NEAR(carved_volume(*rock, *carve(*rock, holes).rock).porosity(), 0.1, 0.005)
            << pattern_name(pattern);
    }
}

TEST(PlacePattern, DensityIsThatOfAllBallsThatMeetTheBox) {
    // The box grown by their radius of 0.05.
    const double r = 0.05, pi = std::numbers::pi,
                 mean = 100 * (1 + 6 * r + 3 * pi * r * r + 4 * pi / 3 * r * r * r);
    for (const Pattern& pattern : counted_patterns()) {
        if (std::holds_alternative<JointsPattern>(pattern))
            continue;
        Placement p = with(pattern, {});
        p.scale_m = 0.1;
        p.density_m3 = 100;
        double sum = 0;
        constexpr int kRuns = 50;
        for (p.seed = 0; p.seed < kRuns; ++p.seed)
            sum += static_cast<double>(place_holes(Law::constant(1), p, kUnit).holes.size());
        // A Poisson number in each run, of clusters of 5 up to six times its variance; four
        // standard errors.
        const double variance = std::holds_alternative<ClusterSettings>(pattern) ? 6 * mean : mean;
        EXPECT_NEAR(sum / kRuns, mean, 4 * std::sqrt(variance / kRuns)) << pattern_name(pattern);
    }
}

TEST(PlacePattern, DensityOfJointsIsThatOfCentresInTheSolid) {
    // Diameters without end: holes from far around meet the box.
    Placement p = with(JointsPattern{2, 0.05}, {});
    p.scale_m = 0.2;
    p.density_m3 = 100;
    double sum = 0;
    constexpr int kRuns = 50;
    for (p.seed = 0; p.seed < kRuns; ++p.seed)
        for (const Sphere& hole : place_holes(Law::exponential(1), p, kUnit).holes)
            sum += kUnit.contains(hole.center);
    EXPECT_NEAR(sum / kRuns, 100, 4 * std::sqrt(100.0 / kRuns));
}

TEST(PlacePattern, FromLatticeToClustersTheNearestComesNearer) {
    const auto mean_nearest = [](const Pattern& pattern) {
        Placement p = with(pattern, std::holds_alternative<LatticePattern>(pattern) ? Placement{}
                                                                                    : count(1000));
        p.scale_m = 0.07;
        const auto nearest = nearest_distances(place_holes(Law::constant(1), p, kUnit).holes);
        EXPECT_EQ(nearest.size(), 1000u);
        double mean = 0;
        for (const double d : nearest)
            mean += d / 1000;
        return mean;
    };
    const double lattice = mean_nearest(LatticePattern{0.1}),
                 apart = mean_nearest(HardCorePattern{0}), uniform = mean_nearest(UniformPattern{}),
                 thomas = mean_nearest(ClusterSettings{ClusterSettings::Shape::thomas, 20, 0.07});
    EXPECT_NEAR(lattice, 0.1, 1e-12);
    EXPECT_GT(lattice, 1.1 * apart);
    EXPECT_GT(apart, 1.2 * uniform);
    // 0.554 n^(-1/3), Clark and Evans in space; a little more near faces.
    EXPECT_NEAR(uniform, 0.0554, 0.005);
    EXPECT_GT(uniform, 1.2 * thomas);
}

TEST(PlacePattern, AHardCoreKeepsItsGapHoweverItIsAskedFor) {
    Placement by_count = with(HardCorePattern{0.01}, count(400)),
              by_porosity = with(HardCorePattern{0.01}, {}),
              by_density = with(HardCorePattern{0.01}, {});
    by_porosity.porosity = 0.2;
    by_density.density_m3 = 300;
    by_porosity.scale_m = by_density.scale_m = 0.1;
    for (const Placement& p : {by_count, by_porosity, by_density}) {
        const auto holes = place_holes(Law::exponential(1.5), p, *ball_rock()).holes;
        EXPECT_GT(holes.size(), 300u);
        EXPECT_GE(least_gap(holes), 0.01 - 1e-12);
    }
    // Radii keep their law, as no ball is given up: Kolmogorov's distance, critical value at 1 %.
    std::vector<double> u;
    for (const Sphere& h : place_holes(Law::exponential(1.5), by_count, kUnit).holes)
        u.push_back(1 - std::exp(-1.5 * 2 * h.radius_m / 0.1));
    std::sort(u.begin(), u.end());
    double greatest = 0;
    for (std::size_t i = 0; i < u.size(); ++i)
        greatest = std::max({greatest, u[i] - double(i) / 400, double(i + 1) / 400 - u[i]});
    EXPECT_LT(greatest, 1.628 / 20);
}

TEST(PlacePattern, ALatticeIsFilledAtItsSpacing) {
    const Placement p = with(LatticePattern{0.25}, {});
    const auto holes = place_holes(Law::constant(0.1), p, Box{{0, 0, 0}, {1, 2, 0.5}}).holes;
    ASSERT_EQ(holes.size(), 4u * 8 * 2);
    for (const Sphere& h : holes)
        for (int axis = 0; axis < 3; ++axis) {
            const double steps = (h.center[axis] - 0.125) / 0.25;
            EXPECT_NEAR(steps, std::round(steps), 1e-12);
        }
    // In a ball: about as many as its volume has cells, and as many on either side of the middle.
    const auto ball = place_holes(Law::constant(0.1), p, *ball_rock()).holes;
    const double cells = 4 * std::numbers::pi / 3 / std::pow(0.25, 3);
    EXPECT_NEAR(static_cast<double>(ball.size()), cells, 0.1 * cells); // 268; the surface is 800
    Vec3 sum;
    for (const Sphere& h : ball)
        sum += h.center;
    EXPECT_LT(length(sum), 1e-3 * static_cast<double>(ball.size()));
}

TEST(PlacePattern, JointsHoldAllCentresOnTheirPlanes) {
    const Placement p = with(JointsPattern{2, 0.01}, count(1000));
    const auto rock = ball_rock();
    const auto holes = place_holes(Law::constant(0.1), p, *rock).holes;
    // The planes are the first two through points inside, of those about the box of its leaves.
    openvdb::CoordBBox leaves;
    rock->tree().evalLeafBoundingBox(leaves);
    Box box;
    for (const auto& c : {leaves.min(), leaves.max()})
        box.include(Vec3{double(c.x()), double(c.y()), double(c.z())} * 0.05);
    auto planes = random_joints(box, 64, 0);
    std::erase_if(planes, [](const JointPlane& j) { return length(j.point) >= 1; });
    double squares = 0;
    for (const Sphere& h : holes) {
        double off = 1e300;
        for (const JointPlane& j : {planes[0], planes[1]})
            off = std::min(off, std::abs(dot(h.center - j.point, normalized(j.normal))));
        EXPECT_LT(off, 0.05); // five standard deviations
        squares += off * off / 1000;
    }
    // Four standard errors; and a little less, because the nearer of two planes is taken.
    EXPECT_NEAR(std::sqrt(squares), 0.01, 4 * 0.01 / std::sqrt(2000) + 0.0003);
}

TEST(PlacePattern, MaternClustersAreBallsAboutTheirParents) {
    const ClusterSettings matern{ClusterSettings::Shape::matern, 10, 0.04};
    auto left = place_holes(Law::constant(0.1), with(matern, count(400)), kUnit).holes;
    std::uint64_t n_groups = 0;
    for (; !left.empty(); ++n_groups) {
        const Vec3 first = left.front().center;
        std::erase_if(left, [&](const Sphere& h) { return length(h.center - first) <= 2 * 0.04; });
    }
    // A cluster is wiped out by any of its points; those that overlap may leave a few over.
    const std::uint64_t n_parents = ClusterCenters(kUnit, matern, 0).n_parents();
    EXPECT_LE(n_groups, n_parents);
    EXPECT_GT(n_groups, n_parents / 2);
}

TEST(PlaceShares, HeightIsAStraightTrendFromBottomToTop) {
    // Share t = (1 + y) / 2 in a unit ball: E y = 1/5, E y^2 = 1/5, so the sd is 0.4.
    Placement p = count(1000);
    p.height = HeightShare{0, 1};
    for (const Pattern& pattern : {Pattern{UniformPattern{}}, Pattern{HardCorePattern{0}}}) {
        double mean = 0;
        for (const Sphere& h :
             place_holes(Law::constant(0.5), with(pattern, p), *ball_rock()).holes)
            mean += h.center.y / 1000;
        EXPECT_NEAR(mean, 0.2, 4 * 0.4 / std::sqrt(1000)) << pattern_name(pattern);
    }
    // The density holds where the share is 1: half of it is left of 0:1.
    Placement dense;
    dense.density_m3 = 4000;
    dense.scale_m = 1e-3;
    dense.height = HeightShare{0, 1};
    const auto n = static_cast<double>(place_holes(Law::constant(1), dense, kUnit).holes.size());
    EXPECT_NEAR(n, 2000, 4 * std::sqrt(2000));
    Placement lattice = with(LatticePattern{0.05}, {});
    lattice.height = HeightShare{1, 0.5};
    const auto nodes =
        static_cast<double>(place_holes(Law::constant(1), lattice, kUnit).holes.size());
    EXPECT_NEAR(nodes, 6000, 4 * std::sqrt(2000)); // of 8000
}

TEST(PlaceShares, ALevelSetLetsHolesInsideAlone) {
    const auto part = ball_rock(0.4, 0.02);
    Placement p = count(500);
    p.where = part;
    for (const Pattern& pattern : counted_patterns()) {
        const auto holes =
            place_holes(Law::constant(0.4), with(pattern, p), Box{{-1, -1, -1}, {1, 1, 1}}).holes;
        ASSERT_EQ(holes.size(), 500u);
        for (const Sphere& h : holes)
            EXPECT_LT(length(h.center), 0.401) << pattern_name(pattern);
    }
    p.count.reset();
    const auto lattice =
        place_holes(Law::constant(0.4), with(LatticePattern{0.1}, p), Box{{-1, -1, -1}, {1, 1, 1}})
            .holes;
    for (const Sphere& h : lattice)
        EXPECT_LT(length(h.center), 0.401);
    EXPECT_GT(lattice.size(), 200u); // 268 cells
}

/// 1/4 below y = 0, all above, on voxels of 0.1 m.
openvdb::FloatGrid::Ptr quarter_below() {
    auto fog = openvdb::FloatGrid::create(1);
    fog->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
    fog->setGridClass(openvdb::GRID_FOG_VOLUME);
    fog->fill(openvdb::CoordBBox({-40, -40, -40}, {40, -1, 40}), 0.25f);
    return fog;
}

TEST(PlaceShares, AFogVolumeIsTheShareOfHoles) {
    Placement p = count(4000);
    p.where = quarter_below();
    const Box box{{-1, -1, -1}, {1, 1, 1}};
    double below = 0;
    for (const Sphere& h : place_holes(Law::constant(1), p, box).holes)
        below += h.center.y < -0.05;
    // 0.25 * 0.95 of 0.25 * 0.95 + 0.1 * (0.25 + 1) / 2 + 0.95, the step being one voxel wide.
    const double share = 0.2375 / (0.2375 + 0.0625 + 0.95);
    EXPECT_NEAR(below / 4000, share, 4 * std::sqrt(share * (1 - share) / 4000));
    p.height = HeightShare{1, 0}; // both: 0.25 t and t, t falling from 1 to 0 upwards
    below = 0;
    for (const Sphere& h : place_holes(Law::constant(1), p, box).holes)
        below += h.center.y < 0;
    EXPECT_NEAR(below / 4000, 0.75 / 1.75, 0.05); // the step of one voxel moves 1 %
}

TEST(PlaceShares, RefuseByName) {
    const Law law = Law::constant(1);
    Placement p = count(10);
    p.height = HeightShare{0, 0};
    expect_error(Fault::bad_argument, "the share is 0 at the bottom and 0 at the top",
                 [&] { place_holes(law, p, kUnit); });
    p.height = HeightShare{0.5, 1.5};
    expect_error(Fault::bad_argument, "1.5 at the top", [&] { place_holes(law, p, kUnit); });
    p.height.reset();
    const auto fog = quarter_below();
    fog->tree().setValue(openvdb::Coord(0), 2);
    p.where = fog;
    expect_error(Fault::bad_argument, "the volume 'where' is 2 somewhere, must be 0..1",
                 [&] { place_holes(law, p, kUnit); });
    p.where = ball_rock(0.4, 0.02); // all of it outside
    expect_error(Fault::numeric, "fewer than 1 in 1e5 centres", [&] {
        place_holes(law, p, Box{{2, 2, 2}, {3, 3, 3}});
    });
    p.count.reset();
    p.porosity = 0.2;
    expect_error(Fault::numeric, "fewer than 1 in 1e5 centres", [&] {
        place_holes(law, p, Box{{2, 2, 2}, {3, 3, 3}});
    });
}

TEST(PlacePattern, RefusesByName) {
    const Law law = Law::constant(1);
    expect_error(Fault::bad_argument, "a lattice has as many as its spacing fits in",
                 [&] { place_holes(law, with(LatticePattern{0.1}, count(10)), kUnit); });
    expect_error(Fault::bad_argument, "spacing_m is 0",
                 [&] { place_holes(law, with(LatticePattern{0}, {}), kUnit); });
    expect_error(Fault::bad_argument, "0 joints, must be 1..1000", [&] {
        place_holes(law, with(JointsPattern{0, 0.1}, count(10)), kUnit);
    });
    expect_error(Fault::bad_argument, "gap_m is -1",
                 [&] { place_holes(law, with(HardCorePattern{-1}, count(10)), kUnit); });
    expect_error(Fault::numeric, "finds no room",
                 [&] { place_holes(law, with(HardCorePattern{0.2}, count(1000)), kUnit); });
    // A few small clusters cannot take half of the box away: said soon, not after 1e8 holes.
    Placement p = with(ClusterSettings{ClusterSettings::Shape::matern, 5, 0.1}, {});
    p.scale_m = 0.05;
    p.porosity = 0.5;
    expect_error(Fault::numeric, "more take hardly more away", [&] { place_holes(law, p, kUnit); });
}

TEST(PlaceHoles, RefusesMoreThanArePlacedBeforeAnyIs) {
    Placement p;
    p.scale_m = 1e-5;
    for (const bool by_density : {false, true}) {
        (by_density ? p.density_m3 : p.porosity) = by_density ? 1e18 : 0.5;
        expect_error(Fault::bad_argument, "at most 1e8 are placed; use a larger scale",
                     [&] { place_holes(Law::exponential(1), p, kUnit); });
        p.density_m3 = p.porosity = std::nullopt;
    }
}

TEST(PlaceHoles, PorosityIsCountedInFlatAndThinBoxes) {
    Placement p;
    p.porosity = 0.3;
    p.scale_m = 1e-3;
    for (const Vec3& size : {Vec3{1, 1, 1e-9}, Vec3{1, 1e-6, 1e-6}, Vec3{1e-7, 10, 1e-7}}) {
        const PlacedHoles placed = place_holes(Law::constant(1), p, Box{{0, 0, 0}, size});
        EXPECT_NEAR(placed.porosity.value(), 0.3, 0.005) << size.y;
    }
}

TEST(HoleRegion, BallsFromFarOffMeetASolidOrDoNot) {
    const auto rock = ball_rock();
    const auto region = hole_region(*rock);
    EXPECT_TRUE(region->meets({{50, 0, 0}, 49.5}));
    EXPECT_FALSE(region->meets({{50, 0, 0}, 48.5}));
    EXPECT_TRUE(region->meets({{1e100, 0, 0}, 1e101}));
    EXPECT_FALSE(region->meets({{1e308, 0, 0}, 1e307}));
    EXPECT_FALSE(region->meets({{1e308, 1e308, 0}, std::nan("")}));
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
