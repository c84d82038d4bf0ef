#include "vdb_ops/shapes.h"

#include <map>
#include <numbers>

#include "tests/support/errors.h"
#include "tests/support/grids.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

constexpr double kPi = std::numbers::pi;

std::vector<ShapeSettings> all_kinds() {
    using enum ShapeKind;
    std::vector<ShapeSettings> all;
    for (const ShapeKind kind : {sphere, ellipsoid, box, rounded_box, cylinder, capsule, torus,
                                 superquadric, icosphere, boulder, fractal_rock}) {
        ShapeSettings s{.kind = kind, .tube_m = 0.3, .subdivisions = 4};
        if (kind == capsule)
            s.size_m = {0.6, 1, 0.6};
        else if (kind != sphere && kind != cylinder && kind != torus)
            s.size_m = {1, 0.8, 0.6};
        s.round_m = 0.1;
        s.vertical = 0.5;
        s.around = 1;
        all.push_back(s);
    }
    return all;
}

TEST(Shapes, MeshesAreClosedAndOutward) {
    for (const ShapeSettings& s : all_kinds()) {
        const TriMesh mesh = shape_mesh(s);
        std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
        for (const Triangle& t : mesh.triangles)
            for (std::size_t k = 0; k < 3; ++k)
                ++edges[{t[k], t[(k + 1) % 3]}];
        for (const auto& [edge, n] : edges) {
            ASSERT_EQ(n, 1) << shape_name(s.kind);
            ASSERT_EQ(edges.count({edge.second, edge.first}), 1u) << shape_name(s.kind);
        }
        EXPECT_GT(signed_volume_m3(mesh), 0) << shape_name(s.kind);
    }
}

TEST(Shapes, FieldsHaveTheirAnalyticVolumes) {
    const std::map<std::string_view, double> expected = {
        {"sphere", kPi / 6},
        {"ellipsoid", kPi / 6 * 0.8 * 0.6},
        {"box", 0.8 * 0.6},
        // Core 0.8 x 0.6 x 0.4 grown by 0.1 (Steiner).
        {"rounded_box",
         0.192 + 0.1 * 2 * (0.48 + 0.32 + 0.24) + kPi * 0.01 * 1.8 + 4.0 / 3 * kPi * 0.001},
        {"cylinder", kPi / 4},
        {"capsule", kPi * 0.09 * 0.4 + 4.0 / 3 * kPi * 0.027},
        // Sections at height y are ellipses of area pi a c (1 - |y / b|^4)^(1/2).
        {"superquadric",
         kPi * 0.5 * 0.3 * 0.4 * std::tgamma(0.25) * std::tgamma(1.5) / std::tgamma(1.75) / 2},
        {"torus", 2 * kPi * kPi * 0.35 * 0.15 * 0.15}};
    for (const ShapeSettings& s : all_kinds()) {
        const auto grid = rasterize(*shape_field(s), {1.0 / 64, {}, 3});
        const auto it = expected.find(shape_name(s.kind));
        const double exact = it != expected.end() ? it->second : signed_volume_m3(shape_mesh(s));
        // Edges of box and cylinder cost a fraction of a voxel squared along their length.
        EXPECT_NEAR(volume_m3(*grid), exact, 2e-3 * exact) << shape_name(s.kind);
    }
}

TEST(Shapes, MeshesFollowTheirFields) {
    for (const ShapeSettings& s : all_kinds()) {
        const auto field = shape_field(s);
        const Lattice lattice{1.0 / 40, {0.001, 0.002, 0.003}, 3};
        const auto grid = rasterize(*field, lattice);
        const Box box = bounds(shape_mesh(s)), stated = shape_box(s);
        // Meshes of 32 sides lie within the shape by 1 - cos(pi / 32) of the radius at most.
        EXPECT_LE(length(box.lo - stated.lo) + length(box.hi - stated.hi), 0.01)
            << shape_name(s.kind);
        for (const Vec3& p : shape_mesh(s).positions) {
            const Vec3 at = (p - lattice.origin) / lattice.voxel_m;
            const openvdb::Coord c(static_cast<int>(std::lround(at.x)),
                                   static_cast<int>(std::lround(at.y)),
                                   static_cast<int>(std::lround(at.z)));
            // Vertices are on the surface, half a diagonal of a voxel from the next voxel at most.
            ASSERT_LE(std::fabs(grid->tree().getValue(c)), 0.88 * lattice.voxel_m)
                << shape_name(s.kind);
        }
    }
}

