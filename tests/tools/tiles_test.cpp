// Tiles, estimates and refusals through the program.
#include <string>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "stats/core/file.h"
#include "tests/support/command.h"
#include "tests/support/grids.h"
#include "vdb_ops/tiles.h"
#include "vdb_ops/vdb_file.h"

namespace taihu {
namespace {

using nlohmann::json;
using testing::HasSubstr;

std::string whole_hash(const std::filesystem::path& file) {
    return grid_hash(*read_vdb(file).solid);
}

std::string tiles_hash(const std::filesystem::path& folder) {
    return grid_hash(*read_tiles(folder / kTileSetName));
}

void write_sponge(const Scratch& folder) {
    write_file(folder / "sponge.json",
               R"({"taihu_recipe": 1, "solid": {"clean": {"of": {"difference": {"of": [
               {"boulder": {"size_m": [1, 0.62, 0.75], "subdivisions": 6, "relief": 0.18,
               "lumps": 1.2}}, {"holes": {"law": {"family": "lognormal", "parameters":
               {"mean_log": -3, "sd_log": 0.45}}, "porosity": 0.62}}]}}}}})");
}

TEST(TileCommands, ARecipeInTilesIsTheWhole) {
    const Scratch folder;
    write_sponge(folder);
    const std::string rock = "taihu rock sponge.json --dim 150 --height 1.8m --seed 7 ";
    must(rock + "-o whole.vdb -q", folder);
    const json made = result(rock + "--tiles 128 -o tiles", folder);
    EXPECT_GT(made["tiles"], 1);
    EXPECT_GT(made["bubbles_filled"], 0);
    EXPECT_EQ(tiles_hash(folder / "tiles"), whole_hash(folder / "whole.vdb"));
    const json info = result("taihu info tiles/tiles.json", folder);
    EXPECT_EQ(info["kind"], "level set in tiles");
    EXPECT_EQ(info["recipe"], result("taihu info whole.vdb", folder)["recipe"]);
    const std::string tile = read_tile_set(folder / "tiles" / kTileSetName).tiles[0].file;
    const json one = result("taihu info tiles/" + tile, folder);
    EXPECT_EQ(one["kind"], "tile of a level set");
    EXPECT_EQ(one["tile"]["of"], "tiles.json");
    // By itself it is a closed solid.
    must("taihu mesh tiles/" + tile + " -o tile.ply -q", folder);
    EXPECT_GT(result("taihu measure tiles/" + tile, folder)["volume_m3"], 0);
}

TEST(TileCommands, AMeshOfTilesIsOneClosedSurface) {
    const Scratch folder;
    write_sponge(folder);
    must("taihu rock sponge.json --dim 150 --height 1.8m --seed 7 --tiles 128 -o tiles", folder);
    const json made = result("taihu mesh tiles/tiles.json -o rock.ply", folder)["certificate"];
    EXPECT_TRUE(made["holds"]);
    EXPECT_EQ(made["self_intersections"], 0);
    const json seen = result("taihu check rock.ply", folder);
    const json& one = seen["levels"][0];
    for (const char* key : {"holds", "vertices", "triangles", "components", "genus"})
        EXPECT_EQ(made[key], one[key]) << key;
    EXPECT_NEAR(made["volume_m3"], one["volume_m3"], 1e-9);
    const Finished simpler =
        run("taihu mesh tiles/tiles.json --max-error 1mm -o a.ply", folder.path());
    EXPECT_EQ(simpler.exit_code, 2);
    EXPECT_THAT(simpler.err, HasSubstr("not simplified; drop --max-error"));
    const Finished other = run("taihu mesh tiles/tiles.json -o a.glb", folder.path());
    EXPECT_EQ(other.exit_code, 1);
    EXPECT_THAT(other.err, HasSubstr("is written as .ply"));
}

TEST(TileCommands, HolesCarvedInTilesAreThoseOfTheWhole) {
    const Scratch folder;
    must("taihu shape sphere --dim 150 -o base.vdb -q", folder);
    write_file(folder / "holes.csv",
               "x_m,y_m,z_m,radius_m\n0,0,0,0.2\n0.4,0.1,0,0.15\n0,0,0.5,0.3\n");
    must("taihu carve base.vdb --holes holes.csv -o whole.vdb -q", folder);
    must("taihu carve base.vdb --holes holes.csv --tiles 128 -o tiles -q", folder);
    EXPECT_EQ(tiles_hash(folder / "tiles"), whole_hash(folder / "whole.vdb"));
    const Finished clash =
        run("taihu carve base.vdb --holes holes.csv --tiles 128 -o whole.vdb", folder.path());
    EXPECT_THAT(clash.err, HasSubstr("needs the name of a folder"));
    const Finished kept = run(
        "taihu carve base.vdb --holes holes.csv --tiles 128 -o tiles --no-clobber", folder.path());
    EXPECT_THAT(kept.err, HasSubstr("tiles.json: exists"));
}

