#include "stats/core/polygon.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <gtest/gtest.h>

#include "stats/core/rng.h"

namespace taihu {
namespace {

std::vector<std::uint32_t> all_corners(std::size_t n) {
    std::vector<std::uint32_t> corners(n);
    std::iota(corners.begin(), corners.end(), 0u);
    return corners;
}

std::vector<Triangle> cut(const std::vector<Vec3>& polygon) {
    std::vector<Triangle> out;
    EXPECT_TRUE(triangulate(polygon, all_corners(polygon.size()), out));
    return out;
}

/// Area of a simple polygon in the plane z = 0, by the shoelace formula.
double polygon_area(const std::vector<Vec3>& p) {
    double twice = 0;
    for (std::size_t i = 0; i < p.size(); ++i) {
        const Vec3 &a = p[i], &b = p[(i + 1) % p.size()];
        twice += a.x * b.y - a.y * b.x;
    }
    return twice / 2;
}

/// Triangles that turn as the polygon does and together have its area cover it once.
void expect_covered_once(const std::vector<Vec3>& polygon) {
    const auto triangles = cut(polygon);
    ASSERT_EQ(triangles.size(), polygon.size() - 2);
    double area = 0;
    for (const Triangle& t : triangles) {
        const Vec3 c = cross(polygon[t[1]] - polygon[t[0]], polygon[t[2]] - polygon[t[0]]);
        EXPECT_GE(c.z, 0);
        area += c.z / 2;
    }
    // Sums of some hundred products of numbers around 1.
    EXPECT_NEAR(area, polygon_area(polygon), 1e-12);
}

TEST(Triangulate, CutsAQuadAlongTheShorterDiagonal) {
    EXPECT_EQ(cut({{0, 0, 0}, {2, 0, 0}, {3, 1, 0}, {1, 1, 0}}),
              (std::vector<Triangle>{{1, 2, 3}, {1, 3, 0}}));
    EXPECT_EQ(cut({{0, 0, 0}, {2, 0, 0}, {1, 1, 0}, {-1, 1, 0}}),
              (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
}

TEST(Triangulate, CutsAConcaveQuadInside) { // the notch is corner 2, so only diagonal 0-2 is inside
    const std::vector<Vec3> dart = {{0, 0, 0}, {1, 3, 0}, {0, 2.5, 0}, {-1, 3, 0}};
    EXPECT_EQ(cut(dart), (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
    // The same dart begun one corner later needs the other diagonal.
    EXPECT_EQ(cut({dart[1], dart[2], dart[3], dart[0]}),
              (std::vector<Triangle>{{1, 2, 3}, {1, 3, 0}}));
}

TEST(Triangulate, MakesAFanOfAConvexPolygon) {
    std::vector<Vec3> polygon;
    for (int i = 0; i < 7; ++i) {
        const double angle = 2 * std::numbers::pi * i / 7;
        polygon.push_back({std::cos(angle), std::sin(angle), 0});
    }
    const auto triangles = cut(polygon);
    ASSERT_EQ(triangles.size(), 5u);
    for (std::uint32_t i = 0; i < 5; ++i)
        EXPECT_EQ(triangles[i], (Triangle{0, i + 1, i + 2}));
    expect_covered_once(polygon);
}

TEST(Triangulate, CoversConcavePolygonsOnce) {
    expect_covered_once({{0, 0, 0}, {3, 0, 0}, {3, 3, 0}, {2, 3, 0}, {2, 1, 0}, {0, 1, 0}}); // L
    std::vector<Vec3> comb = {{0, -1, 0}, {20, -1, 0}};
    for (int i = 20; i >= 0; --i)
        comb.push_back({static_cast<double>(i), i % 2 == 0 ? 0.0 : 5.0, 0});
    expect_covered_once(comb);
    // Stars with seeded radii: simple, because the angle only grows.
    for (std::uint64_t star = 0; star < 50; ++star) {
        std::vector<Vec3> polygon;
        for (std::uint32_t i = 0; i < 60; ++i) {
            const double angle = 2 * std::numbers::pi * i / 60;
            const double radius = 0.05 + Rng{.seed = 3}.uniform(star, i);
            polygon.push_back({radius * std::cos(angle), radius * std::sin(angle), 0});
        }
        expect_covered_once(polygon);
    }
}

TEST(Triangulate, CoversAPolygonWithASeamToItsHoleOnce) {
    const std::vector<Vec3> points = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0},
                                      {1, 1, 0}, {1, 3, 0}, {3, 3, 0}, {3, 1, 0}};
    std::vector<Triangle> out;
    ASSERT_TRUE(triangulate(points, std::vector<std::uint32_t>{0, 1, 2, 3, 0, 4, 5, 6, 7, 4}, out));
    ASSERT_EQ(out.size(), 8u);
    double area = 0;
    for (const Triangle& t : out) {
        const Vec3 c = cross(points[t[1]] - points[t[0]], points[t[2]] - points[t[0]]);
        EXPECT_GT(c.z, 0);
        area += c.z / 2;
    }
    EXPECT_EQ(area, 12); // 16 less the hole's 4; all coordinates are small integers
}

TEST(Triangulate, KeepsTheWindingInAnyPlane) {
    std::vector<Vec3> l = {{0, 0, 0}, {3, 0, 0}, {3, 3, 0}, {2, 3, 0}, {2, 1, 0}, {0, 1, 0}};
    for (Vec3& p : l)
        p = {p.z + 5, p.x - p.y, p.y + p.x};
    const Vec3 outward = cross(l[1] - l[0], l[2] - l[1]); // a convex corner
    for (const Triangle& t : cut(l))
        EXPECT_GT(dot(cross(l[t[1]] - l[t[0]], l[t[2]] - l[t[0]]), outward), 0);
}

TEST(Triangulate, AlwaysMakesTwoLessThanTheCorners) {
    for (std::uint64_t tangle = 0; tangle < 200; ++tangle) { // they cross themselves
        std::vector<Vec3> polygon;
        for (std::uint32_t i = 0; i < 5 + tangle % 20; ++i) {
            const Rng rng{.seed = 5, .stream = i};
            polygon.push_back({rng.uniform(tangle, 0), rng.uniform(tangle, 1), 0});
        }
        EXPECT_EQ(cut(polygon).size(), polygon.size() - 2);
    }
    EXPECT_EQ(cut(std::vector<Vec3>(9, Vec3{1, 1, 1})).size(), 7u); // no area at all
    EXPECT_EQ(cut(std::vector<Vec3>(6, Vec3{1e300, -1e300, 1e300})).size(), 4u);
}

TEST(Triangulate, RefusesOnlyLongConcavePolygons) {
    std::vector<Vec3> round;
    for (std::size_t i = 0; i < 2 * kMaxConcaveCorners; ++i) {
        const double angle = std::numbers::pi * static_cast<double>(i) / kMaxConcaveCorners;
        round.push_back({std::cos(angle), std::sin(angle), 0});
    }
    EXPECT_EQ(cut(round).size(), round.size() - 2);
    round[100] = round[100] * 0.5;
    std::vector<Triangle> out;
    EXPECT_FALSE(triangulate(round, all_corners(round.size()), out));
    EXPECT_TRUE(out.empty());
}

} // namespace
} // namespace taihu
