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
    std::vector<ShapeSettings> all;
    for (const char* name :
         {"sphere", "ellipsoid", "box", "cylinder", "torus", "icosphere", "boulder"}) {
        ShapeSettings s{.kind = shape_kind(name), .tube_m = 0.3, .subdivisions = 4};
        if (s.kind == ShapeKind::ellipsoid || s.kind == ShapeKind::box ||
            s.kind == ShapeKind::boulder)
            s.size_m = {1, 0.8, 0.6};
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
        {"cylinder", kPi / 4},
        {"torus", 2 * kPi * kPi * 0.35 * 0.15 * 0.15}};
    for (const ShapeSettings& s : all_kinds()) {
        const auto grid = rasterize(*shape_field(s), {1.0 / 64, {}, 3});
        const auto it = expected.find(shape_name(s.kind));
        const double exact = it != expected.end() ? it->second : signed_volume_m3(shape_mesh(s));
        // Edges of box and cylinder cost a fraction of a voxel squared along their length.
        EXPECT_NEAR(volume_m3(*grid), exact, 2e-3 * exact) << shape_name(s.kind);
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
    expect_error(Fault::bad_argument, "size_m.y", [] { shape_mesh({.size_m = {1, 0, 1}}); });
    expect_error(Fault::bad_argument, "relief", [] { shape_mesh({.relief = 2}); });
    expect_error(Fault::bad_argument, "use ellipsoid", [] {
        shape_mesh({.kind = ShapeKind::sphere, .size_m = {1, 2, 1}});
    });
    expect_error(Fault::bad_argument, "tube_m",
                 [] { shape_mesh({.kind = ShapeKind::torus, .tube_m = 0.6}); });
}

} // namespace
} // namespace taihu
