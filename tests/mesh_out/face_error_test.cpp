#include "mesh_out/face_error_detail.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "tests/support/fields.h"
#include "tests/support/holed_ball.h"

namespace taihu {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

FaceErrors::Rules rules(double bound) {
    return {.face_m = bound, .rim_m = bound, .exact_corners = false, .may_pierce = true};
}

/// The distance to the solid's surface of the points of a face, at its greatest on a dense lattice,
/// by the surface points of one rim: exact for two balls.
double sampled(const HoledBall& solid, const FaceErrors::Corners& f) {
    double most = 0;
    constexpr int n = 60;
    for (int u = 0; u <= n; ++u)
        for (int v = 0; u + v <= n; ++v) {
            const Vec3 p =
                f[0] * (double(u) / n) + f[1] * (double(v) / n) + f[2] * (double(n - u - v) / n);
            if (const auto y = surface_point_near(solid, p, 10))
                most = std::max(most, length(*y - p));
        }
    return most;
}

TEST(FaceErrors, OfABallAreTheDepthOfTheChord) {
    const HoledBall solid(30, {}, false);
    LabelledMesh mesh;
    const double r = 30, a = 0.1; // corners at equal angles from an axis: depth r - r cos(a)
    for (int k = 0; k < 3; ++k)
        mesh.positions.push_back(Vec3{std::sin(a) * std::cos(2.0944 * k),
                                      std::sin(a) * std::sin(2.0944 * k), std::cos(a)} *
                                 r);
    mesh.triangles = {{0, 1, 2}};
    mesh.labels.assign(3, PrimitiveSet(0));
    const FaceErrors errors(mesh, solid, 1, 1);
    const FaceErrors::Corners face = {mesh.positions[0], mesh.positions[1], mesh.positions[2]};
    const double depth = r - r * std::cos(a);
    EXPECT_NEAR(errors.bound(face, {0, 0, 0}, rules(1)), depth, 1e-9);
    EXPECT_EQ(errors.bound(face, {0, 0, 0}, rules(0.99 * depth)), kInfinity);
    FaceErrors::Rules centred = rules(0.51 * depth);
    centred.centred = true;
    EXPECT_NEAR(errors.bound(face, {0, 0, 0}, centred), depth / 2, 1e-9);
}

TEST(FaceErrors, AreNeverBelowTheDistanceOfAnyPoint) {
    // Two holes that cross, and small faces of all directions and sizes near their rim.
    const HoledBall solid(30, {{{-4, 0, 20}, 7}, {{5, 0, 20}, 6}, {{0, 4, 14}, 4}}, false);
    const LabelledMesh dense = sharp_surface(solid, 1);
    const FaceErrors errors(dense, solid, 0.5, 1);
    std::size_t n_finite = 0;
    for (std::size_t f = 0; f < dense.triangles.size(); f += 17) {
        const Triangle t = dense.triangles[f];
        FaceErrors::Corners face;
        FaceErrors::Labels labels{};
        for (std::size_t k = 0; k < 3; ++k) {
            face[k] =
                dense.positions[t[k]] + 0.4 * random_vec(f, static_cast<std::uint32_t>(3 * k));
            labels[k] = errors.labels()[t[k]];
        }
        // Larger than those of the mesh, about their first corner.
        for (std::size_t k = 1; k < 3; ++k)
            face[k] = face[0] + (face[k] - face[0]) * 2;
        const double bound = errors.bound(face, labels, rules(1.5));
        if (bound == kInfinity)
            continue;
        ++n_finite;
        // Samples of the field's own error in projecting: far below a thousandth.
        EXPECT_LE(sampled(solid, face), bound + 1e-3) << "face " << f;
        if (const double found = errors.searched(face, 1.5); found <= 1.5) {
            EXPECT_LE(sampled(solid, face), found + 1e-3) << "face " << f;
        }
    }
    EXPECT_GT(n_finite, 100u);
}

TEST(FaceErrors, SearchedBeyondThinRimsAreNotThoseOfOnePrimitive) {
    // Two holes that meet at an edge of 31 degrees: points past it are near both, far from the rim.
    const HoledBall solid(30, {{{-5, 0, 20}, 7}, {{8.5, 0, 20}, 7}}, false);
    const FaceErrors errors(sharp_surface(solid, 1), solid, 0.25, 1);
    std::size_t n_near = 0, n_far = 0;
    for (std::uint64_t i = 0; i < 1200; ++i) {
        FaceErrors::Corners face;
        const Vec3 at = Vec3{1.75, 0, 20} + 2 * random_vec(i, 0);
        for (std::size_t k = 0; k < 3; ++k)
            face[k] = at + 0.4 * random_vec(i, static_cast<std::uint32_t>(3 + 3 * k));
        const double found = errors.searched(face, 0.25, 0.25);
        if (found <= 0.25) {
            ++n_near;
            EXPECT_LE(sampled(solid, face), 0.25 + 1e-3) << "face " << i; // as above
        } else {
            ++n_far;
        }
    }
    EXPECT_GT(n_near, 20u);
    EXPECT_GT(n_far, 20u);
}

TEST(FaceErrors, FacesThatSurelyFitABallDo) {
    const HoledBall solid(30, {{{0, 0, 20}, 9}}, false);
    const LabelledMesh dense = sharp_surface(solid, 1);
    const FaceErrors errors(dense, solid, 0.5, 1);
    FaceErrors::Rules asked = rules(0.3);
    asked.exact_corners = true;
    asked.turn_cosine = 0.9;
    std::size_t n_fit = 0, n = 0;
    for (std::size_t f = 0; f + 300 < dense.triangles.size(); f += 7) {
        // Corners from farther and farther triangles.
        const std::size_t apart = 1 + f % 300;
        const std::array<std::uint32_t, 3> v = {dense.triangles[f][0],
                                                dense.triangles[f + apart][1],
                                                dense.triangles[f + apart / 2][2]};
        const FaceErrors::Labels labels = {errors.labels()[v[0]], errors.labels()[v[1]],
                                           errors.labels()[v[2]]};
        const PrimitiveSet shared = errors.shared(labels);
        if (shared.size() != 1 || v[0] == v[1] || v[1] == v[2] || v[2] == v[0])
            continue;
        const FaceErrors::Corners p = {dense.positions[v[0]], dense.positions[v[1]],
                                       dense.positions[v[2]]};
        ++n;
        if (!errors.fits_ball(shared[0], p[0], cross(p[1] - p[0], p[2] - p[0]), asked))
            continue;
        ++n_fit;
        // Its vertices are on the balls to 1e-6 and better.
        EXPECT_LE(errors.range(shared[0], p).most(), 0.3 + 1e-5);
    }
    EXPECT_GT(n_fit, 50u);
    EXPECT_LT(n_fit, n);
}

TEST(FaceErrors, NoPrimitiveIsNearerThanTheClearance) {
    const HoledBall solid = HoledBall::random(48, 40, 0.3, 1);
    const LabelledMesh dense = sharp_surface(solid, 1);
    const FaceErrors errors(dense, solid, 0.25, 1);
    double most = 0;
    for (std::size_t v = 0; v < dense.positions.size(); v += 11) {
        const auto clear = errors.clearance(dense.positions[v], errors.labels()[v]);
        std::vector<Primitive> near;
        solid.near(dense.positions[v], 6, near);
        for (const Primitive p : near) {
            if (dense.labels[v].has(p))
                continue;
            const double d = std::abs(solid.of(p, dense.positions[v]).value_m);
            // Distances of first order are not quite 1-Lipschitz, which is what cells tell by.
            EXPECT_GE(d, clear.any * (solid.ball(p) ? 1 - 1e-9 : 0.97));
        }
        EXPECT_LE(clear.any, clear.sampled);
        most = std::max(most, clear.any);
    }
    EXPECT_GT(most, 2);
}

TEST(FaceErrors, ParabolasAreExactForQuadrics) {
    const auto value = [](const Vec3& p) { return 0.3 * p.x * p.x - 0.1 * p.x * p.y + p.z; };
    const auto gradient = [](const Vec3& p) { return Vec3{0.6 * p.x - 0.1 * p.y, -0.1 * p.x, 1}; };
    const FaceErrors::Corners f = {Vec3{0, 0, 0.2}, Vec3{1, 0.1, -0.1}, Vec3{0.3, 0.8, 0}};
    const FaceParabolas found = parabolas(f, {value(f[0]), value(f[1]), value(f[2])},
                                          {gradient(f[0]), gradient(f[1]), gradient(f[2])});
    double lo = kInfinity, hi = -kInfinity;
    for (const Vec3& p : {f[0], f[1], f[2], (f[0] + f[1]) / 2, (f[1] + f[2]) / 2, (f[2] + f[0]) / 2,
                          (f[0] + f[1] + f[2]) / 3}) {
        lo = std::min(lo, value(p));
        hi = std::max(hi, value(p));
    }
    EXPECT_NEAR(found.range.lo, lo, 1e-12);
    EXPECT_NEAR(found.range.hi, hi, 1e-12);
    EXPECT_NEAR(found.skew, 0, 1e-12);
    EXPECT_TRUE(found.is_smooth);
}

} // namespace
} // namespace taihu
