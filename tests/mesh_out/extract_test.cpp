#include "mesh_out/extract.h"

#include <numbers>

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include "mesh_out/certificate.h"
#include "stats/core/error.h"
#include "stats/core/rng.h"
#include "tests/support/level_sets.h"
#include "vdb_ops/clean.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/shapes.h"

namespace taihu {
namespace {

using testing::HasSubstr;

const std::vector<Sphere> kHoles = {
    {{0.6, 0, 0}, 0.5}, {{-0.2, 0.7, 0.1}, 0.4}, {{0, 0, 0.3}, 0.45}, {{0, 0, 0.95}, 0.4}};

void expect_message(const openvdb::FloatGrid& grid, Fault fault, const std::string& text) {
    try {
        extract_uniform(grid);
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), fault);
        EXPECT_THAT(e.what(), HasSubstr(text));
    }
}

TEST(Extract, GivesABallItsVolumeAndPlace) {
    const TriMesh mesh = extract_uniform(*ball_grid(1, 0.05));
    const double ball_m3 = 4.0 / 3 * std::numbers::pi;
    // The chords of a dual mesh cut off about (voxel / radius)^2 / 4 of the radius.
    EXPECT_NEAR(signed_volume_m3(mesh), ball_m3, 0.003 * ball_m3);
    for (const Vec3& p : mesh.positions)
        EXPECT_NEAR(length(p), 1, 0.05 * 0.05); // voxel^2 / radius
}

TEST(Extract, MakesASolidOfAFractalRockThatCrossesItself) {
    const ShapeSettings settings{
        .kind = ShapeKind::fractal_rock,
        .fractal = {.base = 0, .iterations = 2, .along = DisplaceAlong::normal, .amplitude = 0.8}};
    const TriMesh rock = shape_mesh(settings);
    const Certificate crossed = certify(rock);
    EXPECT_TRUE(crossed.holds());
    EXPECT_GT(crossed.n_self_intersections, 100u);
    const auto solid = rasterize(*shape_field(settings), {0.02, {}, 3});
    const Certificate c = certify(extract_uniform(*clean(*solid).solid));
    EXPECT_TRUE(c.holds());
    EXPECT_EQ(c.n_components, 1u);
    EXPECT_LT(c.n_self_intersections, crossed.n_self_intersections / 20);
    // Folds count twice in the mesh, or not at all where they are inside out.
    EXPECT_NEAR(c.volume_m3, crossed.volume_m3, 0.1 * crossed.volume_m3);
}

TEST(Certificate, HoldsForFractalRocksOfAnySettings) {
    for (std::uint64_t i = 0; i < 40; ++i) {
        const auto at = [i](std::uint32_t draw) { return Rng{3, 8}.uniform(i, draw); };
        ShapeSettings s{.kind = ShapeKind::fractal_rock,
                        .size_m = {0.1 + at(0), 0.1 + 3 * at(1), 0.1 + at(2)}};
        s.fractal = {.base = i % 3 == 0 ? 1 : 0,
                     .iterations = i % 2 == 0 ? 2 : 1,
                     .damping = static_cast<Damping>(i % 3),
                     .along = static_cast<DisplaceAlong>(i / 3 % 2),
                     .amplitude = at(3),
                     .hurst_up = 0.05 + 1.95 * at(4),
                     .hurst_down = 0.05 + 1.95 * at(5),
                     .corners = at(6),
                     .roundness = at(7)};
        s.seed = i;
        const Certificate c = certify(shape_mesh(s), {.self_intersections = false});
        EXPECT_TRUE(c.holds()) << i;
        EXPECT_EQ(c.n_components, 1u) << i;
        EXPECT_EQ(c.genus, 0) << i;
    }
}

TEST(Extract, IsCertifiedWithHolesThatCutEachOther) {
    const Certificate c = certify(extract_uniform(*holed_ball_grid(1, 0.04, kHoles)));
    EXPECT_TRUE(c.holds()) << testing::PrintToString(faults(c));
    EXPECT_EQ(c.n_merged_positions, 0u);
}

