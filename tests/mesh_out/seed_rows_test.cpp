// Claims of the papers on rugged texture and on fractal rocks that take several modules, by the
// numbers of their rows in the list of what the source texts can do.
#include <cmath>
#include <ctime>

#include <gtest/gtest.h>

#include "mesh_out/certificate.h"
#include "mesh_out/extract.h"
#include "mesh_out/render.h"
#include "vdb_ops/recipe_solid.h"
#include "vdb_ops/relief.h"
#include "vdb_ops/relief_around.h"
#include "vdb_ops/shapes.h"

namespace taihu {
namespace {

TriMesh ball() {
    return shape_mesh({.kind = ShapeKind::icosphere, .size_m = {1, 1, 1}, .subdivisions = 5});
}

openvdb::FloatGrid::Ptr made(const std::string& solid) {
    return make_recipe(R"({"taihu_recipe": 1, "voxel_m": 0.02, "solid": )" + solid + "}", "r.json",
                       {})
        .solid;
}

const std::string kRough =
    R"("relief": "fractal", "amplitude_m": 0.04, "largest_m": 0.3, "seed": 5)";

TEST(SeedRow, T21TheFrameOfTheSphereTakesLessThanItsFiveMinutes) {
    const std::clock_t begin = std::clock();
    const ReliefPreset& rock = relief_preset("broken-rock");
    const ReliefTile tile = make_relief(rock.settings);
    const TriMesh mesh = ball();
    const ReliefAround around(tile.heights, tile.pixel_m, tile.tileable, ReliefMap::sphere,
                              bounds(mesh));
    RenderSettings look{.width = 213, .height = 213};
    look.plain = PlainLight{rock.material.reflection, rock.material.color, {}};
    look.normal_at = [&](const Vec3& p, const Vec3& n) { return around.bumped(p, n); };
    const Image frame = render(mesh, look);
    const double took_s = double(std::clock() - begin) / CLOCKS_PER_SEC; // of processor time
    EXPECT_LT(took_s, 300);                                              // a quarter of a second

    look.normal_at = nullptr;
    look.plain->reflection = {.ambient = 0, .diffuse = 0, .specular = 0};
    const Image black = render(mesh, look);
    double width_px = 0, contrast = 0;
    for (int x = 0; x < 213; ++x) {
        const bool on_ball = *black.at(x, 106) == 0;
        width_px += on_ball;
        if (on_ball && x > 0)
            contrast = std::max(
                contrast, std::abs(double(*frame.at(x, 106)) - double(*frame.at(x - 1, 106))));
    }
    EXPECT_NEAR(width_px / 2, 100, 1); // pixels: the sphere of the paper
    EXPECT_GT(contrast, 0.05);         // and rugged: a smooth one changes by a hundredth
}

TEST(SeedRow, D19DisplacementMovesThePositionsOfALevelSet) {
    const auto grid =
        made(R"({"rough": {"of": {"sphere": {"size_m": [1, 1, 1]}}, )" + kRough + "}}");
    const TriMesh rough = extract_uniform(*grid);
    EXPECT_TRUE(certify(rough).holds());
    double least = 1e9, most = 0;
    for (const Vec3& p : rough.positions) {
        least = std::min(least, length(p));
        most = std::max(most, length(p));
    }
    // Smooth, all lie within a hundredth of a voxel of 0.5; the amplitude is two voxels.
    EXPECT_LT(least, 0.48);
    EXPECT_GT(most, 0.52);
}

TEST(SeedRow, D19ATileMovesVerticesByItsHeights) {
    TriMesh mesh = ball();
    mesh.normals.clear();
    for (const Vec3& p : mesh.positions)
        mesh.normals.push_back(normalized(p));
    const ReliefTile tile = make_relief({.size_px = 65, .pixel_m = 0.02, .amplitude_m = 0.1});
    const ReliefAround around(tile.heights, tile.pixel_m, false, ReliefMap::sphere, bounds(mesh));
    const TriMesh moved = around.displaced(mesh);
    double furthest = 0;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        const double height = around.height_m(mesh.positions[i], mesh.normals[i]);
        EXPECT_NEAR(length(moved.positions[i]) - length(mesh.positions[i]), height, 1e-9);
        furthest = std::max(furthest, std::abs(height));
    }
    EXPECT_GT(furthest, 0.02);
    EXPECT_EQ(moved.triangles, mesh.triangles);
}

TEST(SeedRow, D20ASolidTextureNeedsNoCoordinatesAndReachesIntoHoles) {
    const std::string block = R"({"box": {"size_m": [1, 1, 0.6]}})",
                      hole = R"({"transform": {"of": {"cylinder": {"size_m": [0.5, 1, 0.5]}},
                                 "axis": [1, 0, 0], "angle_deg": 90}})";
    const auto rough = [](const std::string& of) {
        return made(R"({"rough": {"of": )" + of + ", " + kRough + "}}");
    };
    const auto whole = rough(block),
               holed = rough(R"({"difference": {"of": [)" + block + ", " + hole + "]}}");
    const TriMesh surface = extract_uniform(*holed);
    EXPECT_EQ(certify(surface).genus, 1); // which has no texture coordinates without a seam
    // Far from the hole the stone has the same texture, as that depends on the place alone.
    const auto in_whole = whole->getConstAccessor(), in_holed = holed->getConstAccessor();
    int n_same = 0;
    for (int y = -20; y <= 20; ++y)
        for (int z = -10; z <= 10; ++z)
            for (int x = 23; x <= 27; ++x) {
                const float a = in_whole.getValue({x, y, z}), b = in_holed.getValue({x, y, z});
                EXPECT_NEAR(a, b, 1e-3); // a twentieth of a voxel: both were redistanced
                n_same += std::abs(a) < 0.03F;
            }
    EXPECT_GT(n_same, 1000);
    // The wall of the hole is as rough as that: smooth, its radius is 0.25 within a hundredth.
    double least = 1e9, most = 0;
    for (const Vec3& p : surface.positions)
        if (std::abs(p.z) < 0.2 && std::hypot(p.x, p.y) < 0.4) {
            least = std::min(least, std::hypot(p.x, p.y));
            most = std::max(most, std::hypot(p.x, p.y));
        }
    EXPECT_GT(most - least, 0.03);
}

TEST(SeedRow, D23ATextureHasNoGeometry) {
    const TriMesh mesh = ball();
    const ReliefTile tile = make_relief({.size_px = 65, .pixel_m = 0.02, .amplitude_m = 0.1});
    const ReliefAround around(tile.heights, tile.pixel_m, false, ReliefMap::triplanar,
                              bounds(mesh));
    const Certificate smooth = certify(mesh);
    const auto stone = made(R"({"difference": {"of": [{"sphere": {"size_m": [1, 1, 1]}},
                                {"capsule": {"size_m": [0.3, 1.5, 0.3]}}]}})");
    EXPECT_EQ(smooth.genus, 0);
    EXPECT_EQ(certify(around.displaced(mesh)).genus, 0); // whatever heights make of a ball
    EXPECT_EQ(certify(extract_uniform(*stone)).genus, 1);
}

} // namespace
} // namespace taihu
