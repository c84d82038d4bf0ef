#include "vdb_ops/roughen.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "stats/core/image.h"
#include "tests/support/errors.h"
#include "tests/support/fields.h"
#include "tests/support/grids.h"
#include "tests/support/level_sets.h"
#include "vdb_ops/band_detail.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/roughness.h"
#include "vdb_ops/solids_field.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

/// A slab, its upper face at y = 0.
openvdb::FloatGrid::Ptr slab(double size, double thickness, double voxel) {
    const BoxSolid box{{size / 2, thickness / 2, size / 2}, 0};
    return rasterize(SolidsField(std::vector<AnalyticSolid>{
                         {box, Similarity::translation({0, -thickness / 2, 0})}}),
                     {voxel, {}, 3});
}

RoughenSettings fractal(double amplitude, double largest, double smallest, double hurst,
                        std::uint64_t seed = 1) {
    RoughenSettings s;
    s.amplitude_m = amplitude;
    s.noise = {largest, smallest, hurst, {0, 1, 0}, 1, seed};
    return s;
}

/// Height of the surface above (x, z): where the values pass through 0, from above.
double height_at(const BandReader& reader, double x, double z, double top, double step) {
    for (double y = top; y > -top; y -= step)
        if (const double below = reader.at({x, y - step, z}); below < 0) {
            const double above = reader.at({x, y, z});
            return y - step * above / (above - below);
        }
    return -top;
}

Image heights(const openvdb::FloatGrid::Ptr& solid, int n, double voxel, double top) {
    const BandReader reader(solid);
    Image image(n, n, 1);
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            *image.at(j, i) = static_cast<float>(
                height_at(reader, (i - n / 2) * voxel, (j - n / 2) * voxel, top, voxel));
    return image;
}

TEST(Roughen, SeedRowD20SolidNoiseGivesTheSurfaceItsHurstExponent) {
    constexpr double kVoxel = 0.01;
    constexpr int kPixels = 160;
    const auto base = slab(1.7, 0.2, kVoxel);
    for (const double hurst : {0.6, 0.9}) {
        const auto rough = roughen(*base, fractal(0.015, 0.64, 0.02, hurst));
        const auto tile = heights(rough, kPixels, kVoxel, 0.09);
        // 0.1 is the bar; distances are first order, which costs the finest waves a little.
        EXPECT_NEAR(fit_roughness(tile, kVoxel).hurst.value, hurst, 0.1);
        double sum = 0, squares = 0;
        for (const float h : tile.pixels)
            sum += static_cast<double>(h), squares += std::pow(static_cast<double>(h), 2);
        const double n = kPixels * kPixels, rms = std::sqrt(squares / n - std::pow(sum / n, 2));
        EXPECT_NEAR(rms, 0.015, 0.005); // few of the longest waves fit on it
    }
}

TEST(Roughen, SeedRowD19DisplacementLeavesATrueDistance) {
    const auto rough = roughen(*ball_grid(0.5, 0.02), fractal(0.02, 0.3, 0.05, 0.8));
    EXPECT_NEAR(static_cast<double>(rough->background()), 0.06, 1e-6);
    const auto values = rough->getConstAccessor();
    double worst = 0;
    for (auto v = rough->cbeginValueOn(); v; ++v)
        for (int axis = 0; axis < 3; ++axis) {
            openvdb::Coord next = v.getCoord();
            ++next[axis];
            worst = std::max(worst, static_cast<double>(std::fabs(values.getValue(next) - *v)));
        }
    EXPECT_LE(worst, 1.061 * 0.02); // what redistance() promises, and rounding
    EXPECT_NEAR(volume_m3(*rough), std::numbers::pi / 6, 0.1 * std::numbers::pi / 6);
    EXPECT_GT(std::fabs(volume_m3(*rough) - volume_m3(*ball_grid(0.5, 0.02))), 1e-5);
}

TEST(Roughen, IsTheSameRockOnAnotherLattice) {
    const RoughenSettings s = fractal(0.02, 0.4, 0.1, 0.8);
    const auto fine = roughen(*ball_grid(0.5, 0.0125), s),
               coarse = roughen(*ball_grid(0.5, 0.025), s);
    const BandReader a(fine), b(coarse);
    double worst = 0;
    for (std::uint64_t i = 0; i < 2000; ++i) {
        const Vec3 p = normalized(random_vec(i)) * 0.5;
        if (const double d = a.at(p); std::fabs(d) < 0.03)
            worst = std::max(worst, std::fabs(d - b.at(p)));
    }
    EXPECT_LT(worst, 0.5 * 0.025); // of a relief of 0.06 up and down
}

TEST(Roughen, IsTheSameOnAnyNumberOfThreadsAndFollowsItsSeed) {
    const auto ball = ball_grid(0.5, 0.025);
    const auto many = roughen(*ball, fractal(0.02, 0.3, 0.05, 0.8));
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(grid_hash(*roughen(*ball, fractal(0.02, 0.3, 0.05, 0.8))), grid_hash(*many));
    EXPECT_NE(volume_m3(*roughen(*ball, fractal(0.02, 0.3, 0.05, 0.8, 2))), volume_m3(*many));
}

