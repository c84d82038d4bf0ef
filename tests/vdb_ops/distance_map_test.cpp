#include "vdb_ops/distance_map_detail.h"

#include <gtest/gtest.h>

#include "tests/support/dense.h"

namespace taihu {
namespace {

TEST(DistanceMap, OfABallIsItsDistanceFarFromTheBandToo) {
    const DenseLattice lattice = cube_lattice(48);
    const auto distance = [](const Vec3& p) { return length(p - Vec3{23.3, 24.1, 22.8}) - 15.4; };
    for (const float trusted : {0.f, 2.9f}) {
        const auto d = signed_distances(lattice, sampled(lattice, distance), trusted, nullptr);
        for (int x = 0; x < 48; ++x)
            for (int y = 0; y < 48; ++y)
                for (int z = 0; z < 48; ++z) {
                    const double exact = distance({1. * x, 1. * y, 1. * z});
                    const double found = d[lattice.at(x, y, z)];
                    ASSERT_EQ(found < 0, exact < 0);
                    // The bound of the header, with the ball's own bend; crossings lie inside it by
                    // the height of an arc of one sample, 1 / (8 * 15.4).
                    const double depth = std::abs(exact), bend = 1 / 15.4;
                    const double bound =
                        0.35 * (trusted > depth ? bend : 1 / std::max(depth, 0.5) + bend) + 0.01;
                    ASSERT_NEAR(found, exact, bound) << x << ' ' << y << ' ' << z;
                }
    }
}

TEST(DistanceMap, OfASlantedPlaneIsStraight) {
    const DenseLattice lattice = cube_lattice(40);
    const Vec3 n = normalized({1, 2, 3});
    const auto distance = [&](const Vec3& p) { return dot(p - Vec3{20, 20, 20}, n); };
    const auto d = signed_distances(lattice, sampled(lattice, distance), 2.9f, nullptr);
    for (int i = 12; i < 28; ++i) { // where the foot of the perpendicular is in the lattice
        const double exact = distance({1. * i, 1. * i, 1. * i});
        EXPECT_NEAR(d[lattice.at(i, i, i)], exact, std::abs(exact) < 2.9 ? 1e-5 : 0.09) << i;
    }
}

TEST(DistanceMap, ValuesThatFallShortAreNotTrusted) {
    // max() of two tunnels' distances is too small in the window between them.
    const DenseLattice lattice = cube_lattice(40);
    const auto distance = [](const Vec3& p) {
        const double a = 9 - length(p - Vec3{13, 20, 20}), b = 9 - length(p - Vec3{27, 20, 20});
        return std::max(a, b); // positive in the balls
    };
    const auto d = signed_distances(lattice, sampled(lattice, distance), 2.9f, nullptr);
    // The balls meet in a circle of radius sqrt(81 - 49); the value in its middle is 2.
    EXPECT_NEAR(d[lattice.at(20, 20, 20)], std::sqrt(32.), 0.1);
}

TEST(DistanceMap, WithoutASurfaceIsInfinite) {
    const DenseLattice lattice = cube_lattice(5);
    const auto d = signed_distances(lattice, std::vector<float>(lattice.size(), 2.f), 3, nullptr);
    for (const float value : d)
        EXPECT_EQ(value, std::numeric_limits<float>::infinity());
}

} // namespace
} // namespace taihu
