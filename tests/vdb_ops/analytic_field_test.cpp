#include "vdb_ops/analytic_field.h"

#include <numbers>

#include <gtest/gtest.h>

#include "stats/core/rng.h"

namespace taihu {
namespace {

Vec3 random_point(std::uint64_t i) {
    const Rng rng{5, 9};
    return {4 * rng.uniform(i, 0) - 2, 4 * rng.uniform(i, 1) - 2, 4 * rng.uniform(i, 2) - 2};
}

TEST(EllipsoidDistance, OfEqualAxesIsThatOfASphere) {
    for (std::uint64_t i = 0; i < 1000; ++i) {
        const Vec3 p = random_point(i);
        EXPECT_NEAR(ellipsoid_distance(p, {0.7, 0.7, 0.7}), length(p) - 0.7, 1e-10);
    }
}

TEST(EllipsoidDistance, IsNoLargerThanToAnySurfacePointAndMatchesTheNearest) {
    const Vec3 a{0.3, 1.1, 0.6};
    for (std::uint64_t i = 0; i < 40; ++i) {
        const Vec3 p = i == 0 ? Vec3{} : i == 1 ? Vec3{0, 0.4, 0} : random_point(i) * 0.5;
        double nearest = 1e300;
        constexpr int kN = 500;
        for (int u = 0; u < kN; ++u)
            for (int v = 0; v < kN; ++v) {
                const double theta = std::numbers::pi * u / (kN - 1),
                             phi = 2 * std::numbers::pi * v / kN;
                nearest =
                    std::min(nearest, length(p - Vec3{a.x * std::sin(theta) * std::cos(phi),
                                                      a.y * std::cos(theta),
                                                      a.z * std::sin(theta) * std::sin(phi)}));
            }
        const double d = std::fabs(ellipsoid_distance(p, a));
        EXPECT_LE(d, nearest + 1e-9);
        // Surface samples are 0.007 apart; at a distance the nearest is second order in that.
        EXPECT_NEAR(d, nearest, 0.008) << i;
    }
}

TEST(AnalyticDistances, AreOneLipschitzAndZeroOnTheSurface) {
    for (std::uint64_t i = 0; i < 2000; ++i) {
        const Vec3 p = random_point(2 * i), q = p + (random_point(2 * i + 1) * 0.02);
        const double step = length(p - q) * (1 + 1e-9) + 1e-12;
        EXPECT_LE(std::fabs(box_distance(p, {1, 0.5, 0.7}) - box_distance(q, {1, 0.5, 0.7})), step);
        EXPECT_LE(std::fabs(cylinder_distance(p, 1, 0.5) - cylinder_distance(q, 1, 0.5)), step);
        EXPECT_LE(std::fabs(torus_distance(p, 1, 0.3) - torus_distance(q, 1, 0.3)), step);
        EXPECT_LE(
            std::fabs(ellipsoid_distance(p, {1, 0.5, 0.7}) - ellipsoid_distance(q, {1, 0.5, 0.7})),
            step);
    }
    EXPECT_EQ(box_distance({1, 0.2, 0}, {1, 0.5, 0.7}), 0);
    EXPECT_NEAR(box_distance({1.3, 0.9, 0}, {1, 0.5, 0.7}), 0.5, 1e-15);
    EXPECT_NEAR(cylinder_distance({0, 0.9, 1.3}, 1, 0.5), 0.5, 1e-15);
    EXPECT_NEAR(torus_distance({1.3, 0, 0}, 1, 0.3), 0, 1e-15);
}

} // namespace
} // namespace taihu
