#include "mesh_out/render.h"

#include <array>
#include <atomic>
#include <functional>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "stats/core/error.h"

namespace taihu {
namespace {

using testing::HasSubstr;

/// A ball of n x 2n quads about `center`, each split in two triangles.
TriMesh ball(std::uint32_t n = 64, const Vec3& center = {}, double radius = 1) {
    TriMesh mesh;
    for (std::uint32_t i = 0; i <= n; ++i)
        for (std::uint32_t k = 0; k < 2 * n; ++k) {
            const double polar = std::numbers::pi * i / n, turn = std::numbers::pi * k / n;
            mesh.positions.push_back(center + radius * Vec3{std::sin(polar) * std::sin(turn),
                                                            std::cos(polar),
                                                            std::sin(polar) * std::cos(turn)});
            if (i == n)
                continue;
            const std::uint32_t next = (k + 1) % (2 * n), row = i * 2 * n, below = row + 2 * n;
            mesh.triangles.push_back({row + k, below + k, below + next});
            mesh.triangles.push_back({row + k, below + next, row + next});
        }
    return mesh;
}

/// A box without a lid inside a larger one: open ground at the height 0 round a square pit.
TriMesh pit(double half_width, double depth) {
    TriMesh mesh;
    const auto quad = [&](const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
        const auto n = static_cast<std::uint32_t>(mesh.positions.size());
        mesh.positions.insert(mesh.positions.end(), {a, b, c, d});
        mesh.triangles.insert(mesh.triangles.end(), {{n, n + 1, n + 2}, {n, n + 2, n + 3}});
    };
    const double h = half_width;
    const std::array<Vec3, 4> in = {Vec3{-h, 0, -h}, {-h, 0, h}, {h, 0, h}, {h, 0, -h}};
    for (std::size_t k = 0; k < 4; ++k) {
        const Vec3 a = in[k], b = in[(k + 1) % 4], down{0, -depth, 0};
        quad(a * (1 / h), b * (1 / h), b, a);
        quad(a, b, b + down, a + down);
    }
    quad(in[0] - Vec3{0, depth, 0}, in[1] - Vec3{0, depth, 0}, in[2] - Vec3{0, depth, 0},
         in[3] - Vec3{0, depth, 0});
    return mesh;
}

RenderSettings quick(int width = 96, int height = 128) {
    return {.width = width, .height = height, .samples = 2, .ao_rays = 2};
}

/// Mean of the green channel over a square of pixels about (x, y), given as shares of the picture.
double brightness(const Image& image, double x, double y, int radius = 3) {
    double sum = 0;
    const int cx = static_cast<int>(x * image.width), cy = static_cast<int>(y * image.height);
    for (int j = cy - radius; j <= cy + radius; ++j)
        for (int i = cx - radius; i <= cx + radius; ++i)
            sum += image.at(i, j)[1];
    return sum / ((2 * radius + 1) * (2 * radius + 1));
}

/// Whether something stands before the background, which the left border shows (ground off).
bool is_covered(const Image& image, int x, int y) {
    return !std::equal(image.at(x, y), image.at(x, y) + 3, image.at(0, y));
}

TEST(Render, ShowsABallAsTheDiscOfItsPerspective) {
    RenderSettings settings{.width = 300,
                            .height = 400,
                            .elevation_deg = 0,
                            .samples = 1,
                            .ao_rays = 1,
                            .ground = false};
    const TriMesh mesh = ball();
    const Image image = render(mesh, settings);
    std::size_t n = 0;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            n += is_covered(image, x, y);
    // The frame is as wide as the tangent cone of the ball and 6 % more, so the disc has a radius
    // of 150 / 1.06 pixels. One sample per pixel hits the disc or not: 900 pixels on the rim, half
    // of them by chance, make 0.03 % noise; the facets take 0.1 % away.
    const double expected = std::numbers::pi * std::pow(150 / 1.06, 2);
    EXPECT_NEAR(static_cast<double>(n), expected, 0.01 * expected);
    // The same ball at another size and place is the same picture, but for roundings at the rim.
    const Image far = render(ball(64, {1000, -500, 20}, 0.01), settings);
    EXPECT_NEAR(brightness(far, 0.4, 0.4), brightness(image, 0.4, 0.4), 0.01);
}

TEST(Render, BackgroundDependsOnTheRowAlone) {
    RenderSettings settings = quick();
    settings.ground = false;
    const Image image = render(ball(16), settings);
    const Image other = render(pit(0.2, 0.5), settings);
    for (int y = 0; y < image.height; ++y) {
        EXPECT_EQ(image.at(0, y)[1], image.at(image.width - 1, y)[1]);
        EXPECT_EQ(image.at(0, y)[1], other.at(0, y)[1]);
        EXPECT_GE(image.at(0, y)[1], 0.6f) << "bright, so that windows read as light";
        EXPECT_LE(image.at(0, y)[1], 0.8f);
        if (y > 0) {
            EXPECT_LT(image.at(0, y)[1], image.at(0, y - 1)[1]) << "darker towards the foot";
        }
    }
}

TEST(Render, HasTheWholeMeshInTheFrameAtEveryAngle) {
    TriMesh mesh = ball(24); // a lying, lopsided spindle
    for (Vec3& p : mesh.positions)
        p = {p.x * 3 + p.y * p.y, p.y * 0.5, p.z * 0.2};
    for (const double elevation : {-60.0, 8.0, 70.0})
        for (const double turn : {0.0, 45.0, 90.0, 213.0}) {
            RenderSettings settings = quick(64, 48);
            settings.turntable_deg = turn;
            settings.elevation_deg = elevation;
            settings.ground = false;
            const Image image = render(mesh, settings);
            // The background on the border is a straight line from top to bottom.
            const float top = image.at(0, 0)[0], foot = image.at(0, 47)[0];
            for (int y = 0; y < image.height; ++y)
                for (const int x : {0, 63})
                    EXPECT_NEAR(image.at(x, y)[0], top + (foot - top) * y / 47, 1e-5) << turn;
            for (int x = 0; x < image.width; ++x)
                for (const int y : {0, 47})
                    EXPECT_EQ(image.at(x, y)[0], image.at(0, y)[0]) << turn << ' ' << x;
        }
}

TEST(Render, LightsTheLeftMoreThanTheRight) {
    RenderSettings settings = quick();
    settings.samples = 8;
    const Image image = render(ball(), settings);
    // Facing the key, key : sky is 1.9 : 0.9 and the sky half hidden nowhere: three times the side
    // that has the sky alone. The patches are not at the extremes; twice is asked for.
    EXPECT_GT(brightness(image, 0.28, 0.38), 2 * brightness(image, 0.82, 0.5));
    EXPECT_GT(image.at(27, 48)[0], image.at(27, 48)[2]) << "the key is warm";
}

TEST(Render, TurnsTheMeshCounterClockwiseSeenFromAbove) {
    TriMesh mesh = ball(12);
    const TriMesh knob = ball(8, {2, 0, 0}, 0.3); // to the right of the ball; turned, behind it
    for (const Triangle& t : knob.triangles)
        mesh.triangles.push_back({t[0] + static_cast<std::uint32_t>(mesh.positions.size()),
                                  t[1] + static_cast<std::uint32_t>(mesh.positions.size()),
                                  t[2] + static_cast<std::uint32_t>(mesh.positions.size())});
    mesh.positions.insert(mesh.positions.end(), knob.positions.begin(), knob.positions.end());
    RenderSettings settings = quick(128, 128);
    settings.ground = false;
    settings.elevation_deg = 60;
    const auto row_of_knob = [&](double turn) { // mean row of the mesh's pixels
        settings.turntable_deg = turn;
        const Image image = render(mesh, settings);
        double sum = 0, n = 0;
        for (int y = 0; y < 128; ++y)
            for (int x = 0; x < 128; ++x)
                if (is_covered(image, x, y)) {
                    sum += y;
                    ++n;
                }
        return sum / n;
    };
    // The box's middle is between ball and knob: with the knob behind, the ball comes to the front.
    EXPECT_GT(row_of_knob(90), 64 + 5);
    EXPECT_LT(row_of_knob(-90), 64 - 5);
}

TEST(Render, DarkensTheBottomOfADeepPit) {
    RenderSettings settings = quick(96, 96);
    settings.samples = 16;
    settings.elevation_deg = 89;
    settings.turntable_deg = 0;
    const Image deep = render(pit(0.25, 2), settings);
    // Shadow alone leaves the sky's share, 0.9 * 0.98 / (0.9 * 0.98 + 1.9 * sin 42) = 0.41 of open
    // ground; the floor sees the sky through 1 / 8 of its depth, a solid angle of a few percent.
    EXPECT_LT(brightness(deep, 0.5, 0.5), 0.15 * brightness(deep, 0.25, 0.5));
    const Image shallow = render(pit(0.25, 0.02), settings);
    EXPECT_GT(brightness(shallow, 0.5, 0.5), 0.8 * brightness(shallow, 0.25, 0.5));
}

TEST(Render, CastsAShadowOnTheGroundToTheRight) {
    RenderSettings settings = quick();
    settings.samples = 8;
    const Image with = render(ball(), settings);
    settings.ground = false;
    const Image without = render(ball(), settings);
    const double right = brightness(with, 0.9, 0.8) / brightness(without, 0.9, 0.8);
    const double left = brightness(with, 0.06, 0.8) / brightness(without, 0.06, 0.8);
    EXPECT_LT(right, 0.7) << "no key light there";
    EXPECT_NEAR(left, 1, 0.15) << "open ground looks like the background, but for some occlusion";
}

TEST(Render, ShadesWithNormalsOnlyWhenAsked) {
    TriMesh mesh = ball(6);
    const Image faceted = render(mesh, quick());
    mesh.normals.assign(mesh.positions.begin(), mesh.positions.end());
    const Image smooth = render(mesh, quick());
    RenderSettings settings = quick();
    settings.smooth = false;
    EXPECT_EQ(render(mesh, settings).pixels, faceted.pixels);
    EXPECT_NE(smooth.pixels, faceted.pixels);
    for (Vec3& n : mesh.normals)
        n = -n; // normals that look inwards are taken on the side of the face
    EXPECT_EQ(render(mesh, quick()).pixels, smooth.pixels);
}

TEST(Render, TakesTheAlbedoOfAPlace) {
    // A ball off the origin, dark where it is above its middle and light below, seen turned.
    const Vec3 center{3, -2, 5};
    RenderSettings settings = quick();
    settings.turntable_deg = 130;
    settings.albedo_at = [&](const Vec3& p, const Vec3&) {
        EXPECT_NEAR(length(p - center), 2, 0.01); // on the ball; chords of 64 sides
        return p.y > center.y ? 0.0 : 0.5;
    };
    const Image image = render(ball(64, center, 2), settings);
    const int x = image.width / 2;
    EXPECT_EQ(image.at(x, image.height * 2 / 5)[0], 0);
    EXPECT_GT(image.at(x, image.height * 3 / 5)[0], 0.05);
}

TEST(Render, DrawsDarkEdgesOverLightFaces) {
    RenderSettings settings = quick(192, 192);
    settings.wireframe = true;
    settings.ground = false;
    const Image image = render(ball(6), settings);
    std::size_t n_dark = 0, n_light = 0;
    for (int y = 48; y < 144; ++y)
        for (int x = 48; x < 144; ++x) {
            n_dark += image.at(x, y)[1] < 0.25f;
            n_light += image.at(x, y)[1] > 0.4f;
        }
    EXPECT_GT(n_dark, 300u); // a dozen lines of some 70 pixels cross the middle
    EXPECT_GT(n_light, 6000u) << "lines are thin: most of the 9216 pixels are faces";
}

TEST(Render, HasTheSameBytesOnOneThreadAndTwo) {
    const TriMesh mesh = ball(40);
    const auto pixels_on = [&](std::size_t n_threads) {
        tbb::global_control limit(tbb::global_control::max_allowed_parallelism, n_threads);
        return render(mesh, quick()).pixels;
    };
    EXPECT_EQ(pixels_on(1), pixels_on(2));
    RenderSettings other = quick();
    other.seed = 1;
    EXPECT_NE(render(mesh, other).pixels, render(mesh, quick()).pixels) << "the seed matters";
}

TEST(RenderSheet, PutsLevelsOfOneSizeSideBySide) {
    const std::vector<TriMesh> levels = {ball(32), ball(8, {}, 0.5), ball(32)};
    const RenderSettings settings = quick(100, 120);
    const Image sheet = render_sheet(levels, settings);
    EXPECT_EQ(sheet.width, 300);
    EXPECT_EQ(sheet.height, 120);
    const Image alone = render(levels[0], settings);
    std::size_t n_inset_dark = 0;
    for (int y = 0; y < 120; ++y)
        for (int x = 0; x < 100; ++x) {
            EXPECT_TRUE(std::equal(sheet.at(x, y), sheet.at(x, y) + 3, sheet.at(200 + x, y)));
            const bool in_inset = x >= 55 && y >= 75; // 40 pixels and the frame
            if (in_inset) {
                n_inset_dark += sheet.at(x, y)[1] < 0.3f;
            } else {
                EXPECT_TRUE(std::equal(sheet.at(x, y), sheet.at(x, y) + 3, alone.at(x, y)));
            }
        }
    EXPECT_GT(n_inset_dark, 200u) << "the frame and the edges of the triangles";
    // One camera: at the same place the half-sized ball leaves background.
    EXPECT_NE(sheet.at(20, 60)[1], sheet.at(0, 60)[1]);
    EXPECT_EQ(sheet.at(120, 60)[1], sheet.at(0, 60)[1]);
}

void expect_refused(const std::string& part, const std::function<void()>& call) {
    try {
        call();
        FAIL() << "no exception, expected " << part;
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::bad_argument);
        EXPECT_THAT(e.what(), HasSubstr(part));
    }
}

TEST(Render, RefusesSettingsOutOfRangeByName) {
    const TriMesh mesh = ball(4);
    const auto refused = [&](const std::string& part, auto change) {
        RenderSettings settings;
        change(settings);
        expect_refused(part, [&] { render(mesh, settings); });
    };
    using S = RenderSettings;
    refused("width is 15", [](S& s) { s.width = 15; });
    refused("height is 8193", [](S& s) { s.height = 8193; });
    refused("turntable_deg is nan", [](S& s) { s.turntable_deg = std::nan(""); });
    refused("elevation_deg is 90", [](S& s) { s.elevation_deg = 90; });
    refused("samples is 0", [](S& s) { s.samples = 0; });
    refused("ao_rays is 257", [](S& s) { s.ao_rays = 257; });
    refused("albedo is 1.1", [](S& s) { s.albedo = 1.1; });
}

TEST(Render, RefusesMeshesThatCannotBeSeen) {
    expect_refused("no triangles", [] { render({}); });
    TriMesh mesh = ball(4);
    mesh.triangles[3][1] = 1000;
    expect_refused("triangles[3] has no finite position 1000", [&] { render(mesh); });
    mesh = ball(4);
    mesh.positions[0].x = std::numeric_limits<double>::infinity();
    expect_refused("triangles[0] has no finite position 0", [&] { render(mesh); });
    mesh = ball(4, {1, 1, 1}, 0);
    expect_refused("an extent of 0", [&] { render(mesh); });
    expect_refused("number of levels is 0", [] { render_sheet({}); });
}

TEST(Render, StopsWhenCancelled) {
    struct Impatient : Progress {
        void stage(std::string_view) override {}
        void fraction(double) override { seen = true; }
        bool cancelled() const override { return seen; }
        std::atomic<bool> seen = false;
    } impatient;
    try {
        render(ball(8), quick(), &impatient);
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::cancelled);
    }
}

} // namespace
} // namespace taihu
