#include "vdb_ops/band_detail.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/errors.h"
#include "tests/support/level_sets.h"

namespace taihu {
namespace {

TEST(Band, ABlurIsTheGaussianOfItsSigma) {
    // A wave along x: the blur multiplies it by exp(-(k sigma)^2 / 2).
    const double voxel = 0.1;
    for (const double sigma_vox : {0.4, 1.0, 2.5}) {
        auto grid = openvdb::FloatGrid::create(1.0f);
        grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
        const double k = 2 * 3.14159265358979 / 16; // one wave of 16 voxels
        auto values = grid->getAccessor();
        for (int x = -32; x < 32; ++x)
            for (int y = 0; y < 8; ++y)
                for (int z = 0; z < 8; ++z)
                    values.setValue({x, y, z}, static_cast<float>(std::cos(k * x)));
        const auto soft = blurred(*grid, sigma_vox * voxel, nullptr);
        // Six neighbours make a Gaussian only in the limit: 2 % of the exponent at this wave.
        const double expected = std::exp(-0.5 * std::pow(k * sigma_vox, 2));
        EXPECT_NEAR(static_cast<double>(soft->getConstAccessor().getValue({0, 4, 4})), expected,
                    0.02 * (1 - expected) + 1e-5)
            << sigma_vox;
    }
}

TEST(Band, SettledValuesAreALevelSetOnTheBandAskedFor) {
    const auto ball = ball_grid(0.5, 0.05);
    const auto wide = wide_band(*ball, 0.2, "test", nullptr);
    EXPECT_NEAR(static_cast<double>(wide->background()), 6 * 0.05, 1e-6);
    set_values(*wide, nullptr,
               [] { return [](const openvdb::Coord&, double d) { return 2 * d - 0.2; }; });
    const auto grown = settled(wide, 3, nullptr);
    EXPECT_NEAR(static_cast<double>(grown->background()), 3 * 0.05, 1e-6);
    // Twice the distance less 0.2 is 0 at a radius of 0.6; first order upwind, a tenth of a voxel.
    const BandReader reader(grown);
    for (const double r : {0.52, 0.6, 0.68})
        EXPECT_NEAR(reader.at({r, 0, 0}), r - 0.6, 0.005) << r;
    EXPECT_NEAR(reader.normal_at({0.6, 0, 0}).x, 1, 1e-3);
    EXPECT_LT(grown->getConstAccessor().getValue({0, 0, 0}), 0);
}

TEST(Band, RefusesASurfaceThatMovesTooFar) {
    expect_error(Fault::bad_argument,
                 "test: the surface would move by up to 100 m, 2000 voxels, at most 1000 are "
                 "handled; use less, or a larger voxel",
                 [] { wide_band(*ball_grid(0.5, 0.05), 100, "test", nullptr); });
}

} // namespace
} // namespace taihu
