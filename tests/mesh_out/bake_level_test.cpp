#include "mesh_out/bake_level.h"

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "mesh_out/io/binary_detail.h"
#include "mesh_out/io/image_file.h"
#include "mesh_out/io/mesh_file.h"
#include "stats/core/file.h"
#include "tests/support/errors.h"
#include "tests/support/level_sets.h"
#include "tests/support/scratch.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/csg_field.h"

namespace taihu {
namespace {

constexpr double kVoxel = 0.08;
const std::vector<Sphere> kHoles = {
    {{0.7, 0, 0}, 0.5}, {{0, 0.6, 0}, 0.45}, {{-0.6, -0.3, 0}, 0.5}, {{0, 0.1, 0.1}, 0.4}};

struct Baked {
    LodChain chain;
    std::vector<BakedLevel> levels;
};

const Baked& baked() {
    static const Baked result = [] {
        const auto grid = holed_ball_grid(1, kVoxel, kHoles);
        const DifferenceField field(
            std::make_shared<BallsField>(std::vector<Sphere>{{{0, 0, 0}, 1}}),
            std::make_shared<BallsField>(kHoles));
        Baked out{make_lods(*grid, &field,
                            {.levels = bounds_by_factor(2, 0.5 * kVoxel, 2), .openness = false}),
                  {}};
        const double reach_m = 4 * kVoxel;
        const BakeSource fine = bake_source(*grid, field, reach_m, 8);
        for (const LodLevel& level : out.chain.levels)
            out.levels.push_back(bake_level(level, fine, {.reach_m = reach_m, .side_px = 256}));
        return out;
    }();
    return result;
}

std::vector<EncodedLevel> encoded() {
    std::vector<EncodedLevel> out;
    for (const BakedLevel& level : baked().levels)
        out.push_back(level.encoded);
    return out;
}

nlohmann::json json_of(const std::string& glb) {
    return nlohmann::json::parse(glb.substr(20, load_number<std::uint32_t>(glb.data() + 12)));
}

TEST(BakeLevel, KeepsTheFacesOfTheLevel) {
    for (std::size_t j = 0; j < 2; ++j) {
        const Certificate before = baked().chain.levels[j].certificate;
        const Certificate after = certify(baked().levels[j].encoded.decoded);
        EXPECT_TRUE(after.holds());
        EXPECT_EQ(after.n_triangles, before.n_triangles);
        EXPECT_EQ(after.genus, before.genus);
        EXPECT_EQ(after.n_vertices, before.n_vertices);
        EXPECT_EQ(after.n_self_intersections, before.n_self_intersections);
        EXPECT_NEAR(after.volume_m3, before.volume_m3, 1e-12);
    }
}

TEST(SeedRow, D10LevelsRelitByTheirMapsAreNearerToTheFineSurface) {
    for (const BakedLevel& level : baked().levels) {
        EXPECT_LT(level.relit.mean_deg, 5); // the row's bound
        EXPECT_LT(level.relit.mean_deg, 0.5 * level.relit.plain_mean_deg);
        // What a level lost lies within its bound, but where the normal grazes a rim.
        EXPECT_LT(static_cast<double>(level.maps.n_nearest),
                  0.02 * static_cast<double>(level.maps.n_texels));
    }
    for (std::size_t j = 0; j < 2; ++j)
        EXPECT_LT(baked().levels[j].maps.rms_displacement_m, baked().chain.levels[j].bound_m);
}

TEST(BakeLevel, MapsGrowWhereTexelsAreTooLargeForTheNormals) {
    const double reach_m = 4 * kVoxel;
    const auto grid = holed_ball_grid(1, kVoxel, kHoles);
    const DifferenceField field(std::make_shared<BallsField>(std::vector<Sphere>{{{0, 0, 0}, 1}}),
                                std::make_shared<BallsField>(kHoles));
    const BakeSource fine = bake_source(*grid, field, reach_m, 0);
    const LodLevel& level = baked().chain.levels[0];
    const auto bake = [&](int most_side_px) {
        return bake_level(level, fine,
                          {.reach_m = reach_m, .side_px = 64, .most_side_px = most_side_px});
    };
    const BakedLevel small = bake(0), large = bake(512);
    EXPECT_EQ(small.maps.normal.width, 64);
    EXPECT_GT(small.relit.mean_deg, 5);
    EXPECT_GT(large.maps.normal.width, 64);
    EXPECT_LE(large.relit.mean_deg, 5);
}

TEST(BakeLevel, IsReadBackFromItsFile) {
    const std::string glb = format_glb(encoded());
    const MeshFile file = parse_mesh(glb, MeshFormat::glb, "rock.glb");
    ASSERT_EQ(file.levels.size(), 2u);
    for (std::size_t j = 0; j < 2; ++j) {
        EXPECT_TRUE(certify(file.levels[j]).holds());
        EXPECT_EQ(file.levels[j].triangles.size(),
                  baked().levels[j].encoded.decoded.triangles.size());
    }
}

TEST(BakeLevel, HasMaterialsWithItsImages) {
    const std::string glb = format_glb(encoded());
    const nlohmann::json json = json_of(glb);
    ASSERT_EQ(json["materials"].size(), 2u);
    ASSERT_EQ(json["images"].size(), 4u);
    const std::size_t bin = 20 + load_number<std::uint32_t>(glb.data() + 12) + 8;
    const Scratch folder;
    for (std::size_t j = 0; j < 2; ++j) {
        const auto& primitive = json["meshes"][j]["primitives"][0];
        EXPECT_EQ(primitive["material"], j);
        for (const char* name : {"TEXCOORD_0", "TANGENT"}) {
            EXPECT_TRUE(primitive["attributes"].contains(name));
            EXPECT_TRUE(
                primitive["extensions"]["KHR_draco_mesh_compression"]["attributes"].contains(name));
        }
        EXPECT_FALSE(primitive["attributes"].contains("COLOR_0")); // the texture says it
        const auto image = [&](const char* texture) {
            const auto& view =
                json["bufferViews"]
                    [json["images"][json["textures"][json["materials"][j][texture]["index"]
                                                         .get<std::size_t>()]["source"]
                                        .get<std::size_t>()]["bufferView"]
                         .get<std::size_t>()];
            write_file(folder / "map.png", glb.substr(bin + view["byteOffset"].get<std::size_t>(),
                                                      view["byteLength"].get<std::size_t>()));
            return read_png(folder / "map.png", PngValues::data);
        };
        const Image normal = image("normalTexture"), occlusion = image("occlusionTexture");
        EXPECT_EQ(normal.width, 256);
        EXPECT_EQ(occlusion.channels, 1);
        const Image& truth = baked().levels[j].maps.normal;
        for (std::size_t i = 0; i < truth.pixels.size(); ++i)
            ASSERT_NEAR(normal.pixels[i], (truth.pixels[i] + 1) / 2, 1.0 / 255);
    }
}

TEST(EncodeDraco, KeepsTexturePointsBitForBitAndTangentsWithinEightBits) {
    const BakedLevel& level = baked().levels.back();
    const EncodedLevel& e = level.encoded;
    ASSERT_EQ(e.texture.size(), e.decoded.positions.size());
    for (std::size_t i = 0; i < e.texture.size(); ++i) {
        const double u = e.texture[i].u * 4096; // 256 texels of 16 steps
        ASSERT_EQ(u, std::floor(u));
        ASSERT_NEAR(length(e.tangents[i]), 1, 1e-12);
        // 8 bits of -1..1, and 10 bits of the normal: twice what they round, at the most.
        ASSERT_NEAR(dot(e.tangents[i], normalized(e.decoded.normals[i])), 0, 0.02);
    }
}

TEST(EncodeDraco, RefusesTexturePointsOffAnyGrid) {
    const EncodedLevel& e = baked().levels.back().encoded;
    TexturedMesh textured{e.decoded, e.texture, e.tangents};
    const PositionGrid grid = baked().chain.levels.back().grid;
    EXPECT_NO_THROW(encode_draco(textured, grid));
    textured.texture[5].u = 1.0 / 3;
    expect_error(Fault::bad_argument, "texture[5] is on no grid of 18 bits within 0..1",
                 [&] { encode_draco(textured, grid); });
    textured.texture.pop_back();
    expect_error(Fault::bad_argument, "a texture point and a tangent for each position",
                 [&] { encode_draco(textured, grid); });
}

TEST(FormatGlb, RefusesImagesWithoutTexturePoints) {
    std::vector<EncodedLevel> levels = encoded();
    levels[1].texture.clear();
    levels[1].tangents.clear();
    expect_error(Fault::bad_argument, "levels[1] has images without texture points",
                 [&] { format_glb(levels); });
}

} // namespace
} // namespace taihu
