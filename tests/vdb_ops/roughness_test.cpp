#include "vdb_ops/roughness.h"

#include <cmath>

#include "stats/core/rng.h"
#include "tests/support/errors.h"
#include "vdb_ops/midpoint_relief.h"
#include "vdb_ops/reflection.h"

namespace taihu {
namespace {

Image rough_tile(double hurst, std::uint64_t seed, int levels = 9, double amplitude_m = 1) {
    MidpointSettings s;
    s.hurst = hurst;
    s.seed = seed;
    s.levels = levels;
    s.amplitude_m = amplitude_m;
    return midpoint_heights(s);
}

TEST(SeedRow, T08TheVariogramOfALargeTileRisesByTwoH) {
    for (const double h : {0.3, 0.5, 0.7, 0.9}) {
        const Roughness r = fit_roughness(rough_tile(h, 3, 10), 1e-3); // 1025^2
        // The law is not exact near the pixel: up to 0.03 off in the mean, 0.025 from seed to seed.
        EXPECT_NEAR(r.hurst.value, h, 0.08) << h;
        EXPECT_EQ(r.first_lag_px, 8);
        EXPECT_EQ(r.last_lag_px, 128);
    }
}

TEST(Roughness, IntervalsHoldTheTruthMostly) {
    for (const double h : {0.3, 0.6, 0.8}) {
        int n_held = 0;
        double widest = 0;
        for (std::uint64_t seed = 0; seed < 20; ++seed) {
            const Bracketed b = fit_roughness(rough_tile(h, seed, 8), 1).hurst;
            n_held += b.lo <= h && h <= b.hi;
            widest = std::max(widest, b.hi - b.lo);
        }
        EXPECT_GE(n_held, 17) << h; // of a 95 % interval, 16 or less of 20 have a chance of 0.3 %
        EXPECT_LT(widest, 0.3);
    }
}

TEST(Roughness, IsProportionalToTheHeight) {
    const Roughness low = fit_roughness(rough_tile(0.5, 1, 7, 0.01), 1),
                    high = fit_roughness(rough_tile(0.5, 1, 7, 3), 1);
    EXPECT_NEAR(low.hurst.value, high.hurst.value, 1e-5); // heights are in single precision
    EXPECT_NEAR(high.departure_m.value / low.departure_m.value, 300, 0.01);
    EXPECT_NEAR(low.departure_at_m(16) / low.departure_m.value, std::pow(16, low.hurst.value),
                1e-9);
}

TEST(Roughness, DoesNotSeeASlope) {
    const Image level = rough_tile(0.6, 2, 8);
    Image slope = level;
    for (int y = 0; y < slope.height; ++y)
        for (int x = 0; x < slope.width; ++x)
            *slope.at(x, y) += 0.01f * static_cast<float>(x - 2 * y);
    EXPECT_NEAR(fit_roughness(slope, 1).hurst.value, fit_roughness(level, 1).hurst.value,
                1e-4); // single precision
}

TEST(Roughness, OfWhiteNoiseIsZero) {
    Image noise(256, 256, 1);
    const Rng rng{7, 1};
    for (std::size_t i = 0; i < noise.pixels.size(); ++i)
        noise.pixels[i] = static_cast<float>(rng.uniform(i));
    const Roughness r = fit_roughness(noise, 1);
    EXPECT_NEAR(r.hurst.value, 0, 0.02); // about 6e4 departures at each lag
    EXPECT_NEAR(r.departure_m.value, std::sqrt(1.5 / 12), 0.01);
}

/// A tile as a camera sees it: matt, some slope, lit from somewhere, not too dark nor bright.
Image photo_of(Image& tile, double pixel_m, double rms_slope, const DistantLight& light,
               double ambient = 0) {
    const double k = rms_slope * pixel_m / fit_roughness(tile, pixel_m).departure_m.value;
    for (float& h : tile.pixels)
        h *= static_cast<float>(k);
    return shaded_heights(tile, pixel_m, false, {ambient, 0.6, 0, 1}, light);
}

TEST(SeedRow, E74HAndSizeComeFromLightAndShade) {
    constexpr double kPixel = 2e-4;
    for (const double h : {0.3, 0.5, 0.7, 0.85}) {
        int n = 0, n_held = 0, n_size_held = 0;
        double mean = 0, size = 0;
        for (std::uint64_t seed = 0; seed < 8; ++seed, ++n) {
            Image tile = rough_tile(h, seed);
            const DistantLight light{seed % 2 == 0 ? 150.0 : 20.0, 50};
            const Image photo = photo_of(tile, kPixel, 0.15, light);
            const PhotoRoughness seen = photo_roughness(photo, {kPixel, light.elevation_deg});
            const double truth = fit_roughness(tile, kPixel).departure_at_m(16);
            const double ratio = seen.roughness.departure_at_m(16) / truth;
            const Bracketed& b = seen.roughness.hurst;
            n_held += b.lo <= h && h <= b.hi;
            n_size_held += std::abs(ratio - 1) < 0.2;
            mean += b.value / 8;
            size += ratio / 8;
            EXPECT_TRUE(seen.doubts.empty());
            EXPECT_NEAR(std::remainder(seen.azimuth_deg - light.azimuth_deg, 180), 0, 15);
        }
        EXPECT_NEAR(mean, h, 0.1) << h; // blur makes a surface look smoother, most at a small H
        EXPECT_GE(n_held, n - 1) << h;
        EXPECT_NEAR(size, 1, 0.15) << h;
        EXPECT_GE(n_size_held, n - 1) << h;
    }
}

TEST(PhotoRoughness, TakesAzimuthAmbientLightAndGradientsOff) {
    Image tile = rough_tile(0.6, 4);
    const DistantLight light{180, 45};
    Image photo = photo_of(tile, 1e-3, 0.1, light);
    const PhotoRoughness plain = photo_roughness(photo, {1e-3, 45, 0.0});
    // Ambient light of a half of the whole, told.
    double mean = 0;
    for (const float b : photo.pixels)
        mean += double{b} / static_cast<double>(photo.pixels.size());
    Image hazy = photo;
    for (float& b : hazy.pixels)
        b = 0.5f * (b + static_cast<float>(mean));
    const PhotoRoughness told = photo_roughness(hazy, {1e-3, 45, 0.0, 0.5});
    EXPECT_NEAR(told.roughness.departure_m.value / plain.roughness.departure_m.value, 1, 1e-4);
    // A lamp that is brighter on one side.
    for (int y = 0; y < photo.height; ++y)
        for (int x = 0; x < photo.width; ++x)
            *photo.at(x, y) *= 0.8f + 0.4f * static_cast<float>(x) / 512;
    const PhotoRoughness uneven = photo_roughness(photo, {1e-3, 45, 0.0});
    EXPECT_NEAR(uneven.roughness.hurst.value, plain.roughness.hurst.value, 0.02);
    // The same lamp from elsewhere in the plane: size by the tangent of its elevation.
    const PhotoRoughness low = photo_roughness(hazy, {1e-3, 20, 0.0, 0.5});
    EXPECT_NEAR(low.roughness.departure_m.value / told.roughness.departure_m.value,
                std::tan(20 * M_PI / 180), 1e-6);
}

TEST(PhotoRoughness, DoubtsWhatIsNotLitFromTheSide) {
    Image speckles(200, 150, 3); // colour without light and shade
    const Rng rng{1, 2};
    for (std::size_t i = 0; i < speckles.pixels.size(); ++i)
        speckles.pixels[i] = static_cast<float>(0.3 + 0.3 * rng.uniform(i));
    const PhotoRoughness seen = photo_roughness(speckles);
    ASSERT_FALSE(seen.doubts.empty());
    EXPECT_THAT(seen.doubts.front(), testing::HasSubstr("show no direction"));
    for (std::size_t i = 0; i < speckles.pixels.size() / 10; ++i)
        speckles.pixels[i] = 1;
    EXPECT_THAT(photo_roughness(speckles).doubts,
                testing::Contains(testing::HasSubstr("10 % of the pixels are black or white")));
}

TEST(Roughness, NamesWhatIsWrong) {
    expect_error(Fault::bad_argument, "31 x 40 points of 1 channels, must be 32 x 32",
                 [] { fit_roughness(Image(31, 40, 1), 1); });
    expect_error(Fault::bad_argument, "scale_px is 65, must be 32 to the shorter side",
                 [] { fit_roughness(Image(64, 80, 1), 1, 65); });
    expect_error(Fault::numeric, "nothing rough", [] { fit_roughness(Image(40, 40, 1), 1); });
    expect_error(Fault::bad_argument, "90 x 200 pixels, must be 96 x 96",
                 [] { photo_roughness(Image(90, 200, 1)); });
    expect_error(Fault::numeric, "100 % of the pixels are black or white",
                 [] { photo_roughness(Image(128, 128, 3)); });
    Image even(128, 128, 1);
    even.pixels.assign(even.pixels.size(), 0.5f);
    expect_error(Fault::numeric, "nothing rough", [&] { photo_roughness(even); });
    expect_error(Fault::bad_argument, "elevation_deg is 90, must be 5..85", [&] {
        photo_roughness(even, {1, 90});
    });
    expect_error(Fault::bad_argument, "patch 100,0,29,10 is not inside of the photo of 128 x 128",
                 [&] { image_part(even, 100, 0, 29, 10); });
    EXPECT_EQ(image_part(even, 100, 0, 28, 128).pixels.size(), 28u * 128);
}

} // namespace
} // namespace taihu
