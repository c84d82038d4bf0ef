#include "vdb_ops/views_detail.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/dense.h"
#include "vdb_ops/analytic_field.h"

namespace taihu {
namespace {

constexpr double kPi = std::numbers::pi;
const Vec3 kCenter{31.7, 32.2, 31.9};

/// A cube of side 40 with a round hole of radius r along x.
double drilled(const Vec3& p, double r) {
    const Vec3 d = p - kCenter;
    return std::max(box_distance(d, {20, 20, 20}), r - std::hypot(d.y, d.z));
}

TEST(Views, ThroughARoundHoleTheShareIsKnown) {
    const double r = 8, side = 40;
    const DenseLattice lattice = cube_lattice(64);
    const ViewMeasures m = measure_views(
        lattice, distances(lattice, [&](const Vec3& p) { return drilled(p, r); }), 32, 1, nullptr);
    // At an angle a, two circles side * tan(a) apart: what they share is open, seen aslant.
    double share = 0;
    int n_open = 0;
    for (int k = -15; k <= 16; ++k) {
        const double a = kPi * k / 32, apart = side * std::abs(std::tan(a)) / (2 * r);
        if (apart >= 1)
            continue;
        const double lens = 2 * r * r * (std::acos(apart) - apart * std::sqrt(1 - apart * apart));
        share += lens * std::cos(a) / (side * side * (std::cos(a) + std::abs(std::sin(a)))) / 32;
        ++n_open;
    }
    EXPECT_EQ(n_open, 7);
    // Pixels are counted whole: 0.3 sqrt(perimeter) of 200 a window, and less by chance over seven.
    EXPECT_NEAR(m.open_share, share, 0.03 * share);
    EXPECT_EQ(m.share_with_window, 7 / 32.);
    EXPECT_EQ(m.windows_per_view, 7 / 32.);
    EXPECT_NEAR(m.widest_m, 2 * r, 0.2); // samples of linear interpolation between straight walls
}

TEST(Views, SmallWindowsAreNotCounted) {
    const DenseLattice lattice = cube_lattice(64);
    const auto d = distances(lattice, [&](const Vec3& p) { return drilled(p, 3); });
    EXPECT_EQ(measure_views(lattice, d, 1, 5.5, nullptr).windows_per_view, 1); // 6 across
    EXPECT_EQ(measure_views(lattice, d, 1, 6.5, nullptr).windows_per_view, 0);
}

TEST(Views, ABallHasNone) {
    const DenseLattice lattice = cube_lattice(64);
    const ViewMeasures m = measure_views(
        lattice, distances(lattice, [](const Vec3& p) { return length(p - kCenter) - 20; }), 8, 1,
        nullptr);
    EXPECT_EQ(m.open_share, 0);
    EXPECT_EQ(m.widest_m, 0);
}

} // namespace
} // namespace taihu