TEST(TileCommands, WhatDoesNotFitIsRefusedWithTheVoxelThatDoes) {
    const Scratch folder;
    must("taihu shape sphere --dim 300 -o base.vdb -q", folder);
    must("taihu shape sphere -o base.ply -q", folder);
    must("taihu shape sphere -o open.obj -q", folder); // and without its last face
    std::string open = read_file(folder / "open.obj");
    open.resize(open.rfind("f "));
    write_file(folder / "open.obj", open);
    write_file(folder / "holes.csv", "x_m,y_m,z_m,radius_m\n0.4,0.1,0,0.15\n");
    write_file(folder / "r.json",
               R"({"taihu_recipe": 1, "dim": 300, "solid": {"sphere": {"size_m": [1, 1, 1]}}})");
    for (const std::string command :
         {"taihu rock r.json -o a.vdb", "taihu carve base.vdb --holes holes.csv -o a.vdb",
          "taihu carve base.ply --dim 300 --holes holes.csv -o a.vdb",
          "taihu shape sphere --dim 300 -o a.vdb", "taihu voxelize base.ply --dim 300 -o a.vdb",
          "taihu voxelize open.obj --close winding --dim 300 -o a.vdb"}) {
        const Finished refused = run(command + " -q --memory 60MB", folder.path());
        EXPECT_EQ(refused.exit_code, 1) << command;
        EXPECT_THAT(refused.err, HasSubstr("refused: voxel size 0.00333 m would need about"));
        EXPECT_THAT(refused.err, HasSubstr("(limit 60 MB); smallest that fits: 0.0"));
        EXPECT_FALSE(std::filesystem::exists(folder / "a.vdb"));
        must(command + " -q --memory 2GB", folder);
        std::filesystem::remove(folder / "a.vdb");
    }
    const json dry = result("taihu rock r.json --dry-run --memory 60MB", folder);
    EXPECT_EQ(dry["fits"], false);
    // Leaves of a ball of radius r voxels: about 0.033 times 4 pi r^2.
    EXPECT_NEAR(dry["leaves"].get<double>(), 0.033 * 4 * 3.1416 * 150 * 150, 1500);
}

TEST(TileCommands, NecksAreCutAndTheRecipeSaysSo) {
    const Scratch folder;
    write_file(folder / "r.json",
               R"({"taihu_recipe": 1, "dim": 120, "solid": {"union": {"of": [
                   {"sphere": {"size_m": [1, 1, 1]}},
                   {"transform": {"of": {"sphere": {"size_m": [0.6, 0.6, 0.6]}}, "move_m": [1.1, 0, 0]}},
                   {"box": {"size_m": [2, 0.1, 0.1]}}]}}})");
    must("taihu rock r.json -o base.vdb -q", folder);
    write_file(folder / "holes.csv", "x_m,y_m,z_m,radius_m\n-0.5,0.1,0,0.15\n");
    const std::string carve = "taihu carve base.vdb --holes holes.csv ";
    EXPECT_EQ(result(carve + "-o a.vdb", folder)["necked"], 0);
    const json cut = result(carve + "--min-neck 20cm -o b.vdb", folder);
    EXPECT_EQ(cut["necked"], 1);
    EXPECT_GT(cut["necked_m3"].get<double>(), 0.1); // pi / 6 * 0.6^3 = 0.113
    must("taihu rock --from b.vdb -o again.vdb -q", folder);
    EXPECT_EQ(read_file(folder / "again.vdb"), read_file(folder / "b.vdb"));
    const json stands = result(carve + "--foot 15 -o d.vdb", folder);
    EXPECT_GE(stands["foot"]["tilt_deg"].get<double>(), 15);
    EXPECT_GT(stands["foot"]["cut_m"].get<double>(), 0);
    must("taihu rock --from d.vdb -o again.vdb -q", folder);
    EXPECT_EQ(read_file(folder / "again.vdb"), read_file(folder / "d.vdb"));
    const Finished all = run(carve + "--pieces all --min-neck 20cm -o c.vdb", folder.path());
    EXPECT_EQ(all.exit_code, 2);
    EXPECT_THAT(all.err, HasSubstr("how many pieces stay"));
}

} // namespace
} // namespace taihu