TEST(Roughen, MovesWithTheSolidThatIsPutElsewhere) {
    const RoughenSettings s = fractal(0.02, 0.3, 0.1, 0.8);
    const Similarity at = Similarity::translation({3, 1, 2}) * Similarity::scaling(2);
    const auto put =
        rasterize(SolidsField(std::vector<AnalyticSolid>{{BallSolid{0.5}, at}}), {0.05, {}, 3});
    const BandReader here(roughen(*ball_grid(0.5, 0.025), s)), there(roughen(*put, s, at));
    for (std::uint64_t i = 0; i < 500; ++i) {
        const Vec3 p = normalized(random_vec(i)) * 0.5;
        if (const double d = here.at(p); std::fabs(d) < 0.04) {
            EXPECT_NEAR(there.at(at.point(p)), 2 * d, 0.01); // a fifth of a voxel
        }
    }
}

/// Root mean square of distances of a rough ball's surface to the ball, of those directions.
template <class Where>
double rms(const openvdb::FloatGrid::Ptr& rough, Where&& where) {
    const BandReader reader(rough);
    double sum = 0;
    int n = 0;
    for (std::uint64_t i = 0; i < 8000; ++i)
        if (const Vec3 u = normalized(random_vec(i)); where(u)) {
            sum += std::pow(reader.at(u * 0.5), 2);
            ++n;
        }
    return std::sqrt(sum / n);
}

TEST(Roughen, IsAsRoughAsTheShareOfWhereItFaces) {
    RoughenSettings s = fractal(0.012, 0.1, 0.1, 0.8);
    s.facing = {1, 0.5, 0};
    const auto rough = roughen(*ball_grid(0.5, 0.0125), s);
    const double up = rms(rough, [](const Vec3&u) { return u.y > 0.8; }),
                 side = rms(rough, [](const Vec3&u) { return std::fabs(u.y) < 0.2; }),
                 down = rms(rough, [](const Vec3&u) { return u.y < -0.9; });
    EXPECT_NEAR(up, 0.95 * 0.012, 0.003); // few waves; slopes make distances smaller
    EXPECT_NEAR(side / up, 0.53, 0.15);
    EXPECT_LT(down, 0.15 * up);
}

TEST(Roughen, IsFinerWhereTheHurstExponentIsLower) {
    RoughenSettings s = fractal(0.01, 0.4, 0.05, 0.4);
    const auto curvature = [](const openvdb::FloatGrid::Ptr& g, double sign) { // of distances, in y
        const BandReader reader(g);
        double sum = 0;
        for (std::uint64_t i = 0; i < 4000; ++i) {
            Vec3 u = normalized(random_vec(i));
            u.y = sign * std::fabs(u.y);
            const Vec3 t = normalized(cross(u, {1, 0, 0})) * 0.025;
            sum += std::pow(
                reader.at(u * 0.5 + t) + reader.at(u * 0.5 - t) - 2 * reader.at(u * 0.5), 2);
        }
        return std::sqrt(sum);
    };
    s.hurst_down = 1.2;
    const auto rough = roughen(*ball_grid(0.5, 0.0125), s);
    EXPECT_GT(curvature(rough, 1), 1.3 * curvature(rough, -1));
}

TEST(Roughen, SparesTheInsideOfHoles) {
    const Sphere hole{{0.4, 0, 0}, 0.2};
    const auto holed = holed_ball_grid(0.5, 0.02, std::span(&hole, 1));
    RoughenSettings s = fractal(0.01, 0.1, 0.1, 0.8);
    s.inside = InsideShare{0.25, 0};
    const BandReader reader(roughen(*holed, s));
    double in = 0, out = 0;
    for (std::uint64_t i = 0; i < 2000; ++i) {
        Vec3 u = normalized(random_vec(i));
        u.x = -std::fabs(u.x); // the far side of either
        in = std::max(in, u.x < -0.8 ? std::fabs(reader.at(hole.center + u * 0.2)) : 0);
        out = std::max(out, std::fabs(reader.at(u * 0.5)));
    }
    EXPECT_LT(in, 0.003); // a seventh of a voxel
    EXPECT_GT(out, 0.015);
}

TEST(Roughen, IsTamerTowardsTheTopWhenItsSharesSaySo) {
    RoughenSettings s = fractal(0.012, 0.1, 0.1, 0.8);
    s.height = HeightShares{-0.3, 0.3, 1, 0};
    const auto rough = roughen(*ball_grid(0.5, 0.0125), s);
    EXPECT_LT(rms(rough, [](const Vec3& u) { return u.y > 0.65; }), 0.001); // a tenth of a voxel
    EXPECT_GT(rms(rough, [](const Vec3& u) { return u.y < -0.65; }), 0.009);
}

