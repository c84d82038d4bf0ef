#include "vdb_ops/solids.h"

#include <numbers>

#include "tests/support/errors.h"
#include "tests/support/fields.h"
#include "vdb_ops/analytic_field.h"

namespace taihu {
namespace {

constexpr double kPi = std::numbers::pi;

struct Point2 {
    double rho, y;
};

/// The outline of a solid of revolution: an arc about (rho, y), a point for n = 0.
void arc(std::vector<Point2>& line, double rho, double y, double r, double from, double to, int n) {
    for (int i = 0; i <= n; ++i) {
        const double a = from + (to - from) * i / std::max(n, 1);
        line.push_back({rho + r * std::cos(a), y + r * std::sin(a)});
    }
}

/// Signed distance to the solid that a polyline from axis to axis turns to, by all its segments.
double outline_distance(const std::vector<Point2>& line, const Vec3& p, bool closed = false) {
    const double rho = std::hypot(p.x, p.z);
    double d2 = 1e300;
    bool inside = false;
    const std::size_t n = line.size();
    for (std::size_t i = 0; i + (closed ? 0 : 1) < n; ++i) { // along the axis is no surface
        const Point2 a = line[i], b = line[(i + 1) % n];
        if ((a.y > p.y) != (b.y > p.y) && rho < a.rho + (b.rho - a.rho) * (p.y - a.y) / (b.y - a.y))
            inside = !inside;
        const double ex = b.rho - a.rho, ey = b.y - a.y, e2 = ex * ex + ey * ey;
        const double t =
            e2 > 0 ? std::clamp((ex * (rho - a.rho) + ey * (p.y - a.y)) / e2, 0.0, 1.0) : 0;
        d2 = std::min(d2, std::pow(rho - a.rho - t * ex, 2) + std::pow(p.y - a.y - t * ey, 2));
    }
    return inside ? -std::sqrt(d2) : std::sqrt(d2);
}

Vec3 test_point(std::uint64_t i) {
    Vec3 p = random_vec(i) * 1.5;
    if (i % 7 == 0)
        p.x = 0;
    if (i % 11 == 0)
        p.y = 0;
    if (i % 13 == 0)
        p.z = 0;
    return p;
}

/// The segments of an arc lie inside it by less than r * (pi / n)^2 / 2 = 1e-7 for n = 6000.
constexpr int kArc = 6000;

TEST(Solids, OfRevolutionHaveTheDistanceOfTheirOutlines) {
    const double h = kPi / 2;
    std::vector<Point2> ball, cylinder, rounded, cone, tip, funnel, capsule, torus;
    arc(ball, 0, 0, 0.7, -h, h, kArc);
    cylinder = {{0, -0.4}, {0.6, -0.4}, {0.6, 0.4}, {0, 0.4}};
    rounded = {{0, -0.4}};
    arc(rounded, 0.5, -0.3, 0.1, -h, 0, kArc);
    arc(rounded, 0.5, 0.3, 0.1, 0, h, kArc);
    rounded.push_back({0, 0.4});
    cone = {{0, -0.5}, {0.8, -0.5}, {0.2, 0.5}, {0, 0.5}};
    tip = {{0, -0.5}, {0.3, -0.5}, {0, 0.5}};
    funnel = {{0, -0.1}, {0.05, -0.1}, {0.9, 0.1}, {0, 0.1}};
    arc(capsule, 0, -0.6, 0.2, -h, 0, kArc);
    arc(capsule, 0, 0.6, 0.2, 0, h, kArc);
    arc(torus, 0.6, 0, 0.25, 0, 2 * kPi, kArc);
    struct Case {
        PrimitiveSolid solid;
        const std::vector<Point2>& outline;
    };
    for (const Case& c :
         {Case{BallSolid{0.7}, ball}, Case{CylinderSolid{0.6, 0.4}, cylinder},
          Case{CylinderSolid{0.6, 0.4, 0.1}, rounded}, Case{ConeSolid{0.8, 0.2, 0.5}, cone},
          Case{ConeSolid{0.3, 0, 0.5}, tip}, Case{ConeSolid{0.05, 0.9, 0.1}, funnel},
          Case{CapsuleSolid{0.2, 0.6}, capsule}, Case{TorusSolid{0.6, 0.25}, torus}})
        for (std::uint64_t i = 0; i < 300; ++i) {
            const Vec3 p = test_point(i);
            ASSERT_NEAR(distance_m({c.solid, {}}, p),
                        outline_distance(c.outline, p, &c.outline == &torus), 2e-7)
                << c.solid.index() << ": " << p.x << ' ' << p.y << ' ' << p.z;
        }
}

TEST(Solids, BoxesRoundTheirEdgesWithinTheirSize) {
    for (std::uint64_t i = 0; i < 500; ++i) {
        const Vec3 p = test_point(i);
        EXPECT_NEAR(distance_m({BoxSolid{{0.5, 0.7, 0.3}}, {}}, p),
                    box_distance(p, {0.5, 0.7, 0.3}), 1e-14);
        EXPECT_NEAR(distance_m({BoxSolid{{0.5, 0.7, 0.3}, 0.1}, {}}, p),
                    box_distance(p, {0.4, 0.6, 0.2}) - 0.1, 1e-14);
    }
    EXPECT_NEAR(distance_m({BoxSolid{{1, 1, 1}, 1}, {}}, {1, 2, 2}), 2, 1e-14); // a ball
}

/// By bisection on the multiplier of Lagrange: the slow way. Axes in any order, shortest 1.
double ellipsoid_by_bisection(const Vec3& p, const Vec3& a) {
    const auto term = [&](int i, double t) { return a[i] * p[i] / (t + (a[i] - 1) * (a[i] + 1)); };
    const auto sum = [&](double t) {
        return term(0, t) * term(0, t) + term(1, t) * term(1, t) + term(2, t) * term(2, t);
    };
    double lo = 1e-15, hi = std::max({a.x, a.y, a.z}) * length(p) + 2;
    for (int i = 0; i < 200; ++i) {
        const double middle = hi > 4 * lo ? std::sqrt(lo * hi) : 0.5 * (lo + hi);
        (sum(middle) > 1 ? lo : hi) = middle;
    }
    Vec3 nearest;
    for (int i = 0; i < 3; ++i)
        nearest[i] = term(i, lo) * a[i];
    const Vec3 level{p.x / a.x, p.y / a.y, p.z / a.z};
    return length(p - nearest) * (length(level) < 1 ? -1 : 1);
}

TEST(Solids, EllipsoidsAgreeWithBisectionAtAnyAspect) {
    for (const double ratio : {1.0001, 1.3, 3., 30., 1e4})
        for (std::uint64_t i = 0; i < 400; ++i) {
            Vec3 a{1, std::pow(ratio, random_number(i, 10)), ratio};
            Vec3 p = random_vec(i);
            const double at = i % 2 ? 1 + 0.02 * random_number(i, 11) : 3 * random_number(i, 11);
            p = p * (at / length(p));
            p = {p.x * a.x, p.y * a.y, p.z * a.z};
            const double exact = ellipsoid_by_bisection(p, a);
            const std::uint64_t turn = i % 3; // the shortest axis along each
            const auto cycled = [turn](const Vec3& v) {
                return turn == 0 ? v : turn == 1 ? Vec3{v.z, v.x, v.y} : Vec3{v.y, v.z, v.x};
            };
            // As stated: 1e-8 of the size.
            ASSERT_NEAR(distance_m({EllipsoidSolid{cycled(a)}, {}}, cycled(p)), exact, 1e-8 * ratio)
                << ratio << ' ' << i;
        }
}

TEST(Solids, EllipsoidsHaveTheirDistancesInTheMiddlePlanes) {
    const AnalyticSolid s{EllipsoidSolid{{3, 1, 2}}, {}};
    EXPECT_NEAR(distance_m(s, {}), -1, 1e-9);
    EXPECT_NEAR(distance_m(s, {4, 0, 0}), 1, 1e-9);
    EXPECT_NEAR(distance_m(s, {0, 0, 1.9}), -0.1, 1e-9);
    // Off the centre, the nearest point of the surface is not in the plane: y^2 = 1 - (x / 3)^2
    // where x = 9 p / 8.
    const double p = 1, x = 9 * p / 8, y = std::sqrt(1 - x * x / 9);
    EXPECT_NEAR(distance_m(s, {p, 0, 0}), -std::hypot(x - p, y), 1e-9);
    EXPECT_NEAR(distance_m({EllipsoidSolid{{2, 2, 2}}, {}}, {0, 0, 0}), -2, 1e-12);
}

TEST(Solids, TurnAndGrowWithTheirPlace) {
    const Similarity at = Similarity::translation({1, 2, 3}) *
                          Similarity::rotation({1, 1, 0}, 1.1) * Similarity::scaling(2.5);
    const PrimitiveSolid shapes[] = {EllipsoidSolid{{0.5, 0.2, 0.8}},
                                     BoxSolid{{0.3, 0.2, 0.7}, 0.1},
                                     CylinderSolid{0.3, 0.5},
                                     ConeSolid{0.2, 0.4, 0.3},
                                     CapsuleSolid{0.2, 0.4},
                                     TorusSolid{0.5, 0.1},
                                     HalfSpaceSolid{}};
    for (const PrimitiveSolid& shape : shapes)
        for (std::uint64_t i = 0; i < 50; ++i) {
            const Vec3 p = random_vec(i);
            // The ellipsoid's 1e-8.
            EXPECT_NEAR(distance_m({shape, at}, at.point(p)), 2.5 * distance_m({shape, {}}, p),
                        1e-7);
        }
}

TEST(Solids, BoxesAreTight) {
    const Similarity at =
        Similarity::translation({0.1, -0.2, 0.3}) * Similarity::rotation({1, 2, 0.5}, 0.8);
    const PrimitiveSolid shapes[] = {BallSolid{0.4},
                                     EllipsoidSolid{{0.5, 0.2, 0.8}},
                                     BoxSolid{{0.3, 0.2, 0.7}},
                                     BoxSolid{{0.3, 0.2, 0.7}, 0.15},
                                     CylinderSolid{0.3, 0.5, 0.1},
                                     ConeSolid{0.2, 0.5, 0.3},
                                     CapsuleSolid{0.2, 0.4},
                                     TorusSolid{0.5, 0.1}};
    for (const PrimitiveSolid& shape : shapes) {
        const AnalyticSolid solid{shape, at};
        const Box box = bounds(solid);
        // A face of the box touches the solid: a plane beside it is at its distance from some
        // point.
        for (int axis = 0; axis < 3; ++axis)
            for (const bool high : {false, true}) {
                double nearest = 1e9;
                constexpr int kN = 60;
                for (int i = 0; i <= kN; ++i)
                    for (int j = 0; j <= kN; ++j) {
                        Vec3 p;
                        p[axis] = high ? box.hi[axis] : box.lo[axis];
                        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
                        p[u] = box.lo[u] + box.size()[u] * i / kN;
                        p[v] = box.lo[v] + box.size()[v] * j / kN;
                        nearest = std::min(nearest, distance_m(solid, p));
                    }
                EXPECT_GE(nearest, -1e-9) << shape.index();
                // Points of the face are 1.6 / 60 apart at most.
                EXPECT_LE(nearest, 0.02) << shape.index();
            }
    }
    EXPECT_EQ(bounds(AnalyticSolid{HalfSpaceSolid{}, at}).hi.x,
              std::numeric_limits<double>::infinity());
}

TEST(Solids, RefuseLengthsOutOfRangeByName) {
    const auto check = [](const PrimitiveSolid& s) { check_solid({s, {}}, "solids[3]"); };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    expect_error(Fault::bad_argument, "solids[3].radius_m is -1, must be > 0",
                 [&] { check(BallSolid{-1}); });
    expect_error(Fault::bad_argument, "semi_axes_m is nan", [&] {
        check(EllipsoidSolid{{1, nan, 1}});
    });
    expect_error(Fault::bad_argument, "half_size_m", [&] { check(BoxSolid{{1, 0, 1}}); });
    expect_error(Fault::bad_argument, "round_m is 0.6, must be 0..0.5", [&] {
        check(BoxSolid{{1, 0.5, 1}, 0.6});
    });
    expect_error(Fault::bad_argument, "round_m", [&] { check(CylinderSolid{1, 1, -0.1}); });
    expect_error(Fault::bad_argument, "top_radius_m", [&] { check(ConeSolid{1, -1, 1}); });
    expect_error(Fault::bad_argument, "bottom_radius_m and top_radius_m is 0", [&] {
        check(ConeSolid{0, 0, 1});
    });
    expect_error(Fault::bad_argument, "half_length_m", [&] { check(CapsuleSolid{1, -1}); });
    expect_error(Fault::bad_argument, "tube_m", [&] { check(TorusSolid{1, 1.5}); });
    check(HalfSpaceSolid{});
}

} // namespace
} // namespace taihu
