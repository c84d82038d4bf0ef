#include "vdb_ops/similarity.h"

#include <cstring>
#include <limits>
#include <numbers>

#include "tests/support/errors.h"
#include "tests/support/fields.h"

namespace taihu {
namespace {

constexpr double kPi = std::numbers::pi;

Similarity random_similarity(std::uint64_t i) {
    return Similarity::translation(random_vec(i, 0) * 3.0) *
           Similarity::rotation(random_vec(i, 3), 7 * random_number(i, 6)) *
           Similarity::scaling(0.2 + 3 * random_number(i, 7));
}

void expect_near(const Vec3& a, const Vec3& b, double tolerance) {
    EXPECT_LE(length(a - b), tolerance)
        << a.x << ' ' << a.y << ' ' << a.z << " and " << b.x << ' ' << b.y << ' ' << b.z;
}

bool same_bits(const Vec3& a, const Vec3& b) {
    return std::memcmp(&a, &b, sizeof a) == 0;
}

TEST(Similarity, TheIdentityKeepsEveryBit) {
    const Similarity id = Similarity::rotation({0, 1, 0}, 0) * Similarity::scaling(1) *
                          Similarity::translation({0, 0, 0});
    EXPECT_TRUE(id.is_identity());
    EXPECT_TRUE(id.inverse().is_identity());
    const Vec3 p{-0.0, 0.1, std::numeric_limits<double>::denorm_min()};
    EXPECT_TRUE(same_bits(id.point(p), p));
    const Similarity s = random_similarity(1);
    EXPECT_EQ(s * id, s);
    EXPECT_EQ(id * s, s);
    const Box box{{-0.0, 0.1, 0.2}, {1, 2, 3}};
    EXPECT_EQ(placed(box, id), box);
    const TriMesh mesh{{p, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, {}};
    EXPECT_TRUE(same_bits(placed(mesh, id).positions[0], p));
}

TEST(Similarity, QuarterTurnsAreExactAndRightHanded) {
    const Similarity turn = Similarity::rotation({0, 0, 1}, kPi / 2);
    EXPECT_EQ(turn.point({1, 0, 0}), (Vec3{0, 1, 0}));
    EXPECT_EQ(turn.point({0, 2, 5}), (Vec3{-2, 0, 5}));
    EXPECT_EQ(Similarity::rotation({0, 2, 0}, -kPi).point({1, 2, 3}), (Vec3{-1, 2, -3}));
    EXPECT_EQ((turn * turn).point({1, 2, 3}), (Vec3{-1, -2, 3}));
}

TEST(Similarity, ComposesAndInverts) {
    for (std::uint64_t i = 0; i < 100; ++i) {
        const Similarity a = random_similarity(2 * i), b = random_similarity(2 * i + 1);
        const Vec3 p = random_vec(i, 20) * 5.0;
        // Coordinates up to 100, a few dozen operations of relative error 1e-16.
        expect_near((a * b).point(p), a.point(b.point(p)), 1e-12);
        expect_near(a.inverse().point(a.point(p)), p, 1e-12);
        const Vec3 q = random_vec(i, 30);
        EXPECT_NEAR(length(a.point(p) - a.point(q)), a.scale() * length(p - q), 1e-12);
        EXPECT_NEAR(dot(cross(a.axis(0), a.axis(1)), a.axis(2)), 1, 1e-14);
    }
}

TEST(Similarity, BoxesHoldTheirTurnedSelvesTightly) {
    for (std::uint64_t i = 0; i < 20; ++i) {
        const Similarity s = random_similarity(i);
        const Box box{{-1, 0, 2}, {1, 3, 2.5}}, turned = placed(box, s);
        Box corners;
        for (int k = 0; k < 8; ++k)
            corners.include(s.point({k & 1 ? box.lo.x : box.hi.x, k & 2 ? box.lo.y : box.hi.y,
                                     k & 4 ? box.lo.z : box.hi.z}));
        expect_near(turned.lo, corners.lo, 1e-12);
        expect_near(turned.hi, corners.hi, 1e-12);
    }
    EXPECT_TRUE(placed(Box{}, random_similarity(0)).empty());
}

TEST(Similarity, PlacesSpheresAndMeshes) {
    const Similarity s = Similarity::translation({1, 0, 0}) *
                         Similarity::rotation({0, 0, 1}, kPi / 2) * Similarity::scaling(2);
    EXPECT_EQ(placed(Sphere{{1, 0, 0}, 0.5}, s), (Sphere{{1, 2, 0}, 1}));
    const TriMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, {{0, 0, 1}, {1, 0, 0}, {}}};
    const TriMesh moved = placed(mesh, s);
    EXPECT_EQ(moved.positions[1], (Vec3{1, 2, 0}));
    EXPECT_EQ(moved.normals[1], (Vec3{0, 1, 0})); // turned, not scaled
    EXPECT_EQ(moved.triangles, mesh.triangles);
}

TEST(Similarity, RefusesWhatIsNone) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    expect_error(Fault::bad_argument, "scale is 0, must be 1e-9..1e9",
                 [] { Similarity::scaling(0); });
    expect_error(Fault::bad_argument, "scale is nan", [&] { Similarity::scaling(nan); });
    expect_error(Fault::bad_argument, "the shift is not finite", [&] {
        Similarity::translation({0, nan, 0});
    });
    expect_error(Fault::bad_argument, "the axis", [] { Similarity::rotation({0, 0, 0}, 1); });
    expect_error(Fault::bad_argument, "the angle", [&] { Similarity::rotation({0, 0, 1}, nan); });
    expect_error(Fault::bad_argument, "quaternion", [] {
        Similarity::rotation(Quaternion{0, 0, 0, 0});
    });
    expect_error(Fault::bad_argument, "leave the numbers", [] {
        Similarity s = Similarity::scaling(1e9);
        for (int i = 0; i < 10; ++i)
            s = s * s;
    });
}

} // namespace
} // namespace taihu