TEST(Shapes, FieldsTakeTheirPlace) {
    const Similarity at = Similarity::translation({0.2, -0.1, 0.3}) *
                          Similarity::rotation({1, 2, 3}, 0.8) * Similarity::scaling(0.7);
    for (const ShapeSettings& s : all_kinds()) {
        const double volume = volume_m3(*rasterize(*shape_field(s), {1.0 / 64, {}, 3}));
        const auto moved = rasterize(*shape_field(s, at), {0.7 / 64, {}, 3});
        // Edges on another lattice: fractions of a voxel squared along their length.
        EXPECT_NEAR(volume_m3(*moved), 0.343 * volume, 4e-3 * volume) << shape_name(s.kind);
        const Vec3 middle = at.point({});
        const bool inside = moved->tree().getValue(moved->transform().worldToIndexCellCentered(
                                {middle.x, middle.y, middle.z})) < 0;
        EXPECT_EQ(inside, s.kind != ShapeKind::torus) << shape_name(s.kind);
    }
}

TEST(Shapes, ATorusIsAsHighAsItsTube) {
    const ShapeSettings ring{.kind = ShapeKind::torus, .size_m = {1, 0.02, 1}, .tube_m = 0.3};
    EXPECT_NEAR(shape_box(ring).size().y, 0.3, 1e-12);
    const double exact = 2 * kPi * kPi * 0.35 * 0.15 * 0.15;
    EXPECT_NEAR(volume_m3(*rasterize(*shape_field(ring), {1.0 / 64, {}, 3})), exact, 2e-3 * exact);
}

TEST(Shapes, BoulderFillsItsSizeAndFollowsItsSeed) {
    ShapeSettings s{.size_m = {1, 2, 0.5}, .subdivisions = 3, .seed = 7};
    const TriMesh a = shape_mesh(s);
    const Box box = bounds(a);
    EXPECT_NEAR(box.size().x, 1, 1e-12);
    EXPECT_NEAR(box.size().y, 2, 1e-12);
    EXPECT_NEAR(box.size().z, 0.5, 1e-12);
    EXPECT_EQ(shape_mesh(s).positions, a.positions);
    s.seed = 8;
    EXPECT_NE(shape_mesh(s).positions, a.positions);
}

TEST(Shapes, BoulderBytesAreTheSameOnEveryPlatform) {
    const TriMesh mesh = shape_mesh({.subdivisions = 2, .seed = 3});
    std::string bytes(reinterpret_cast<const char*>(mesh.positions.data()),
                      mesh.positions.size() * sizeof(Vec3));
    EXPECT_EQ(sha256_hex(bytes).substr(0, 16), "25a1ca99a75a3f7e");
}

TEST(Shapes, RefuseSettingsOutOfRangeByName) {
    expect_error(Fault::bad_argument, "did you mean 'boulder'?", [] { shape_kind("bolder"); });
    expect_error(Fault::bad_argument, "rounded_box, cylinder, capsule",
                 [] { shape_kind("plane"); });
    expect_error(Fault::bad_argument, "size_m.y", [] { shape_mesh({.size_m = {1, 0, 1}}); });
    expect_error(Fault::bad_argument, "relief", [] { shape_mesh({.relief = 2}); });
    expect_error(Fault::bad_argument, "use ellipsoid", [] {
        shape_mesh({.kind = ShapeKind::sphere, .size_m = {1, 2, 1}});
    });
    expect_error(Fault::bad_argument, "tube_m",
                 [] { shape_mesh({.kind = ShapeKind::torus, .tube_m = 0.6}); });
    expect_error(Fault::bad_argument, "a capsule is at least as high", [] {
        shape_mesh({.kind = ShapeKind::capsule, .size_m = {1, 0.5, 1}});
    });
    expect_error(Fault::bad_argument, "round_m", [] {
        shape_mesh({.kind = ShapeKind::rounded_box, .size_m = {1, 0.3, 1}, .round_m = 0.2});
    });
    expect_error(Fault::bad_argument, "shape.around is 2.5",
                 [] { shape_field({.kind = ShapeKind::superquadric, .around = 2.5}); });
}

} // namespace
} // namespace taihu
