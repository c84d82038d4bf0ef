#include "mesh_out/bump.h"

#include <cmath>
#include <numbers>

#include "stats/core/rng.h"
#include "tests/support/errors.h"
#include "vdb_ops/icosphere.h"

namespace taihu {
namespace {

Image random_image(int w, int h, int channels, std::uint64_t seed) {
    Image image(w, h, channels);
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
        image.pixels[i] = static_cast<float>(2 * Rng{seed, 1}.uniform(i) - 1);
    return image;
}

double mean(const Image& image) {
    double sum = 0;
    for (const float v : image.pixels)
        sum += v;
    return sum / static_cast<double>(image.pixels.size());
}

/// Sum of squares of what the offsets of `heights` miss.
double misfit(const Image& heights, const Image& offsets, MapBorder border) {
    const Image own = bump_offsets(heights, border);
    double sum = 0;
    for (int y = 0; y < own.height; ++y)
        for (int x = 0; x < own.width; ++x) {
            const bool u = border == MapBorder::wrap || x + 1 < own.width,
                       v = border == MapBorder::wrap || y > 0;
            sum += u ? std::pow(own.at(x, y)[0] - offsets.at(x, y)[0], 2) : 0;
            sum += v ? std::pow(own.at(x, y)[1] - offsets.at(x, y)[1], 2) : 0;
        }
    return sum;
}

TEST(SeedRow, D12OffsetsAreTheSignedDifferencesOfNeighbours) {
    Image plane(5, 4, 1);
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 5; ++x)
            *plane.at(x, y) = static_cast<float>(2 * x - 3 * y); // y runs down, v up
    const Image open = bump_offsets(plane, MapBorder::open);
    EXPECT_EQ(open.channels, 2);
    EXPECT_EQ(open.at(1, 2)[0], 2);
    EXPECT_EQ(open.at(1, 2)[1], 3);
    EXPECT_EQ(open.at(4, 2)[0], 0);
    EXPECT_EQ(open.at(1, 0)[1], 0);
    const Image wrapped = bump_offsets(plane, MapBorder::wrap);
    EXPECT_EQ(wrapped.at(4, 2)[0], -8);
    EXPECT_EQ(wrapped.at(1, 0)[1], -9);
}

TEST(SeedRow, D12HeightsSurviveTheRoundTrip) {
    for (const MapBorder border : {MapBorder::open, MapBorder::wrap})
        for (const auto& [w, h] : {std::pair{64, 48}, std::pair{1, 7}, std::pair{9, 1}}) {
            const Image heights = random_image(w, h, 1, 3);
            const Image back = bump_heights(bump_offsets(heights, border), border);
            const double level = mean(heights);
            for (std::size_t i = 0; i < heights.pixels.size(); ++i)
                // Offsets are floats: 6e-8 of 2 each, 112 of them on the longest way.
                ASSERT_NEAR(back.pixels[i], heights.pixels[i] - level, 2e-5);
        }
}

TEST(SeedRow, D12OffsetsOfAHeightFieldSurviveTheRoundTrip) {
    for (const MapBorder border : {MapBorder::open, MapBorder::wrap}) {
        const Image offsets = bump_offsets(random_image(40, 33, 1, 8), border);
        const Image back = bump_offsets(bump_heights(offsets, border), border);
        for (std::size_t i = 0; i < offsets.pixels.size(); ++i)
            ASSERT_NEAR(back.pixels[i], offsets.pixels[i], 1e-5);
    }
}

TEST(SeedRow, D11AStaticBumpMapFakesTheSurfaceOfAnyModel) {
    const Image heights = static_bump_map(128, 0.7, 4);
    EXPECT_EQ(heights.pixels, static_bump_map(128, 0.7, 4).pixels);
    EXPECT_NE(heights.pixels, static_bump_map(128, 0.7, 5).pixels);
    const Image offsets = bump_offsets(heights, MapBorder::wrap);
    // No seam: steps across the border are like those inside.
    double inside = 0, across = 0;
    for (int y = 0; y < 128; ++y) {
        for (int x = 0; x < 127; ++x)
            inside += std::fabs(offsets.at(x, y)[0]) / 127;
        across += std::fabs(offsets.at(127, y)[0]);
    }
    EXPECT_NEAR(across / inside, 1, 0.5); // of 128 steps that hang together over two or more

    TriMesh ball = icosphere(5);
    ball.normals = ball.positions;
    const Box frame = bounds(ball);
    const std::vector<Vec3> bumped = bumped_normals(ball, offsets, frame, 10, 2);
    double lean = 0;
    for (std::size_t i = 0; i < bumped.size(); ++i) {
        EXPECT_NEAR(length(bumped[i]), 1, 1e-12);
        lean += std::acos(std::min(1.0, dot(bumped[i], ball.normals[i]))) / bumped.size();
    }
    EXPECT_GT(lean, 0.05); // rad
    for (const auto& flat : {bumped_normals(ball, offsets, frame, 0, 2),
                             bumped_normals(ball, Image(4, 4, 2), frame, 10, 1)})
        for (std::size_t i = 0; i < flat.size(); ++i)
            EXPECT_LT(length(flat[i] - ball.normals[i]), 1e-12);
}

TEST(Bump, NormalsLeanAwayFromWhereTheMapRises) {
    // Heights that rise to the right and upwards: normals lean to the left and down.
    Image offsets(1, 1, 2);
    offsets.pixels = {0.5f, 0.25f};
    TriMesh front;
    front.positions = {{-0.1, -0.1, 1}, {0.1, -0.1, 1}, {0, 0.1, 1}};
    front.triangles = {{0, 1, 2}};
    front.normals.assign(3, {0, 0, 1});
    const Vec3 expected = normalized({-0.5, -0.25, 1});
    const Vec3 n = bumped_normals(front, offsets, {{-1, -1, -1}, {1, 1, 1}}, 1, 1)[2];
    EXPECT_LT(length(n - expected), 1e-12);
}

TEST(Bump, OffsetsOfNoHeightFieldGetTheNearestOne) {
    for (const MapBorder border : {MapBorder::open, MapBorder::wrap}) {
        const Image offsets = random_image(24, 20, 2, 5);
        Image heights = bump_heights(offsets, border);
        EXPECT_NEAR(mean(heights), 0, 1e-6);
        const double best = misfit(heights, offsets, border);
        for (std::uint64_t i = 0; i < 40; ++i) {
            const auto at = static_cast<std::size_t>(480 * Rng{9, 9}.uniform(i));
            for (const float step : {-0.01f, 0.01f}) {
                heights.pixels[at] += step;
                // Four differences, each by 0.01: 4e-4 more, were it not for rounding.
                EXPECT_GT(misfit(heights, offsets, border), best + 1e-4);
                heights.pixels[at] -= step;
            }
        }
    }
}

TEST(Bump, NormalsLeanAgainstTheSlope) {
    const Image flat = bump_normals(Image(3, 2, 2), 5);
    for (std::size_t i = 0; i < 6; ++i) {
        EXPECT_EQ(flat.pixels[3 * i], 0);
        EXPECT_EQ(flat.pixels[3 * i + 1], 0);
        EXPECT_EQ(flat.pixels[3 * i + 2], 1);
    }
    Image slope(1, 1, 2);
    slope.pixels = {0.75f, 0};
    const Image normal = bump_normals(slope, 1);
    EXPECT_FLOAT_EQ(normal.pixels[0], -0.6f);
    EXPECT_FLOAT_EQ(normal.pixels[2], 0.8f);
}

TEST(Bump, RefusesOtherMaps) {
    expect_error(Fault::bad_argument, "heights are 2 x 2 pixels of 3 channels, need 1",
                 [] { bump_offsets(Image(2, 2, 3), MapBorder::open); });
    expect_error(Fault::bad_argument, "need 2 and a pixel at least",
                 [] { bump_heights(Image(0, 4, 2), MapBorder::open); });
    Image hole(2, 1, 2);
    hole.pixels[3] = std::nanf("");
    expect_error(Fault::bad_argument, "value 3 is not finite",
                 [&] { bump_heights(hole, MapBorder::wrap); });
    expect_error(Fault::bad_argument, "side in 16..8192", [] { static_bump_map(4, 0.5, 0); });
    expect_error(Fault::bad_argument, "hurst 3", [] { static_bump_map(16, 3, 0); });
    expect_error(Fault::bad_argument, "has 0 normals", [] {
        bumped_normals(icosphere(0), Image(1, 1, 2), {{-1, -1, -1}, {1, 1, 1}}, 1, 1);
    });
    expect_error(Fault::bad_argument, "scale", [] { bump_normals(Image(1, 1, 2), std::nan("")); });
}

} // namespace
} // namespace taihu
