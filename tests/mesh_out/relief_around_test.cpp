#include "vdb_ops/relief_around.h"

#include <cmath>
#include <memory>
#include <numbers>

#include <gtest/gtest.h>

#include "mesh_out/render.h"
#include "tests/support/errors.h"
#include "vdb_ops/relief.h"
#include "vdb_ops/shapes.h"

namespace taihu {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr ReliefMap kMaps[] = {ReliefMap::planar, ReliefMap::sphere, ReliefMap::cube,
                               ReliefMap::cylinder, ReliefMap::triplanar};
const Box kFrame{{-1, -1, -1}, {1, 1, 1}};

/// height(column, row) of a tile.
template <class Fn>
Image tile(int side, Fn&& height) {
    Image image(side, side, 1);
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x)
            *image.at(x, y) = static_cast<float>(height(x, y));
    return image;
}

Image rough_tile(int side = 65) {
    return make_relief({.size_px = side, .pixel_m = 0.02, .amplitude_m = 0.1, .seed = 4}).heights;
}

/// Points all over the unit ball, with their normals.
std::vector<Vec3> directions() {
    std::vector<Vec3> all;
    for (int i = 0; i < 200; ++i) {
        const double y = -0.98 + 1.96 * (i + 0.5) / 200, r = std::sqrt(1 - y * y), a = 2.4 * i;
        all.push_back({r * std::cos(a), y, r * std::sin(a)});
    }
    return all;
}

TEST(SeedRow, T10AFlatTileLeavesNormalsUnchangedInEveryMapping) {
    const Image flat = tile(9, [](int, int) { return 0.25; });
    for (const ReliefMap map : kMaps) {
        const ReliefAround around(flat, 0.1, false, map, kFrame);
        for (const Vec3& n : directions()) {
            EXPECT_NEAR(around.height_m(n, n), 0.25, 1e-6); // heights are floats
            EXPECT_LT(length(around.bumped(n, n) - n), 1e-12);
        }
    }
}

TEST(SeedRow, T10TheNormalIsThatOfTheDisplacedSurface) {
    // The finite surface p + h n, by differences along two directions in it.
    const Image smooth = tile(64, [](int x, int y) {
        return 0.01 * std::sin(2 * kPi * x / 64) * std::cos(2 * kPi * y / 64);
    });
    for (const ReliefMap map : {ReliefMap::sphere, ReliefMap::cylinder}) {
        const ReliefAround around(smooth, 0.03, true, map, kFrame);
        for (const Vec3& n : directions()) {
            if (std::abs(n.y) > 0.9)
                continue; // meridians meet
            const Vec3 axis = map == ReliefMap::sphere ? n : normalized({n.x, 0, n.z});
            const Vec3 p = map == ReliefMap::sphere ? n : Vec3{axis.x, n.y, axis.z};
            const auto moved = [&](const Vec3& q) {
                const Vec3 m =
                    map == ReliefMap::sphere ? normalized(q) : normalized(Vec3{q.x, 0, q.z});
                const Vec3 on = map == ReliefMap::sphere ? m : Vec3{m.x, q.y, m.z};
                return on + m * around.height_m(on, m);
            };
            const Vec3 east = normalized(cross({0, 1, 0}, axis)), north = cross(axis, east);
            constexpr double kStep = 0.02; // about a point of the tile
            const Vec3 du = moved(p + east * kStep) - moved(p - east * kStep),
                       dv = moved(p + north * kStep) - moved(p - north * kStep);
            // Blinn leaves out h times the curvature: 1 % here; differences of a bilinear tile.
            EXPECT_GT(dot(normalized(cross(du, dv)), around.bumped(p, axis)), std::cos(0.02));
        }
    }
}

TEST(ReliefAround, GoesRoundWithoutAJump) {
    for (const bool tileable : {false, true})
        for (const ReliefMap map : {ReliefMap::sphere, ReliefMap::cylinder}) {
            const Image heights = tileable ? make_relief({.size_px = 64,
                                                          .pixel_m = 0.02,
                                                          .amplitude_m = 0.1,
                                                          .tileable = true,
                                                          .seed = 4})
                                                 .heights
                                           : rough_tile();
            const ReliefAround around(heights, 0.02, tileable, map, kFrame);
            for (double y = -0.7; y < 0.7; y += 0.1) {
                const double r = std::sqrt(1 - y * y), e = 1e-9;
                const Vec3 a{r * std::sin(e), y, -r}, b{-r * std::sin(e), y, -r};
                EXPECT_NEAR(around.height_m(a, a), around.height_m(b, b), 1e-6);
            }
        }
}

TEST(ReliefAround, TriplanarHasNoSeams) {
    const ReliefAround around(rough_tile(), 0.02, false, ReliefMap::triplanar, kFrame);
    const auto all = directions();
    for (const Vec3& n : all)
        for (const Vec3& by : {Vec3{1e-7, 0, 0}, Vec3{0, 1e-7, 0}, Vec3{0, 0, 1e-7}}) {
            const Vec3 m = normalized(n + by);
            // Slopes of the tile are below 5, and weights change by less than 10 a unit.
            EXPECT_NEAR(around.height_m(n, n), around.height_m(m, m), 1e-5);
        }
}

