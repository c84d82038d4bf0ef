#include "vdb_ops/bites.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/support/errors.h"
#include "tests/support/fields.h"
#include "tests/support/grids.h"
#include "tests/support/level_sets.h"
#include "vdb_ops/band_detail.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

Box around(double half) {
    Box box;
    box.include({-half, -half, -half});
    box.include({half, half, half});
    return box;
}

Bite ellipsoid(const Vec3& center, const Vec3& axis, double along, double across, double rim = 0) {
    return {center, normalized(axis), along, across, rim};
}

TEST(Bites, AnEllipsoidInsideTakesItsVolume) {
    const auto ball = ball_grid(0.5, 0.02);
    const auto rock = bitten(*ball, std::vector{ellipsoid({0.05, 0, 0}, {1, 1, 0}, 0.3, 0.15)});
    const double taken = 4 * std::numbers::pi / 3 * 0.3 * 0.15 * 0.15;
    EXPECT_NEAR(volume_m3(*ball) - volume_m3(*rock), taken, 0.01 * taken);
    const BandReader reader(rock);
    const Vec3 tip = Vec3{0.05, 0, 0} + normalized(Vec3{1, 1, 0}) * 0.3;
    EXPECT_NEAR(reader.at(tip), 0, 0.003); // a seventh of a voxel, at a tip of 4 voxels' radius
    EXPECT_GT(reader.at({0.05, 0, 0}), 0);
}

TEST(Bites, ARimIsRoundedOverItsWidth) {
    const auto ball = ball_grid(0.5, 0.0125);
    const Vec3 top{0, 0.5, 0};
    const auto sharp = bitten(*ball, std::vector{ellipsoid(top, {0, 1, 0}, 0.2, 0.2)}),
               soft = bitten(*ball, std::vector{ellipsoid(top, {0, 1, 0}, 0.2, 0.2, 0.1)});
    // Where |p| = 0.5 and |p - top| = 0.2: 0.1 / 6 of the two distances, over a slope below 1.5.
    const double y = (0.25 + 0.25 - 0.04) / 1.0, x = std::sqrt(0.25 - y * y);
    EXPECT_NEAR(BandReader(sharp).at({x, y, 0}), 0, 0.006);
    EXPECT_GT(BandReader(soft).at({x, y, 0}), 0.1 / 6 / 1.5);
    EXPECT_NEAR(BandReader(soft).at({0, 0.3, 0}), 0, 0.002); // its bottom stays
}

TEST(Bites, TheOrderOfTheListDoesNotMatter) {
    const auto ball = ball_grid(0.5, 0.025);
    std::vector<Bite> bites;
    for (std::uint64_t i = 0; i < 20; ++i)
        bites.push_back(ellipsoid(normalized(random_vec(i)) * 0.5, random_vec(i, 5),
                                  0.1 + 0.1 * random_number(i, 9), 0.1, 0.02));
    const auto once = bitten(*ball, bites);
    std::reverse(bites.begin(), bites.end());
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(grid_hash(*bitten(*ball, bites)), grid_hash(*once));
}

BiteSettings some(std::uint64_t count) {
    BiteSettings s;
    s.count = count;
    s.mean_m = 0.06;
    s.least_m = 0.05;
    s.most_m = 0.2;
    return s;
}

TEST(Bites, BeginAtTheSurfaceEverywhereAndStandOffByTheirOffset) {
    const auto ball = ball_grid(0.5, 0.0125);
    BiteSettings s = some(1000);
    s.aspect = 1;
    s.aspect_spread = 0;
    const auto bites = place_bites(*ball, around(0.5), s);
    ASSERT_EQ(bites.size(), 1000u);
    int up = 0;
    double least = 9, most = -9, mean = 0;
    for (const Bite& b : bites) {
        const double off = (length(b.center) - 0.5) / b.across_m;
        least = std::min(least, off);
        most = std::max(most, off);
        up += b.center.y > 0;
        mean += 2 * b.across_m / 1000;
        EXPECT_NEAR(b.along_m, b.across_m, 1e-12);
        EXPECT_GE(2 * b.across_m, 0.05);
        EXPECT_LE(2 * b.across_m, 0.2);
    }
    // 0.75 +- 0.25 of the radius; a first order distance is a twentieth of a voxel off.
    EXPECT_NEAR(least, 0.5, 0.05);
    EXPECT_NEAR(most, 1, 0.05);
    EXPECT_NEAR(up, 500, 64); // four standard errors
    // The mean of an exponential law of mean 0.06 between 0.05 and 0.2.
    const double a = std::exp(-0.05 / 0.06), b = std::exp(-0.2 / 0.06);
    EXPECT_NEAR(mean, 0.06 + (0.05 * a - 0.2 * b) / (a - b), 0.005);
}

