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

} // namespace
} // namespace taihu