TEST(Extract, KeepsPointsApartWhereTheFieldTouchesZeroOnVoxels) {
    // Voxels that are inside by almost nothing, alone, in a row and as corner neighbours.
    const auto grid = ball_grid(0.5, 0.1);
    auto accessor = grid->getAccessor();
    for (int x = 10; x < 20; ++x)
        for (int y = -5; y < 5; ++y)
            for (int z = -5; z < 5; ++z)
                accessor.setValue({x, y, z}, 0.1f);
    for (const openvdb::Coord& at :
         {openvdb::Coord(12, 0, 0), openvdb::Coord(14, 2, 1), openvdb::Coord(15, 2, 1),
          openvdb::Coord(17, -3, -3), openvdb::Coord(18, -2, -2)})
        accessor.setValue(at, -1e-30f);
    const Certificate c = certify(extract_uniform(*grid));
    EXPECT_TRUE(c.holds()) << testing::PrintToString(faults(c));
    EXPECT_EQ(c.n_merged_positions, 0u);
    EXPECT_GE(c.n_components, 4u);
}

TEST(Extract, SplitsQuadsWhereTheSurfaceIs) {
    // Along the rim of a cut ball the wrong diagonals stand off the surface by half a voxel.
    const double voxel = 0.05;
    const std::vector<Sphere> cut = {{{0, 0, 2}, 1.6}};
    const TriMesh mesh = extract_uniform(*holed_ball_grid(1, voxel, cut));
    const auto field = [&](const Vec3& p) {
        return std::max(length(p) - 1, 1.6 - length(p - Vec3{0, 0, 2}));
    };
    for (std::size_t i = 0; i < mesh.triangles.size(); i += 2) {
        const Triangle &s = mesh.triangles[i], &t = mesh.triangles[i + 1];
        // Either {a, b, c}, {a, c, d} along a-c, or {b, c, d}, {b, d, a} along b-d.
        const std::array<std::uint32_t, 2> used = {t[0], t[1]}, other = {s[1], t[2]};
        const auto off = [&](const std::array<std::uint32_t, 2>& edge) {
            return std::abs(field((mesh.positions[edge[0]] + mesh.positions[edge[1]]) * 0.5));
        };
        // The choice is made on the trilinear field, which differs from this one by about
        // voxel^2 / (4 radius) where it is smooth and by a share of a voxel at the rim.
        EXPECT_LE(off(used), off(other) + 0.25 * voxel);
    }
}

TEST(Extract, IsBitIdenticalOnOneThreadAndMany) {
    const auto grid = holed_ball_grid(1, 0.04, kHoles);
    const TriMesh many = extract_uniform(*grid);
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    const TriMesh one = extract_uniform(*grid);
    EXPECT_EQ(one.positions, many.positions);
    EXPECT_EQ(one.triangles, many.triangles);
}

TEST(Extract, SaysWhenNothingIsLeft) {
    const std::vector<Sphere> all = {{{0, 0, 0}, 2}};
    expect_message(*holed_ball_grid(0.5, 0.1, all), Fault::bad_argument,
                   "nothing is left of the solid");
}

TEST(Extract, RefusesWhatIsNoLevelSet) {
    const auto grid = ball_grid(0.5, 0.1);
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    expect_message(*grid, Fault::bad_argument, "'fog volume', must be a level set");
}

TEST(Extract, RefusesAClippedBand) {
    const auto grid = ball_grid(0.5, 0.05);
    auto accessor = grid->getAccessor();
    for (auto value = grid->cbeginValueOn(); value; ++value)
        if (value.getCoord().x() > 5)
            accessor.setValueOff(value.getCoord(), std::numeric_limits<float>::quiet_NaN());
    for (int y = -15; y <= 15; ++y)
        for (int z = -15; z <= 15; ++z)
            for (int x = 6; x <= 15; ++x)
                accessor.setValueOff({x, y, z}, grid->background());
    expect_message(*grid, Fault::numeric, "leaves the narrow band");
}

TEST(SurfaceNormals, OfABallPointAwayFromItsCentre) {
    const auto grid = ball_grid(1, 0.05);
    const TriMesh mesh = extract_uniform(*grid);
    const std::vector<Vec3> normals = surface_normals(*grid, mesh.positions);
    ASSERT_EQ(normals.size(), mesh.positions.size());
    for (std::size_t i = 0; i < normals.size(); ++i) {
        EXPECT_NEAR(length(normals[i]), 1, 1e-12);
        EXPECT_GT(dot(normals[i], normalized(mesh.positions[i])), 0.999); // 2.6 degrees
    }
}

TEST(SurfaceNormals, AreUnitVectorsEvenWhereTheFieldIsFlat) {
    const auto grid = ball_grid(1, 0.1);
    EXPECT_EQ(surface_normals(*grid, {{0, 0, 0}}).at(0), (Vec3{0, 1, 0}));
}

} // namespace
} // namespace taihu