TEST(ReliefAround, ATileKeepsItsSizeOnACube) {
    // A ramp along u, 1 m per metre: its middle is at the middle of each side.
    const Image ramp = tile(201, [](int x, int) { return 0.01 * (x - 100); });
    const ReliefAround around(ramp, 0.01, false, ReliefMap::cube, kFrame);
    EXPECT_NEAR(around.height_m({0.3, 0.2, 1}, {0, 0, 1}), 0.3, 1e-6);
    EXPECT_NEAR(around.height_m({0.3, 0.2, -1}, {0, 0, -1}), -0.3, 1e-6);
    EXPECT_NEAR(around.height_m({1, 0.2, 0.3}, {1, 0, 0}), -0.3, 1e-6);
    EXPECT_NEAR(around.height_m({0.3, 1, 0.2}, {0, 1, 0}), 0.3, 1e-6);
    const Vec3 n = around.bumped({0.3, 0.2, 1}, {0, 0, 1});
    EXPECT_NEAR(length(n - normalized({-1, 0, 1})), 0, 1e-5); // floats
}

TEST(ReliefAround, PlanarGoesStraightThrough) {
    const Image ramp = tile(201, [](int x, int) { return 0.01 * (x - 100); });
    const ReliefAround around(ramp, 0.01, false, ReliefMap::planar, kFrame);
    for (const Vec3& n : directions()) // the height is x wherever it faces
        EXPECT_NEAR(around.height_m({0.3, n.y, n.z}, n), 0.3, 1e-6);
}

TEST(SeedRow, T16BumpsLeaveTheSilhouetteAndDisplacementDoesNot) {
    TriMesh ball = shape_mesh({.kind = ShapeKind::sphere, .size_m = {2, 2, 2}, .subdivisions = 5});
    ball.normals.clear();
    for (const Vec3& p : ball.positions)
        ball.normals.push_back(normalized(p));
    const auto around =
        std::make_shared<ReliefAround>(rough_tile(), 0.02, false, ReliefMap::sphere, bounds(ball));
    RenderSettings look{.width = 96, .height = 96, .samples = 4, .ground = false};
    const Image plain = render(ball, look);
    look.normal_at = [&](const Vec3& p, const Vec3& n) { return around->bumped(p, n); };
    const Image bumped = render(ball, look);
    const TriMesh rough = around->displaced(ball);
    // Where the backdrop is seen it stays the same.
    std::size_t n_inside = 0, n_outside = 0;
    for (int y = 0; y < 96; ++y)
        for (int x = 0; x < 96; ++x) {
            const double dx = x - 47.5, dy = y - 47.5, r = std::sqrt(dx * dx + dy * dy);
            const bool same = std::equal(plain.at(x, y), plain.at(x, y) + 3, bumped.at(x, y));
            if (r > 46) {
                EXPECT_TRUE(same);
                ++n_outside;
            } else if (r < 40)
                n_inside += !same;
        }
    EXPECT_GT(n_outside, 1000u);
    EXPECT_GT(n_inside, 3000u);
    double most = 0, least = 9;
    for (const Vec3& p : rough.positions) {
        most = std::max(most, length(p));
        least = std::min(least, length(p));
    }
    EXPECT_GT(most - least, 0.05); // the tile's heights differ by more
}

TEST(SeedRow, T02ToT05PlainLightIsEquation1InEveryPixel) {
    // A wall that fills the frame's middle: one normal, one light, nearly one viewer.
    TriMesh wall;
    wall.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    wall.triangles = {{0, 1, 2}, {0, 2, 3}};
    PlainLight light;
    light.reflection = {.ambient = 0.1, .diffuse = 0.6, .specular = 0, .exponent = 20};
    light.color = {0.5, 0.25, 1};
    light.light = {.azimuth_deg = 90, .elevation_deg = 30}; // from above: N L = sin 30
    RenderSettings look{.width = 64, .height = 64, .elevation_deg = 0, .samples = 1};
    look.plain = light;
    const Image image = render(wall, look);
    const float* middle = image.at(32, 32);
    for (int k = 0; k < 3; ++k) // Eq. 1: 0.6 * 0.5 + 0.1
        EXPECT_NEAR(middle[k], light.color[k] * 0.4, 1e-6);
}

TEST(ReliefAround, RefusesWhatIsNoTile) {
    const auto refused = [](Image heights, double pixel_m, const Box& frame, const char* why) {
        expect_error(Fault::bad_argument, why, [&] {
            ReliefAround(std::move(heights), pixel_m, false, ReliefMap::sphere, frame);
        });
    };
    refused(Image(8, 8, 3), 0.1, kFrame, "3 channels");
    refused(Image(1, 8, 1), 0.1, kFrame, "1 x 8");
    refused(Image(8, 8, 1), 0, kFrame, "must be finite and > 0");
    refused(Image(8, 8, 1), 1e-13, kFrame, "too many for an object of 2 m; give the tile's side");
    refused(tile(4, [](int, int) { return NAN; }), 1, kFrame, "not finite");
    refused(Image(8, 8, 1), 1, Box{{1, 1, 1}, {1, 1, 1}}, "no extent");
}

} // namespace
} // namespace taihu
