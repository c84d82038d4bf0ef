#include "vdb_ops/wrinkles_detail.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/dense.h"
#include "vdb_ops/analytic_field.h"

namespace taihu {
namespace {

constexpr double kPi = std::numbers::pi;
const Vec3 kCenter{31.6, 32.3, 31.8};

TEST(Wrinkles, OfABallAreThoseOfItsCurvature) {
    const DenseLattice lattice = cube_lattice(64);
    const double r = 20, sd = 2;
    const WrinkleMeasures m = measure_wrinkles(
        lattice, distances(lattice, [&](const Vec3& p) { return length(p - kCenter) - r; }), sd,
        1e-3, nullptr);
    // The mean of |x| under the kernel is larger by sd^2 / |x|, the Laplacian being 2 / |x|.
    const double shrunk = r - sd * sd / r;
    EXPECT_NEAR(m.area_ratio, std::pow(r / shrunk, 2), 0.005);
    EXPECT_NEAR(m.rms_samples, sd * sd / r, 0.03);
    EXPECT_NEAR(m.mean_curvature, 1 / shrunk, 0.01 / shrunk);
    EXPECT_EQ(m.concave_share, 0);
}

TEST(Wrinkles, OfARippledSlabAreItsRipples) {
    const DenseLattice lattice = cube_lattice(64);
    // A thick disc whose flat faces are waves of height a and length l: distances to first order.
    const double a = 0.8, l = 12, k = 2 * kPi / l;
    const auto rippled = [&](double height) {
        return [=](const Vec3& p) {
            const Vec3 d = p - kCenter;
            const double slope = std::hypot(1., height * k * std::cos(k * d.x));
            return std::max((std::abs(d.y) - 12 - height * std::sin(k * d.x)) / slope,
                            std::hypot(d.x, d.z) - 24);
        };
    };
    const auto measure = [&](double height) {
        return measure_wrinkles(lattice, distances(lattice, rippled(height)), 4, 1e-3, nullptr);
    };
    const WrinkleMeasures flat = measure(0), wavy = measure(a);
    // Faces are half of the area; a wave is longer by (a k / 2)^2, its rms a / sqrt(2). The kernel
    // leaves exp(-(sd k)^2 / 2) = 11 % of it.
    EXPECT_NEAR(wavy.area_ratio / flat.area_ratio, 1 + 0.5 * std::pow(a * k / 2, 2), 0.01);
    const double rms = std::sqrt(std::pow(wavy.rms_samples, 2) - std::pow(flat.rms_samples, 2));
    EXPECT_NEAR(rms, std::sqrt(0.5) * 0.89 * a / std::sqrt(2.), 0.1 * a);
}

TEST(Wrinkles, OfADentAreConcave) {
    const DenseLattice lattice = cube_lattice(64);
    const double r = 20;
    const WrinkleMeasures m = measure_wrinkles(
        lattice,
        distances(lattice,
                  [&](const Vec3& p) {
                      const Vec3 d = p - kCenter;
                      return std::max(length(d) - r, r - length(d - Vec3{0, 1.2 * r, 0}));
                  }),
        1.5, 1e-3, nullptr);
    // The cap of height 0.4 r that is cut away, and the dent of the same height that it leaves.
    // Its rim, a circle of radius 0.8 r, is bent outwards over two sd of the kernel.
    const double dent = 0.4 / 2, rim = 0.8 * 1.5 / r;
    EXPECT_NEAR(m.concave_share, dent - rim, 0.02);
}

} // namespace
} // namespace taihu
