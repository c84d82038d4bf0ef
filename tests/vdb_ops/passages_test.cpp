#include "vdb_ops/passages_detail.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/dense.h"
#include "vdb_ops/analytic_field.h"

namespace taihu {
namespace {

constexpr double kPi = std::numbers::pi;
const Vec3 kCenter{31.6, 32.3, 31.8};
constexpr double kSide = 32;
constexpr float kLarge = 14; // of the ball that finds the outline

/// A cube with a round hole from top to bottom, of radius r at its ends and `neck` in the middle.
double drilled(const Vec3& p, double r, double neck) {
    const Vec3 d = p - kCenter;
    const double across = std::hypot(d.x, d.z);
    const double wide = std::max(across - r, 6 - std::abs(d.y)), narrow = across - neck;
    return std::max(box_distance(d, {kSide / 2, kSide / 2, kSide / 2}), -std::min(wide, narrow));
}

/// What a ball on a round mouth has beyond it.
double cap(double ball, double mouth) {
    const double deep = ball - std::sqrt(ball * ball - mouth * mouth);
    return kPi / 3 * deep * deep * (3 * ball - deep);
}

TEST(Passages, AHoleFromTopToBottomIsOneWayAndAChannel) {
    const double r = 6.4;
    const DenseLattice lattice = cube_lattice(64);
    const auto d = distances(lattice, [&](const Vec3& p) { return drilled(p, r, r); });
    const Passages passages(lattice, d, kLarge, nullptr);
    // A quarter of a sample off the axis, and as much as crossings lie beside the nearest point.
    EXPECT_NEAR(passages.channel(nullptr), 2 * r, 0.6);
    const double mouths = 2 * cap(kLarge, r), volume = std::pow(kSide, 3) - mouths;
    const double share = (kPi * r * r * kSide - mouths) / volume;
    for (const float radius : {0.f, 2.f, 5.f}) {
        const Passages::Opened opened = passages.opened(radius, nullptr);
        EXPECT_EQ(opened.n_ways, 1) << radius;
        EXPECT_NEAR(opened.open_share, share, 0.05 * share) << radius; // 0.3 samples of the radius
    }
    EXPECT_EQ(passages.opened(7, nullptr).n_ways, 0);
    EXPECT_EQ(passages.sealed().n, 0u);
}

TEST(Passages, ANeckIsTheWidthOfTheChannel) {
    const DenseLattice lattice = cube_lattice(64);
    const auto d = distances(lattice, [&](const Vec3& p) { return drilled(p, 8, 3.6); });
    const Passages passages(lattice, d, kLarge, nullptr);
    EXPECT_NEAR(passages.channel(nullptr), 7.2, 0.6);
    EXPECT_EQ(passages.opened(3, nullptr).n_ways, 1);
    EXPECT_EQ(passages.opened(4.2f, nullptr).n_ways, 0);
    // A ball that does not pass sweeps the two wide ends, 10 deep, but for their edges, (1 - pi /
    // 4) of its radius squared with the centroid 0.223 radii off, and what it reaches of the neck.
    const double ball = 5, ends = kPi * 8 * 8 * 10,
                 edges = 2 * kPi * (8 - 0.223 * ball) * (1 - kPi / 4) * ball * ball;
    const double mouths = 2 * cap(kLarge, 8), volume = std::pow(kSide, 3) - mouths;
    const double share = (2 * (ends - edges + cap(ball, 3.6)) - mouths) / volume;
    EXPECT_NEAR(passages.opened(5, nullptr).open_share, share, 0.05 * share);
}

TEST(Passages, ABubbleIsSealed) {
    const DenseLattice lattice = cube_lattice(64);
    const auto d = distances(lattice, [](const Vec3& p) {
        const double r = length(p - kCenter);
        return std::max(r - 16, 6 - r);
    });
    const Passages passages(lattice, d, kLarge, nullptr);
    EXPECT_EQ(passages.sealed().n, 1u);
    EXPECT_NEAR(passages.sealed().share, std::pow(6 / 16., 3), 0.002);
    EXPECT_EQ(passages.opened(0, nullptr).open_share, 0);
    EXPECT_EQ(passages.channel(nullptr), 0);
}

} // namespace
} // namespace taihu