TEST(Bites, BeginInsideInTheirShareOfTheHeightAndInClusters) {
    const auto ball = ball_grid(0.5, 0.025);
    BiteSettings s = some(300);
    s.inside = true;
    s.bottom = 0.6;
    s.top = 0.7;
    for (const Bite& b : place_bites(*ball, around(0.5), s)) {
        EXPECT_LT(length(b.center), 0.5);
        EXPECT_GE(b.center.y, 0.1 - 1e-9);
        EXPECT_LE(b.center.y, 0.2 + 1e-9);
    }
    s = some(100);
    s.inside = true;
    s.clusters = BiteSettings::Clusters{1, 0.05};
    const auto cluster = place_bites(*ball, around(0.5), s);
    for (const Bite& b : cluster)
        EXPECT_LE(length(b.center - cluster.front().center), 0.1);
}

TEST(Bites, AChainGoesOnInItself) {
    BiteSettings s = some(200);
    s.inside = true;
    s.chain = 4;
    const auto bites = place_bites(*ball_grid(0.5, 0.025), around(0.5), s);
    EXPECT_NEAR(static_cast<double>(bites.size()), 800, 60); // 2..6 each: four standard errors
    int within = 0;
    for (std::size_t i = 1; i < bites.size(); ++i)
        within += length(bites[i].center - bites[i - 1].center) < 1.2 * bites[i - 1].along_m + 1e-9;
    EXPECT_GE(within, static_cast<int>(bites.size()) - 200);
}

TEST(Bites, LieAtTheSamePlacesOnAnotherLattice) {
    const BiteSettings s = some(300);
    const auto fine = place_bites(*ball_grid(0.5, 0.0125), around(0.5), s),
               coarse = place_bites(*ball_grid(0.5, 0.02), around(0.5), s);
    int same = 0;
    for (std::size_t i = 0; i < 300; ++i)
        same += length(fine[i].center - coarse[i].center) < 0.002; // a tenth of a voxel
    EXPECT_GE(same, 285); // points near the edge of the shell fall to one side or the other
    BiteSettings other = s;
    other.seed = 1;
    EXPECT_GT(
        length(place_bites(*ball_grid(0.5, 0.02), around(0.5), other)[0].center - coarse[0].center),
        1e-3);
}

TEST(Bites, MoveWithTheSolidThatIsPutElsewhere) {
    const Similarity at = Similarity::translation({3, 1, 2}) * Similarity::scaling(2);
    const auto put = rasterize(BallsField(std::array<Sphere, 1>{{{{3, 1, 2}, 1}}}), {0.05, {}, 3});
    const auto here = place_bites(*ball_grid(0.5, 0.025), around(0.5), some(100)),
               there = place_bites(*put, around(0.5), some(100), at);
    int same = 0;
    for (std::size_t i = 0; i < 100; ++i)
        same += length(at.point(here[i].center) - there[i].center) < 0.005 &&
                std::fabs(2 * here[i].along_m - there[i].along_m) < 1e-9;
    EXPECT_GE(same, 95);
}

TEST(Bites, RefuseWhatIsOutOfRange) {
    const auto ball = ball_grid(0.5, 0.05);
    const auto refused = [&](Fault fault, const BiteSettings& s, const char* what) {
        expect_error(fault, what, [&] { place_bites(*ball, around(0.5), s); });
    };
    BiteSettings s = some(0);
    refused(Fault::bad_argument, s, "bites: count is 0, must be 1..1e6");
    s = some(1);
    s.most_m = 0.01;
    refused(Fault::bad_argument, s, "bites: most_m is 0.01, must be above least_m");
    s = some(1);
    s.bottom = 1;
    refused(Fault::bad_argument, s, "bites: bottom is 1, must be 0 or more, below top");
    s = some(1);
    s.inside = true;
    s.bottom = 0.9999999;
    refused(Fault::numeric, s, "bites: none of 100000 points is in the solid");
    expect_error(Fault::bad_argument, "bites[0] has a length out of range", [&] {
        bitten(*ball, std::vector{ellipsoid({}, {0, 1, 0}, 0, 1)});
    });
    expect_error(Fault::unsupported, "bites: they touch more than 2^26 leaves", [&] {
        bitten(*ball, std::vector{ellipsoid({}, {0, 1, 0}, 1e6, 1e6)});
    });
}

} // namespace
} // namespace taihu
