#include "vdb_ops/region_relief.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "tests/support/errors.h"

namespace taihu {
namespace {

RegionPlane plane(int size_px, int n_regions, bool tileable = false, std::uint64_t seed = 5) {
    return {size_px, 0.01, n_regions, tileable, seed};
}

/// The nearest and the second nearest centre by looking at all of them, images included.
struct Brute {
    int id = -1;
    double r = std::numeric_limits<double>::infinity(), second = r, dx = 0, dy = 0;

    Brute(const RegionPlane& p, int x, int y) {
        const auto centers = region_centers(p);
        const double side = p.side_m();
        const int reach = p.tileable ? 1 : 0;
        for (std::size_t i = 0; i < centers.size(); ++i)
            for (int sx = -reach; sx <= reach; ++sx)
                for (int sy = -reach; sy <= reach; ++sy) {
                    const double ux = x * p.pixel_m - (centers[i].x_m + sx * side);
                    const double uy = y * p.pixel_m - (centers[i].y_m + sy * side);
                    const double d = std::hypot(ux, uy);
                    if (d < r) {
                        second = r, r = d, dx = ux, dy = uy;
                        id = static_cast<int>(i);
                    } else {
                        second = std::min(second, d);
                    }
                }
    }
};

TEST(SeedRow, T15CentresAreUniformInXAndY) {
    const auto centers = region_centers(plane(101, 20'000));
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (const RegionCenter& c : centers) {
        ASSERT_TRUE(c.x_m > 0 && c.x_m < 1 && c.y_m > 0 && c.y_m < 1);
        sx += c.x_m, sy += c.y_m, sxx += c.x_m * c.x_m, sxy += c.x_m * c.y_m;
    }
    const auto n = static_cast<double>(centers.size());
    // Four standard errors of means of 20000 numbers: 0.29, 0.30 and 0.22 each / 141.
    EXPECT_NEAR(sx / n, 0.5, 0.0083);
    EXPECT_NEAR(sy / n, 0.5, 0.0083);
    EXPECT_NEAR(sxx / n, 1.0 / 3, 0.0085);
    EXPECT_NEAR(sxy / n, 0.25, 0.0063); // x tells nothing of y
}

TEST(SeedRow, T15TheHighestSphereIsTheVoronoiRegionAtEveryPoint) {
    for (const bool tileable : {false, true})
        for (const int n : {1, 2, 40}) {
            const RegionPlane p = plane(65, n, tileable);
            const RegionRelief convex = region_relief(p);
            const Image ids = region_ids(p);
            double farthest = 0;
            for (int y = 0; y < 65; ++y)
                for (int x = 0; x < 65; ++x) {
                    const Brute nearest(p, x, y);
                    farthest = std::max(farthest, nearest.r);
                    ASSERT_EQ(*ids.at(x, y), nearest.id) << x << ' ' << y;
                    ASSERT_EQ(*convex.ids.at(x, y), nearest.id);
                    const double r = convex.radius_m;
                    // Single precision, and the root of what rounding leaves at the rim.
                    ASSERT_NEAR(*convex.heights.at(x, y),
                                std::sqrt(std::max(0.0, r * r - nearest.r * nearest.r)), 1e-6);
                }
            EXPECT_DOUBLE_EQ(convex.radius_m, farthest); // they just cover the plane
        }
}

TEST(SeedRow, T15ConcaveIsTheNegative) {
    const RegionPlane p = plane(65, 30);
    const Image convex = region_relief(p).heights;
    const Image concave = region_relief(p, {.law = RegionLaw::concave}).heights;
    for (std::size_t i = 0; i < convex.pixels.size(); ++i)
        ASSERT_EQ(concave.pixels[i], -convex.pixels[i]);
}

TEST(RegionRelief, SmallSpheresLeaveThePlane) {
    const RegionPlane p = plane(201, 10);
    const RegionRelief pebbles = region_relief(p, {.radius_m = 0.1, .height_m = 0.02});
    double n_plane = 0;
    float highest = 0;
    for (const float h : pebbles.heights.pixels) {
        n_plane += h == 0;
        highest = std::max(highest, h);
        ASSERT_GE(h, 0);
    }
    // Ten discs of radius 0.1 cover at most 0.079 of a square of side 2.
    EXPECT_GT(n_plane / static_cast<double>(pebbles.heights.pixels.size()), 0.9);
    EXPECT_NEAR(highest, 0.02, 1e-4); // a lattice point lies within 0.7 pixels of a centre
}

TEST(SeedRow, T17SinusoidsEqualTheirFormula) {
    for (const bool tileable : {false, true})
        for (const int arms : {0, 3, -1}) {
            const RegionPlane p = plane(64, 12, tileable);
            const RegionSettings s{.law = RegionLaw::sinusoid,
                                   .height_m = 0.3,
                                   .wavelength_m = 0.07,
                                   .phase_turns = 0.1,
                                   .arms = arms};
            const Image f = region_relief(p, s).heights;
            for (int y = 0; y < 64; y += 3)
                for (int x = 0; x < 64; ++x) {
                    const Brute c(p, x, y);
                    const double theta = std::atan2(-c.dy, c.dx); // rows go down, angles up
                    const double expected =
                        0.3 * std::sin(2 * std::numbers::pi * (c.r / 0.07 + 0.1) + arms * theta);
                    ASSERT_NEAR(*f.at(x, y), expected, 1e-7); // single precision
                }
        }
}

TEST(SeedRow, T18ModifiedSinusoidsDieDownTowardsTheBorders) {
    const RegionPlane p = plane(129, 12);
    RegionSettings s{.law = RegionLaw::damped_wave, .height_m = 1, .wavelength_m = 0.3, .arms = 1};
    const Image damped = region_relief(p, s).heights;
    s.law = RegionLaw::sinusoid;
    const RegionRelief plain = region_relief(p, s);
    double step = 0, plain_step = 0; // summed over what crosses a border
    for (int y = 0; y < 129; ++y)
        for (int x = 0; x < 129; ++x) {
            const Brute c(p, x, y);
            ASSERT_NEAR(*damped.at(x, y),
                        *plain.heights.at(x, y) * (1 - c.r * c.r / (c.second * c.second)), 1e-6);
            if (x == 0 || *plain.ids.at(x, y) == *plain.ids.at(x - 1, y))
                continue;
            step += std::abs(double{*damped.at(x, y)} - *damped.at(x - 1, y));
            plain_step += std::abs(double{*plain.heights.at(x, y)} - *plain.heights.at(x - 1, y));
        }
    // Within half a pixel of a border r / r2 is 1 within a pixel over r, a tenth of it mostly.
    EXPECT_LT(step, 0.2 * plain_step);
}

/// How much two points a step apart being in one region goes with their being of one colour.
double association(const Image& a, const Image& b, int step) {
    double n = 0, na = 0, nb = 0, both = 0;
    for (int y = 0; y < a.height; ++y)
        for (int x = step; x < a.width; ++x) {
            const bool in_a = *a.at(x, y) == *a.at(x - step, y),
                       in_b = *b.at(x, y) == *b.at(x - step, y);
            n += 1, na += in_a, nb += in_b, both += in_a && in_b;
        }
    return (both / n - na * nb / (n * n)) /
           std::sqrt(na / n * (1 - na / n) * nb / n * (1 - nb / n));
}

TEST(SeedRow, T19TheRandIndexOfTwoSeedsIsThatOfChance) {
    // Points side by side are mostly in one region whatever the regions are, so the index is
    // adjusted at one distance: about that of neighbouring centres, where half of the pairs are.
    const Image a = region_ids(plane(401, 400, false, 1)),
                b = region_ids(plane(401, 400, false, 2));
    EXPECT_NEAR(association(a, b, 8), 0, 0.1); // 400 regions: about 2 / sqrt(400)
    EXPECT_NEAR(association(a, a, 8), 1, 1e-9);
}

TEST(RegionRelief, NamesWhatIsOutOfRange) {
    const auto refused = [](const std::string& part, const RegionPlane& p,
                            const RegionSettings& s = {}) {
        expect_error(Fault::bad_argument, part, [&] { region_relief(p, s); });
    };
    refused("size_px is 1", plane(1, 5));
    refused("n_regions is 0", plane(9, 0));
    refused("n_regions is 100001", plane(9, 100'001));
    refused("pixel_m is nan", {.pixel_m = NAN});
    refused("wavelength_m is 0", plane(9, 5), {.law = RegionLaw::sinusoid});
    refused("radius_m is -1", plane(9, 5), {.radius_m = -1});
    refused("arms is 65", plane(9, 5), {.arms = 65});
}

} // namespace
} // namespace taihu
