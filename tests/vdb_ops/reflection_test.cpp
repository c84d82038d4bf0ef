#include "vdb_ops/reflection.h"

#include <numbers>

#include <gtest/gtest.h>

namespace taihu {
namespace {

const Vec3 kUp{0, 0, 1};

/// A unit vector at an angle from kUp.
Vec3 tilted(double degrees) {
    const double a = degrees * std::numbers::pi / 180;
    return {std::sin(a), 0, std::cos(a)};
}

TEST(SeedRow, T02TheIntensityIsTheSumOfItsTerms) {
    for (const double angle : {0.0, 30.0, 70.0, 120.0}) {
        const Vec3 light = tilted(angle), viewer = tilted(-20);
        EXPECT_DOUBLE_EQ(intensity({0.1, 1, 1, 7}, kUp, light, viewer),
                         diffuse_intensity(kUp, light) + specular_intensity(kUp, light, viewer, 7) +
                             0.1);
    }
    // Straight above both are 1.
    EXPECT_DOUBLE_EQ(intensity({0.25, 1, 1, 7}, kUp, kUp, kUp), 2.25);
}

TEST(SeedRow, T03DiffuseLightIsTheCosine) {
    EXPECT_DOUBLE_EQ(diffuse_intensity(kUp, tilted(0)), 1);
    EXPECT_DOUBLE_EQ(diffuse_intensity(kUp, tilted(45)), std::sqrt(0.5));
    EXPECT_NEAR(diffuse_intensity(kUp, tilted(90)), 0, 1e-16); // pi / 2 is rounded
    EXPECT_EQ(diffuse_intensity(kUp, tilted(91)), 0);
    EXPECT_EQ(diffuse_intensity(kUp, tilted(180)), 0);
}

TEST(SeedRow, T04TheHighlightIsAPowerOfTheCosineToTheBisector) {
    // Light 60 degrees to one side, viewer 0: the bisector is 30 degrees away.
    for (const double n : {0.0, 1.0, 5.0, 20.5})
        EXPECT_NEAR(specular_intensity(kUp, tilted(60), kUp, n), std::pow(std::sqrt(0.75), n),
                    1e-14);
    EXPECT_DOUBLE_EQ(specular_intensity(kUp, tilted(50), tilted(-50), 300), 1); // the mirror
    EXPECT_EQ(specular_intensity(kUp, tilted(120), tilted(100), 3), 0);         // H N < 0
    EXPECT_GT(specular_intensity(kUp, tilted(120), tilted(40), 3), 0);          // though N L < 0
}

TEST(SeedRow, T05AmbientLightIsConstant) {
    for (const double angle : {0.0, 45.0, 135.0, 180.0})
        EXPECT_EQ(intensity({0.3, 0, 0, 1}, tilted(angle), kUp, kUp), 0.3);
}

TEST(Reflection, TheLightComesFromWhereItSays) {
    const Vec3 right = DistantLight{0, 30}.direction(), top = DistantLight{90, 30}.direction();
    EXPECT_NEAR(right.x, std::sqrt(0.75), 1e-15);
    EXPECT_NEAR(right.y, 0, 1e-15);
    EXPECT_NEAR(top.y, std::sqrt(0.75), 1e-15);
    EXPECT_NEAR(top.z, 0.5, 1e-15);
}

TEST(Reflection, NormalsOfAPlaneAreExactAtItsEdgesToo) {
    Image plane(5, 4, 1); // rises by 0.5 to the right, by 0.25 a pixel towards the top
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 5; ++x)
            *plane.at(x, y) = 0.5f * static_cast<float>(x) - 0.25f * static_cast<float>(y);
    const Vec3 expected = normalized({-0.5 / 2, -0.25 / 2, 1});
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 5; ++x)
            EXPECT_LT(length(height_normal(plane, 2, false, x, y) - expected), 1e-15);
    // Across the edges of a tile the plane falls back.
    EXPECT_GT(height_normal(plane, 2, true, 0, 1).x, 0);
}

TEST(Reflection, ATileIsLitPointByPoint) {
    Image ridge(32, 8, 1); // a roof: its left side faces the left
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 32; ++x)
            *ridge.at(x, y) = static_cast<float>(16 - std::abs(x - 16));
    const Reflection matt{0.1, 1, 0, 1};
    const Image lit = shaded_heights(ridge, 1, false, matt, {180, 45}); // from the left
    EXPECT_NEAR(*lit.at(5, 3), 1.1, 1e-6);                              // single precision
    EXPECT_NEAR(*lit.at(25, 3), 0.1, 1e-6); // in its own shadow, 90 degrees away
    EXPECT_NEAR(*lit.at(16, 3), 0.1 + std::sqrt(0.5), 1e-6);
}

} // namespace
} // namespace taihu
