#include "vdb_ops/field_probe.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace taihu {
namespace {

TEST(PrimitiveSet, IsSortedAndHoldsThree) {
    PrimitiveSet set;
    EXPECT_TRUE(set.empty());
    EXPECT_TRUE(set.add(7) && set.add(2) && set.add(7) && set.add(4));
    EXPECT_FALSE(set.add(9));
    const auto all = set.all();
    EXPECT_EQ((std::vector<Primitive>(all.begin(), all.end())), (std::vector<Primitive>{2, 4, 7}));
}

TEST(PrimitiveSet, ComparesAsSetsDo) {
    PrimitiveSet a(3), b(3);
    a.add(5);
    EXPECT_TRUE(b.within(a));
    EXPECT_FALSE(a.within(b));
    EXPECT_TRUE(PrimitiveSet().within(b));
    EXPECT_EQ(a.common(b), b);
    EXPECT_TRUE(a.common(PrimitiveSet(4)).empty());
}

/// Three balls.
class Balls final : public FieldProbe {
public:
    Nearest at(const Vec3& p) const override {
        Nearest best{of(0, p).value_m, 0};
        for (const Primitive i : {1u, 2u})
            if (const double v = of(i, p).value_m; v < best.value_m)
                best = {v, i};
        return best;
    }
    Value of(Primitive i, const Vec3& p) const override {
        const Vec3 d = p - kBalls[i].center;
        return {length(d) - kBalls[i].radius_m, d / length(d)};
    }
    void near(const Vec3&, double, std::vector<Primitive>& out) const override { out = {0, 1, 2}; }
    std::optional<Sphere> ball(Primitive i) const override { return kBalls[i]; }

    static constexpr std::array<Sphere, 3> kBalls{
        {{{0, 0, 0}, 1}, {{1, 0, 0}, 1}, {{0.5, 0.9, 0}, 1}}};
};

PrimitiveSet all_three() {
    PrimitiveSet set(0);
    set.add(1);
    set.add(2);
    return set;
}

TEST(Onto, FindsFacesRimsAndCorners) {
    const Balls balls;
    const Vec3 from{0.45, 0.4, 0.75};
    const auto face = onto(balls, PrimitiveSet(0), from, 1);
    ASSERT_TRUE(face);
    EXPECT_NEAR(length(*face), 1, 1e-6);
    EXPECT_NEAR(length(*face - from), 1 - length(from), 1e-6); // the nearest point

    PrimitiveSet rim(0);
    rim.add(1);
    const auto on_rim = onto(balls, rim, from, 1);
    ASSERT_TRUE(on_rim);
    EXPECT_NEAR(on_rim->x, 0.5, 1e-6); // a circle in the plane between the two
    EXPECT_NEAR(std::hypot(on_rim->y, on_rim->z), std::sqrt(0.75), 1e-6);

    const auto corner = onto(balls, all_three(), from, 1);
    ASSERT_TRUE(corner);
    for (const Primitive i : {0u, 1u, 2u})
        EXPECT_NEAR(balls.of(i, *corner).value_m, 0, 1e-6);
}

TEST(Onto, GivesUpWhereSurfacesDoNotMeetNearby) {
    const Balls balls;
    PrimitiveSet rim(0);
    rim.add(1);
    EXPECT_FALSE(onto(balls, rim, {-1, 0.1, 0}, 0.5));         // meets farther away
    EXPECT_FALSE(onto(balls, rim, {-1.2, 0, 0}, 5));           // normals are parallel
    EXPECT_FALSE(onto(balls, all_three(), {0.5, -0.9, 0}, 1)); // three normals in one plane
}

} // namespace
} // namespace taihu