TEST(Roughen, OneSidedItOnlyRemoves) {
    const auto ball = ball_grid(0.5, 0.02);
    RoughenSettings s = fractal(0.02, 0.2, 0.1, 0.8);
    s.removes = true;
    RoughenSettings furrows = s;
    furrows.relief = Relief::furrows;
    furrows.removes = false;
    for (const auto& settings : {s, furrows}) {
        const BandReader reader(roughen(*ball, settings));
        double least = 1, most = -1;
        for (std::uint64_t i = 0; i < 2000; ++i) {
            const double d = reader.at(normalized(random_vec(i)) * 0.5);
            least = std::min(least, d);
            most = std::max(most, d);
        }
        EXPECT_GT(least, -0.2 * 0.02); // a ball's own distances between voxels: a fifth of one
        EXPECT_GT(most, 0.01);
    }
}

TEST(Roughen, FurrowsRunAlongTheStretch) {
    RoughenSettings s = fractal(0.03, 0.1, 0.1, 0.8);
    s.relief = Relief::furrows;
    s.noise.stretch = 5;
    const BandReader reader(roughen(*slab(1, 1.2, 0.02), s));
    double along = 0, across = 0; // on a wall, x = 0.5
    for (std::uint64_t i = 0; i < 4000; ++i) {
        const Vec3 p{0.48, 0.3 * random_vec(i).y - 0.6, 0.3 * random_vec(i).z};
        along += std::fabs(reader.at(p + Vec3{0, 0.02, 0}) - reader.at(p));
        across += std::fabs(reader.at(p + Vec3{0, 0, 0.02}) - reader.at(p));
    }
    EXPECT_GT(across, 2 * along);
}

TEST(Roughen, FacetsArePlanesAndBedsAreSteps) {
    RoughenSettings s = fractal(0.05, 0.3, 0.3, 0.8);
    s.relief = Relief::facets;
    s.crack = 0;
    const auto tile = heights(roughen(*slab(1.4, 0.6, 0.02), s), 48, 0.02, 0.2);
    int flat = 0, n = 0;
    for (int i = 1; i < 47; ++i)
        for (int j = 1; j < 47; ++j, ++n) {
            const auto h = [&](int a, int b) {
                return static_cast<double>(tile.pixels[static_cast<std::size_t>(a * 48 + b)]);
            };
            flat += std::fabs(h(i - 1, j) + h(i + 1, j) - 2 * h(i, j)) < 0.001;
        }
    EXPECT_GT(1. * flat / n, 0.6); // cells of 15 voxels: the rest are their borders
    s.relief = Relief::beds;
    s.noise.largest_m = s.noise.smallest_m = 0.2;
    const BandReader wall(roughen(*slab(1, 1.6, 0.02), s));
    int level = 0;
    for (int i = 0; i < 300; ++i) {
        const Vec3 p{0.5, -0.3 - i * 0.003, 0.1};
        level += std::fabs(wall.at(p) - wall.at(p + Vec3{0, 0, 0.1})) < 0.004;
    }
    EXPECT_GT(level, 150); // most places on a level are alike; joints sway
}

TEST(Warp, MovesTheSurfaceByItsNoiseAndKeepsATrueDistance) {
    const auto ball = ball_grid(0.5, 0.02);
    const auto bent = warp(*ball, {{1, 0.5, 0.8, {0, 1, 0}, 1, 2}, 0.04});
    EXPECT_NEAR(static_cast<double>(bent->background()), 0.06, 1e-6);
    const BandReader reader(bent);
    double moved = 0;
    for (std::uint64_t i = 0; i < 1000; ++i)
        moved = std::max(moved, std::fabs(reader.at(normalized(random_vec(i)) * 0.5)));
    EXPECT_GT(moved, 0.03);
    EXPECT_EQ(grid_hash(*warp(*ball, {{1, 0.5, 0.8, {0, 1, 0}, 1, 2}, 0.04})), grid_hash(*bent));
    const BandReader still(warp(*ball, {{1, 0.5, 0.8, {0, 1, 0}, 1, 2}, 0}));
    for (std::uint64_t i = 0; i < 200; ++i)
        EXPECT_NEAR(still.at(normalized(random_vec(i)) * 0.5), 0, 0.001);
}

TEST(Roughen, RefusesWhatIsOutOfRange) {
    const auto ball = ball_grid(0.5, 0.05);
    const auto refused = [&](const RoughenSettings& s, const char* what) {
        expect_error(Fault::bad_argument, what, [&] { roughen(*ball, s); });
    };
    RoughenSettings s = fractal(-1, 0.3, 0.1, 0.8);
    refused(s, "roughen: amplitude_m is -1, must be 0..1e5");
    s = fractal(100, 0.3, 0.1, 0.8);
    refused(s, "roughen: the surface would move by up to 400 m");
    s = fractal(0.1, 0.3, 0.1, 3);
    refused(s, "roughen: hurst is 3");
    s = fractal(0.1, 0.3, 0.1, 0.8);
    s.inside = InsideShare{0, 1};
    refused(s, "roughen: inside.mouth_m is 0, must be > 0");
    s.inside.reset();
    s.height = HeightShares{1, 1, 0, 0};
    refused(s, "roughen: height.top_m is 1, must be above bottom_m");
    expect_error(Fault::bad_argument, "warp: amplitude_m is nan", [&] {
        warp(*ball, {{0.3, 0.1, 0.8, {0, 1, 0}, 1, 0}, std::nan("")});
    });
}

} // namespace
} // namespace taihu
