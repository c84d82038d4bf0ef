#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "tests/support/cube_mesh.h"
#include "tests/support/fields.h"
#include "tests/support/level_sets.h"
#include "vdb_ops/analytic_field.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/combine_field.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/level_set_box.h"
#include "vdb_ops/level_set_field.h"
#include "vdb_ops/mesh_field.h"
#include "vdb_ops/offset_field.h"
#include "vdb_ops/placed_level_set_field.h"
#include "vdb_ops/solids_field.h"
#include "vdb_ops/superquadric_field.h"

namespace taihu {
namespace {

constexpr double kVoxel = 0.05, kReach = 0.15;
const Lattice kLattice{kVoxel, {0.011, -0.007, 0.003}, 3};

std::shared_ptr<const Field> ball(const Vec3& center, double radius_m) {
    return std::make_shared<BallsField>(std::vector<Sphere>{{center, radius_m}});
}
std::shared_ptr<const Field> solid(const PrimitiveSolid& shape, const Similarity& at = {}) {
    return std::make_shared<SolidsField>(std::vector<AnalyticSolid>{{shape, at}});
}
Similarity tilted() {
    return Similarity::translation({0.1, 0.05, -0.02}) * Similarity::rotation({1, 2, 0.5}, 0.7);
}

/// What a probe says is what rasterize() says, and its parts agree with each other.
/// \param tolerance_vox  of values in the band.
/// \param band_vox       how far from the surface they are compared.
void expect_probe(const Field& field, double tolerance_vox, double band_vox = 3,
                  bool smooth = true) {
    const auto grid = rasterize(field, kLattice);
    const Box box = level_set_box(*grid).dilated(2 * kVoxel);
    const auto probe = field.probe(box, kReach);
    std::size_t n = 0, n_faces = 0, n_missed = 0, n_bent = 0, n_outside = 0;
    double worst = 0, worst_slope = 0;
    for (auto it = grid->cbeginValueOn(); it; ++it) {
        const auto c = it.getCoord();
        const Vec3 p = kLattice.origin + Vec3{double(c.x()), double(c.y()), double(c.z())} * kVoxel;
        const FieldProbe::Nearest at = probe->at(p);
        if (std::fabs(double(*it)) < band_vox * kVoxel)
            worst = std::max(worst, std::fabs(at.value_m - double(*it)));
        n_outside += at.primitive >= field.n_primitives();
        if (++n % 7 != 0)
            continue;
        EXPECT_EQ(probe->value_of(at.primitive, p), probe->of(at.primitive, p).value_m);
        const double step = 1e-4 * kReach;
        const FieldProbe::Value own = probe->slope(p, step);
        EXPECT_NEAR(own.value_m, at.value_m, 1e-6 * kReach); // faces say it in other words
        bool bends = false; // between the nearest points of two parts, and at edges
        for (int axis = 0; axis < 3; ++axis) {
            Vec3 by;
            by[axis] = step;
            const double slope =
                (probe->at(p + by).value_m - probe->at(p - by).value_m) / (2 * step);
            bends = bends || std::fabs(slope - own.gradient[axis]) > 0.02;
        }
        n_bent += bends;
        // A point of the surface near p, if p's primitive leads to one.
        const auto on = onto(*probe, PrimitiveSet(at.primitive), p, kReach);
        if (!on || !box.contains(*on))
            continue;
        const FieldProbe::Nearest there = probe->at(*on);
        if (std::fabs(there.value_m) > 1e-5 * kReach)
            continue;
        ++n_faces;
        const FieldProbe::Value v = probe->of(there.primitive, *on);
        EXPECT_NEAR(v.value_m, 0, 2e-5 * kReach);
        for (int axis = 0; axis < 3; ++axis) {
            Vec3 by;
            by[axis] = step;
            const double slope = (probe->of(there.primitive, *on + by).value_m -
                                  probe->of(there.primitive, *on - by).value_m) /
                                 (2 * step);
            worst_slope = std::max(worst_slope, std::fabs(slope - v.gradient[axis]));
        }
        const double away = length(*on - p) + 1e-9;
        if (away > kReach)
            continue;
        std::vector<Primitive> near;
        probe->near(p, away, near);
        EXPECT_TRUE(std::is_sorted(near.begin(), near.end()));
        n_missed += std::find(near.begin(), near.end(), there.primitive) == near.end();
        if (const auto s = probe->ball(there.primitive)) {
            EXPECT_NEAR(std::fabs(length(*on - s->center) - s->radius_m), 0, 1e-5 * kReach);
        }
    }
    EXPECT_GT(n_faces, n / 20);
    EXPECT_LE(worst, tolerance_vox * kVoxel);
    if (smooth) {
        EXPECT_LE(n_bent, n / 7 / 20); // few points lie there
        EXPECT_LE(worst_slope, 0.02);  // some parts bend at single places: edges of rounded boxes
    }
    EXPECT_EQ(n_missed, 0u);
    EXPECT_EQ(n_outside, 0u);
}

// Grids are floats of a few voxels: 1e-6 of one; kernels of balls work in float.
constexpr double kExact = 1e-4;

TEST(Probes, OfBalls) {
    std::vector<Sphere> balls;
    for (std::uint64_t i = 0; i < 200; ++i)
        balls.push_back({random_vec(i) * 1.2, 0.05 + 0.3 * random_number(i, 7)});
    expect_probe(BallsField(balls), kExact);
}

TEST(Probes, OfEverySolid) {
    for (const PrimitiveSolid& shape :
         std::vector<PrimitiveSolid>{BallSolid{}, EllipsoidSolid{{0.7, 0.4, 0.5}}, BoxSolid{},
                                     BoxSolid{{0.5, 0.4, 0.6}, 0.2}, CylinderSolid{0.5, 0.4, 0},
                                     CylinderSolid{0.5, 0.4, 0.2}, ConeSolid{0.6, 0.2, 0.5},
                                     ConeSolid{}, CapsuleSolid{0.3, 0.4}, TorusSolid{0.5, 0.2}}) {
        SCOPED_TRACE(shape.index());
        expect_probe(*solid(shape, tilted()), kExact);
    }
}

TEST(Probes, TellFacesOfSolidsApart) {
    const auto count = [](const Field& field) {
        const auto grid = rasterize(field, kLattice);
        const auto probe = field.probe(level_set_box(*grid).dilated(kVoxel), kReach);
        std::set<Primitive> seen;
        for (auto it = grid->cbeginValueOn(); it; ++it) {
            const auto c = it.getCoord();
            seen.insert(probe
                            ->at(kLattice.origin +
                                 Vec3{double(c.x()), double(c.y()), double(c.z())} * kVoxel)
                            .primitive);
        }
        EXPECT_LT(*seen.rbegin(), field.n_primitives());
        return seen.size();
    };
    EXPECT_EQ(count(*solid(BoxSolid{})), 6u);
    EXPECT_EQ(count(*solid(CylinderSolid{})), 3u);
    EXPECT_EQ(count(*solid(ConeSolid{0.5, 0.2, 0.4})), 3u);
    EXPECT_EQ(count(*solid(BoxSolid{{0.5, 0.5, 0.5}, 0.1})), 1u);
}

TEST(Probes, NumberPrimitivesTheSameInEveryRegion) {
    std::vector<Sphere> balls;
    for (std::uint64_t i = 0; i < 100; ++i)
        balls.push_back({random_vec(i), 0.2});
    const CombineField field(Combine::unite, {std::make_shared<BallsField>(balls),
                                              solid(BoxSolid{}), ball({2, 0, 0}, 0.5)});
    EXPECT_EQ(field.n_primitives(), 107u);
    const Vec3 p{0.7, 0.1, 0.2};
    const auto wide = field.probe({{-3, -3, -3}, {3, 3, 3}}, kReach);
    const auto tight = field.probe({p - Vec3{0.1, 0.1, 0.1}, p + Vec3{0.1, 0.1, 0.1}}, kReach);
    EXPECT_EQ(wide->at(p).primitive, tight->at(p).primitive);
    EXPECT_EQ(wide->at(p).value_m, tight->at(p).value_m);
    EXPECT_EQ(wide->at({2.5, 0, 0}).primitive, 106u);
    EXPECT_EQ(wide->ball(106)->radius_m, 0.5);
    EXPECT_FALSE(wide->ball(101));
}

TEST(Probes, OfDifferencesTurnWhatIsTakenAway) {
    const DifferenceField field(ball({}, 1), ball({0.8, 0, 0}, 0.5));
    expect_probe(field, kExact);
    const auto probe = field.probe({{-2, -2, -2}, {2, 2, 2}}, kReach);
    EXPECT_EQ(probe->at({-1.05, 0, 0}).primitive, 0u);
    const auto hole = probe->at({0.35, 0, 0});
    EXPECT_EQ(hole.primitive, 1u);
    EXPECT_NEAR(hole.value_m, 0.05, 1e-12);
    EXPECT_NEAR(probe->of(1, {0.35, 0, 0}).gradient.x, 1, 1e-12); // out of the solid, into the hole
}

TEST(Probes, OfSharpCombinations) {
    for (const Combine how : {Combine::unite, Combine::intersect, Combine::subtract})
        expect_probe(CombineField(how, {ball({}, 0.8), ball({0.5, 0, 0}, 0.6),
                                        solid(BoxSolid{{0.3, 1, 0.3}}, tilted())}),
                     kExact);
}

TEST(Probes, OfBlends) {
    for (const Combine how : {Combine::unite, Combine::intersect, Combine::subtract})
        expect_probe(CombineField(how, {ball({}, 0.8), ball({0.7, 0, 0}, 0.6)}, 0.2), kExact);
    // Where only one operand is near, it is its own primitive.
    const CombineField field(Combine::unite, {ball({}, 0.8), ball({0.7, 0, 0}, 0.6)}, 0.2);
    const auto probe = field.probe({{-2, -2, -2}, {2, 2, 2}}, kReach);
    EXPECT_EQ(probe->at({-0.8, 0, 0}).primitive, 0u);
    EXPECT_EQ(probe->at({1.3, 0, 0}).primitive, 1u);
    EXPECT_EQ(probe->at({0.5, 0.6, 0}).primitive, 2u);
}

TEST(Probes, OfOffsetsAndShells) {
    expect_probe(OffsetField(solid(BoxSolid{}), 0.1), kExact); // rounds the edges
    expect_probe(OffsetField(solid(BoxSolid{}), -0.1), kExact);
    expect_probe(ShellField(solid(CylinderSolid{}), 0.2, 0), kExact);
    expect_probe(CombineField(Combine::intersect, {ball({}, 0.8), std::make_shared<ComplementField>(
                                                                      ball({0.8, 0, 0}, 0.4))}),
                 kExact);
    const OffsetField grown(ball({1, 0, 0}, 0.5), 0.25);
    EXPECT_EQ(grown.probe({{-2, -2, -2}, {2, 2, 2}}, kReach)->ball(0)->radius_m, 0.75);
    const OffsetField wider_hole(std::make_shared<ComplementField>(ball({1, 0, 0}, 0.5)), -0.25);
    EXPECT_EQ(wider_hole.probe({{-2, -2, -2}, {2, 2, 2}}, kReach)->ball(0)->radius_m, 0.75);
}

TEST(Probes, OfFunctionsAndSuperquadrics) {
    expect_probe(
        AnalyticField({{-1, -1, -1}, {1, 1, 1}}, [](const Vec3& p) { return length(p) - 0.7; }),
        kExact);
    // A first order distance: right on the surface, 3 voxels off it half a voxel or so short.
    expect_probe(SuperquadricField({{0.8, 0.5, 0.6}, 0.6, 0.8}, tilted()), 0.8);
}

TEST(Probes, OfMeshes) {
    expect_probe(MeshField(close_mesh(placed(cube(), tilted()), "cube")), kExact);
    // Cubes that overlap, and a cavity.
    TriMesh many = cube({0.31, 0.27, 0.4});
    append(many, cube());
    TriMesh cavity = cube({-0.2, -0.2, -0.2}, 0.3);
    flip(cavity);
    append(many, cavity);
    expect_probe(MeshField(close_mesh(many, "cubes")), kExact);
    // Two that overlap: where both are is void, so faces bound the solid from either side.
    TriMesh two = cube({0.31, 0.27, 0.4});
    append(two, cube());
    expect_probe(MeshField(close_mesh(two, "cubes", {.shells = ShellRule::parity})), kExact);
}

TEST(Probes, TellSmoothPartsOfMeshesApart) {
    EXPECT_EQ(MeshField(close_mesh(cube(), "cube")).n_primitives(), 6u);
    const TriMesh ball =
        superquadric_mesh({.semi_axes_m = {0.5, 0.5, 0.5}, .vertical = 1, .around = 1}, 16);
    EXPECT_EQ(MeshField(close_mesh(ball, "ball")).n_primitives(), 1u);
    TriMesh both = cube();
    append(both, cube({3, 0, 0}));
    EXPECT_EQ(MeshField(close_mesh(both, "cubes")).n_primitives(), 12u);
}

TEST(Probes, OfLevelSets) {
    const auto grid = rasterize(*ball({0.1, 0, 0}, 0.7), kLattice);
    // Gradients of neighbouring cells differ.
    expect_probe(LevelSetField(grid), kExact, 1.2, false);
    expect_probe(PlacedLevelSetField(grid, tilted()), 0.05, 3, false); // trilinear both times
}

} // namespace
} // namespace taihu
