#include "mesh_out/bounded_simplify.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "mesh_out/certificate.h"
#include "mesh_out/extract.h"
#include "tests/support/errors.h"
#include "tests/support/holed_ball.h"
#include "tests/support/surface_errors.h"
#include "vdb_ops/level_set_field.h"

namespace taihu {
namespace {

// Off the lattice: a sample that is exactly 0 makes faces without an area.
const std::vector<Sphere> kHoles = {
    {{.13, .37, 18.2}, 7.1},   {{8.3, .21, 14.1}, 6.2},   {{-14.3, 6.2, .17}, 8.1},
    {{-9.1, -9.3, 9.7}, 5.2},  {{3.3, 16.1, -5.2}, 6.3},  {{6.2, -14.3, -8.1}, 7.2},
    {{14.1, -6.3, -8.2}, 4.3}, {{.11, .23, -4.31}, 3.52}, {{1.3, 2.2, -19.1}, 4.1}};

TriMesh plain(const LabelledMesh& mesh) {
    return {mesh.positions, mesh.triangles, {}};
}

const HoledBall& exact_rock() {
    static const HoledBall solid(20.37, kHoles, false);
    return solid;
}
const HoledBall& rough_rock() {
    static const HoledBall solid(20.37, kHoles, true);
    return solid;
}
const LabelledMesh& dense(const HoledBall& solid) {
    static const LabelledMesh exact = sharp_surface(exact_rock(), 1),
                              rough = sharp_surface(rough_rock(), 1);
    return &solid == &exact_rock() ? exact : rough;
}

BoundedMesh simplified(const HoledBall& solid, double bound, bool balance = true) {
    return BoundedSimplifier(dense(solid), solid, {.spacing_m = 1, .balance = balance})
        .within(bound);
}

bool named(const std::vector<UnresolvedPlace>& places, const Vec3& p) {
    return std::any_of(places.begin(), places.end(), [&](const UnresolvedPlace& place) {
        return length(p - place.center) <= place.radius_m + 1e-9;
    });
}

class Bounds : public testing::TestWithParam<std::tuple<bool, bool, double>> {
protected:
    const HoledBall& solid() const { return std::get<0>(GetParam()) ? rough_rock() : exact_rock(); }
    bool balance() const { return std::get<1>(GetParam()); }
    double bound() const { return std::get<2>(GetParam()); }
};

TEST_P(Bounds, HoldAtEveryPointOffTheNamedPlaces) {
    const BoundedMesh result = simplified(solid(), bound(), balance());
    EXPECT_LE(result.error_m, bound());
    EXPECT_LT(result.mesh.triangles.size(), dense(solid()).triangles.size() / 3);
    const TriMesh mesh = plain(result.mesh);
    const SurfacePoints points = surface_points(solid(), plain(dense(solid())), 1, 20000);
    // Projections stop at 2e-4 of a spacing from the surface.
    const double tolerance = 5e-4;
    const SurfaceErrors errors = surface_errors(solid(), points, mesh, 0.1, bound() + tolerance);
    for (const Vec3& p : errors.places)
        EXPECT_TRUE(named(result.unresolved, p))
            << p.x << ' ' << p.y << ' ' << p.z << ": " << solid().at(p).value_m;
    // And the surface has no point farther from the mesh, rims included, but what the extraction
    // missed.
    EXPECT_LE(errors.face.quantile(.999), bound() + tolerance);
    EXPECT_LE(errors.rim.quantile(.99), bound() + tolerance);
    EXPECT_GT(points.rim.size(), 500u);
}

TEST_P(Bounds, KeepPiecesGenusAndLabels) {
    const BoundedMesh result = simplified(solid(), bound(), balance());
    const Certificate before = certify(plain(dense(solid()))), after = certify(plain(result.mesh));
    ASSERT_EQ(before.n_self_intersections, 0u);
    EXPECT_TRUE(after.holds()) << testing::PrintToString(faults(after));
    EXPECT_EQ(after.n_components, before.n_components);
    EXPECT_EQ(after.euler, before.euler);
    EXPECT_EQ(after.n_self_intersections, 0u);
    EXPECT_EQ(result.n_crossings, 0u);
    ASSERT_EQ(result.mesh.labels.size(), result.mesh.positions.size());
    const auto n_corners = [](const LabelledMesh& mesh) {
        return std::count_if(mesh.labels.begin(), mesh.labels.end(),
                             [](const PrimitiveSet& s) { return s.size() == 3; });
    };
    EXPECT_GE(n_corners(result.mesh), n_corners(dense(solid())));
    // Vertices stay within the bound of what they are said to lie on.
    for (std::size_t v = 0; v < result.mesh.positions.size(); ++v)
        for (const Primitive p : result.mesh.labels[v].all())
            if (!named(result.unresolved, result.mesh.positions[v])) {
                EXPECT_LE(std::abs(solid().of(p, result.mesh.positions[v]).value_m),
                          bound() + 1e-9);
            }
}

std::string name_of(const testing::TestParamInfo<Bounds::ParamType>& test) {
    const auto& [rough, balance, bound_vox] = test.param;
    return std::string(rough ? "Rough" : "Exact") + (balance ? "Balanced" : "") + "Within" +
           std::to_string(std::lround(100 * bound_vox)) + "Percent";
}
INSTANTIATE_TEST_SUITE_P(Rocks, Bounds,
                         testing::Combine(testing::Bool(), testing::Bool(),
                                          testing::Values(0.1, 0.25, 1.)),
                         name_of);

TEST(BoundedSimplifier, TakesALevelSetForAFieldOfOnePrimitive) {
    const auto grid = level_set_of(exact_rock(), 1);
    const LevelSetField field(grid);
    const auto probe = field.probe(Box{{-24, -24, -24}, {24, 24, 24}}, 12);
    LabelledMesh mesh;
    const TriMesh uniform = extract_uniform(*grid);
    mesh.triangles = uniform.triangles;
    mesh.labels.assign(uniform.positions.size(), PrimitiveSet(0));
    for (const Vec3& p : uniform.positions)
        mesh.positions.push_back(onto(*probe, PrimitiveSet(0), p, 0.3).value_or(p));
    const BoundedMesh result = BoundedSimplifier(mesh, *probe, {.spacing_m = 1}).within(0.25);
    EXPECT_LT(result.mesh.triangles.size(), mesh.triangles.size() / 4);
    EXPECT_EQ(result.n_crossings, 0u);
    const SurfacePoints points = surface_points(*probe, plain(mesh), 1, 20000);
    const SurfaceErrors errors = surface_errors(*probe, points, plain(result.mesh), 0.2, 0.25);
    std::size_t n_out = 0;
    for (const Vec3& p : errors.places)
        n_out += !named(result.unresolved, p);
    // Trilinear values have creases on the faces of voxels, between samples half a voxel apart:
    // measured 1.1e-3 with samples 1.6 voxels apart.
    EXPECT_LE(static_cast<double>(n_out), 2e-3 * static_cast<double>(errors.mesh.values.size()));
    EXPECT_LE(errors.mesh.quantile(.99), 0.25);
    EXPECT_LE(errors.face.quantile(.999), 0.25);
}

TEST(BoundedSimplifier, BalancingSavesTriangles) {
    // 22 to 35 per cent in the trials that it comes from.
    EXPECT_LT(simplified(exact_rock(), 0.25).mesh.triangles.size(),
              0.9 *
                  static_cast<double>(simplified(exact_rock(), 0.25, false).mesh.triangles.size()));
}

TEST(BoundedSimplifier, MakesTheSameMeshOnAnyNumberOfThreads) {
    const BoundedMesh many = simplified(rough_rock(), 0.25);
    for (const std::size_t n : {1u, 2u, 16u}) {
        tbb::global_control threads(tbb::global_control::max_allowed_parallelism, n);
        const BoundedMesh result = simplified(rough_rock(), 0.25);
        EXPECT_EQ(result.mesh.positions, many.mesh.positions);
        EXPECT_EQ(result.mesh.triangles, many.mesh.triangles);
        EXPECT_EQ(result.mesh.labels, many.mesh.labels);
        EXPECT_EQ(result.error_m, many.error_m);
    }
}

TEST(BoundedSimplifier, MakesLevelsOneFromAnother) {
    BoundedSimplifier simplifier(dense(exact_rock()), exact_rock(), {.spacing_m = 1});
    std::size_t before = dense(exact_rock()).triangles.size();
    for (const double bound : {0.25, 0.5, 1., 2.}) {
        const BoundedMesh level = simplifier.within(bound);
        EXPECT_LT(level.mesh.triangles.size(), before);
        EXPECT_EQ(level.bound_m, bound);
        EXPECT_TRUE(certify(plain(level.mesh)).holds());
        before = level.mesh.triangles.size();
    }
    expect_error(Fault::bad_argument, "not below 2 of the level before",
                 [&] { simplifier.within(1); });
}

TEST(BoundedSimplifier, MeetsATriangleBudget) {
    BoundedSimplifier simplifier(dense(rough_rock()), rough_rock(), {.spacing_m = 1});
    for (const std::size_t n : {3000u, 1500u}) {
        const BoundedMesh mesh = simplifier.to_triangles(n);
        EXPECT_LE(mesh.mesh.triangles.size(), n);
        EXPECT_GE(static_cast<double>(mesh.mesh.triangles.size()), 0.98 * static_cast<double>(n));
        EXPECT_LE(mesh.error_m, mesh.bound_m);
    }
    expect_error(Fault::bad_argument, "3 triangles of", [&] { simplifier.to_triangles(3); });
}

TEST(BoundedSimplifier, RefusesBadInputByName) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const LabelledMesh& good = dense(exact_rock());
    const auto make = [&](const LabelledMesh& mesh, const BoundedSettings& settings) {
        return BoundedSimplifier(mesh, exact_rock(), settings);
    };
    expect_error(Fault::bad_argument, "spacing_m is 0", [&] { make(good, {}); });
    expect_error(Fault::bad_argument, "max_turn_deg is 91",
                 [&] { make(good, {.spacing_m = 1, .max_turn_deg = 91}); });
    LabelledMesh mesh = good;
    mesh.labels.pop_back();
    expect_error(Fault::bad_argument, "give one each", [&] { make(mesh, {.spacing_m = 1}); });
    mesh = good;
    mesh.positions[7].y = nan;
    expect_error(Fault::bad_argument, "the position of vertex 7 is not finite",
                 [&] { make(mesh, {.spacing_m = 1}); });
    mesh = good;
    mesh.triangles.pop_back();
    expect_error(Fault::bad_argument, "not a closed 2-manifold",
                 [&] { make(mesh, {.spacing_m = 1}); });
    for (const double bound : {0., -1., nan})
        expect_error(Fault::bad_argument, "bound_m is",
                     [&] { make(good, {.spacing_m = 1}).within(bound); });
}

class CancelledAfter final : public Progress {
public:
    explicit CancelledAfter(int n) : left_(n) {}
    void stage(std::string_view) override {}
    void fraction(double) override {}
    bool cancelled() const override { return left_-- <= 0; }

private:
    mutable std::atomic<int> left_;
};

TEST(BoundedSimplifier, StopsWhenTold) {
    for (const int n : {0, 1, 20}) {
        CancelledAfter progress(n);
        BoundedSimplifier simplifier(dense(exact_rock()), exact_rock(), {.spacing_m = 1});
        expect_error(Fault::cancelled, "cancelled",
                     [&] { simplifier.within(0.25, {}, &progress); });
    }
}

} // namespace
} // namespace taihu
