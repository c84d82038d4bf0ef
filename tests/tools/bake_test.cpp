// Levels with maps by their verb.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "mesh_out/io/exr_file.h"
#include "stats/core/file.h"
#include "tests/support/command.h"
#include "tests/support/process.h"

namespace taihu {
namespace {

using nlohmann::json;
using testing::HasSubstr;

/// A ball of 1 m without another.
class Bake : public testing::Test {
protected:
    Bake() {
        write_file(scratch_ / "r.json",
                   R"({"taihu_recipe": 1, "dim": 48, "solid": {"difference": {"of": [
                   {"sphere": {"size_m": [1, 1, 1]}},
                   {"transform": {"of": {"sphere": {"size_m": [0.7, 0.7, 0.7]}},
                   "move_m": [0.4, 0.1, 0]}}]}}})");
        result("taihu rock r.json -o rock.vdb", scratch_);
    }
    json glb_json(const std::string& name) const {
        const std::string bytes = read_file(scratch_ / name);
        return json::parse(bytes.substr(20, bytes.find("BIN", 20) - 4 - 20));
    }
    const Scratch scratch_;
};

TEST_F(Bake, LevelsComeWithMapsAndFigures) {
    const json made =
        result("taihu bake rock.vdb --levels 2 --max-error 1vox --size 256 --ao-rays 8 "
               "--maps maps --report r.json -o rock.glb",
               scratch_);
    ASSERT_EQ(made["levels"].size(), 2u);
    EXPECT_EQ(made["levels"][0]["maps"]["size_px"], 256);
    EXPECT_LE(made["levels"][1]["maps"]["size_px"], 256);
    for (const json& level : made["levels"]) {
        EXPECT_LT(level["maps"]["normal_error_deg"], 5); // D10's bound
        EXPECT_LT(level["maps"]["normal_error_deg"], level["maps"]["normal_error_without_deg"]);
        EXPECT_LE(level["maps"]["rms_displacement_m"], level["bound_m"]);
    }
    EXPECT_EQ(json::parse(read_file(scratch_ / "r.json")), made);
    for (const char* name :
         {"normal", "object_normal", "displacement", "occlusion", "curvature", "part"})
        for (const char* level : {"level0_", "level1_"})
            EXPECT_TRUE(
                std::filesystem::exists(scratch_ / "maps" / (level + std::string(name) + ".exr")));
    const json check = result("taihu check rock.glb", scratch_);
    EXPECT_EQ(check["levels"][1]["triangles"], made["levels"][1]["triangles"]);
    EXPECT_EQ(glb_json("rock.glb")["images"].size(), 4u);
}

TEST_F(Bake, OneLevelAloneLeavesTheOthersWithVertexColours) {
    const json made =
        result("taihu bake rock.vdb --levels 2 --max-error 1vox --size 128 --ao-rays 8 "
               "--only 1 -o rock.glb",
               scratch_);
    EXPECT_FALSE(made["levels"][0].contains("maps"));
    EXPECT_EQ(made["levels"][1]["maps"]["size_px"], 128);
    const json glb = glb_json("rock.glb");
    const auto attributes = [&](int level) {
        return glb["meshes"][level]["primitives"][0]["attributes"];
    };
    EXPECT_TRUE(attributes(0).contains("COLOR_0"));
    EXPECT_FALSE(attributes(0).contains("TANGENT"));
    EXPECT_TRUE(attributes(1).contains("TANGENT"));
    EXPECT_EQ(glb["materials"].size(), 2u);
}

TEST_F(Bake, WithoutOcclusionThereIsOneImage) {
    result("taihu bake rock.vdb --levels 1 --max-error 1vox --size 128 --no-ao "
           "-o rock.glb",
           scratch_);
    const json glb = glb_json("rock.glb");
    EXPECT_EQ(glb["images"].size(), 1u);
    EXPECT_FALSE(glb["materials"][0].contains("occlusionTexture"));
}

TEST_F(Bake, GrainsAreABaseColour) {
    result("taihu bake rock.vdb --levels 1 --max-error 1vox --size 128 --no-ao --grain 2cm "
           "-o rock.glb",
           scratch_);
    const json glb = glb_json("rock.glb");
    EXPECT_EQ(glb["images"].size(), 2u);
    EXPECT_TRUE(glb["materials"][0]["pbrMetallicRoughness"].contains("baseColorTexture"));
}

TEST_F(Bake, GivesTheSameBytesOnAnyNumberOfThreads) {
    const std::string command = "taihu bake rock.vdb --levels 1 --max-error 1vox --size 128 "
                                "--ao-rays 8 --threads ";
    result(command + "1 -o one.glb", scratch_);
    result(command + "4 -o four.glb", scratch_);
    EXPECT_EQ(read_file(scratch_ / "one.glb"), read_file(scratch_ / "four.glb"));
}

TEST_F(Bake, IsMadeAgainFromItsFileMapsAndAll) {
    result("taihu bake rock.vdb --levels 2 --max-error 1vox --size 128 --ao-rays 8 --cage 3vox "
           "--grain 4cm --grain-contrast 0.3 --vertices -o rock.glb",
           scratch_);
    result("taihu rock --from rock.glb -o again.glb", scratch_);
    EXPECT_EQ(read_file(scratch_ / "rock.glb"), read_file(scratch_ / "again.glb"));
    result("taihu bake rock.vdb --levels 2 --max-error 1vox --size 128 --ao-rays 8 --only 1 "
           "--origin foot -o one.glb",
           scratch_);
    result("taihu rock --from one.glb -o again.glb", scratch_);
    EXPECT_EQ(read_file(scratch_ / "one.glb"), read_file(scratch_ / "again.glb"));
}

TEST_F(Bake, VerticesHaveCurvatureAndDisplacement) {
    result("taihu bake rock.vdb --levels 1 --max-error 1vox --size 128 --no-ao --vertices "
           "-o rock.glb",
           scratch_);
    const json glb = glb_json("rock.glb");
    const json primitive = glb["meshes"][0]["primitives"][0];
    for (const char* name : {"_CURVATURE", "_DISPLACEMENT"}) {
        const json accessor = glb["accessors"][primitive["attributes"][name].get<std::size_t>()];
        EXPECT_EQ(accessor["type"], "SCALAR");
        EXPECT_EQ(
            accessor["count"],
            glb["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()]["count"]);
        EXPECT_TRUE(
            primitive["extensions"]["KHR_draco_mesh_compression"]["attributes"].contains(name));
    }
}

TEST_F(Bake, MapsAppearTogetherOrNotAtAll) {
    // Cancelled by its signal while it works, wherever that is.
    const Finished said =
        run("timeout --foreground --preserve-status -s INT 1 taihu bake rock.vdb --levels 4 "
            "--max-error 0.3vox --size 4096 --ao-rays 64 --maps maps -o rock.glb",
            scratch_.path());
    EXPECT_EQ(said.exit_code, 130) << said.err;
    EXPECT_FALSE(std::filesystem::exists(scratch_ / "maps"));
    EXPECT_FALSE(std::filesystem::exists(scratch_ / "rock.glb"));
}

TEST_F(Bake, ALowMeshOfOnesOwnIsBakedAsItIs) {
    result("taihu mesh rock.vdb --max-error 3vox -o low.ply", scratch_);
    result("taihu mesh rock.vdb --max-error 0.2vox -o high.ply", scratch_);
    for (const char* high : {"rock.vdb", "high.ply"}) {
        const json made = result(std::string("taihu bake ") + high +
                                     " low.ply --size 256 --ao-rays 8 --maps maps -o low.glb",
                                 scratch_);
        EXPECT_TRUE(made["certificate"]["holds"]);
        EXPECT_EQ(made["certificate"]["triangles"],
                  result("taihu check low.ply", scratch_)["levels"][0]["triangles"]);
        EXPECT_LT(made["maps"]["normal_error_deg"], 5); // D10's bound
        EXPECT_LT(made["maps"]["normal_error_deg"],
                  0.6 * made["maps"]["normal_error_without_deg"].get<double>());
        EXPECT_LT(made["maps"]["most_displacement_m"], made["cage_m"]);
        EXPECT_LT(made["apart_m"], 3 * 1.0 / 48 * 1.01);
        EXPECT_LT(made["maps"]["nearest_texels"].get<double>(),
                  0.02 * made["maps"]["texels"].get<double>());
        EXPECT_TRUE(std::filesystem::exists(scratch_ / "maps/level0_displacement.exr"));
        EXPECT_EQ(glb_json("low.glb")["images"].size(), 2u);
    }
}

TEST_F(Bake, AFlatPairOfFilesBakesToStraightNormals) {
    must("taihu shape box --size 1m,0.5m,0.75m -o box.obj -q", scratch_);
    const json made = result(
        "taihu bake box.obj box.obj --size 128 --ao-rays 4 --maps maps -o box.glb", scratch_);
    EXPECT_EQ(made["certificate"]["triangles"], 12);
    EXPECT_LT(made["apart_m"], 1e-9);
    EXPECT_EQ(made["maps"]["nearest_texels"], 0);
    const std::vector<std::string> rgb = {"R", "G", "B"}, y = {"Y"};
    const Image normal = read_exr(scratch_ / "maps/level0_normal.exr", rgb).image;
    const Image displacement = read_exr(scratch_ / "maps/level0_displacement.exr", y).image;
    for (std::size_t i = 0; i < displacement.pixels.size(); ++i) {
        // Normals of 10 bits that were decoded turn by up to 1/512.
        ASSERT_NEAR(normal.pixels[3 * i], 0, 0.004);
        ASSERT_NEAR(normal.pixels[3 * i + 1], 0, 0.004);
        ASSERT_GT(normal.pixels[3 * i + 2], 0.9999);
        ASSERT_NEAR(displacement.pixels[i], 0, 1e-5); // a field's 1e-5 of a voxel
    }
}

TEST_F(Bake, AnOpenLowMeshIsSaidToBe) {
    write_file(scratch_ / "sheet.obj", "v -0.3 0.5 -0.2\nv -0.3 0.5 0.2\nv -0.1 0.5 0.2\n"
                                       "v -0.1 0.5 -0.2\nf 1 2 3 4\n");
    const Finished said = run("taihu bake rock.vdb sheet.obj --size 64 --ao-rays 4 --cage 20cm "
                              "-o sheet.glb",
                              scratch_.path());
    EXPECT_EQ(said.exit_code, 0) << said.err;
    EXPECT_THAT(said.err, HasSubstr("sheet.glb: 4 boundary edges"));
}

TEST_F(Bake, PairsThatLieApartAreRefusedUnlessACageIsGiven) {
    must("taihu shape sphere --size 1000m -o far.obj -q", scratch_);
    const auto refuses = [&](const std::string& options, const char* part) {
        const Finished said = run("taihu bake rock.vdb " + options, scratch_.path());
        EXPECT_EQ(said.exit_code, 2) << options;
        EXPECT_THAT(said.err, HasSubstr(part));
        EXPECT_EQ(std::count(said.err.begin(), said.err.end(), '\n'), 1) << said.err;
    };
    refuses("far.obj --size 64 --ao-rays 4 -q -o far.glb", "put both in one place (--unit, --up)");
    refuses("far.obj --cage 1m --size 64 --ao-rays 4 -q -o far.glb", "put both in one place");
    const json made = result("taihu bake rock.vdb far.obj --unit mm --size 64 --ao-rays 4 "
                             "--cage 10cm -o near.glb",
                             scratch_);
    EXPECT_GT(made["maps"]["nearest_texels"], 0); // over the hole
    EXPECT_FALSE(std::filesystem::exists(scratch_ / "far.glb"));
}

TEST_F(Bake, SaysWhatIsWrongInOneLine) {
    const auto refuses = [&](const std::string& options, int code, const char* part) {
        const Finished said = run("taihu bake rock.vdb " + options, scratch_.path());
        EXPECT_EQ(said.exit_code, code) << options;
        EXPECT_THAT(said.err, HasSubstr(part));
        EXPECT_EQ(std::count(said.err.begin(), said.err.end(), '\n'), 1) << said.err;
    };
    refuses("-o rock.ply", 1, "maps go into a .glb; name one");
    refuses("--crease 30 -o rock.glb", 2, "is of a low mesh; name one behind the high");
    refuses("rock.vdb --levels 2 -o rock.glb", 2, "--levels: is of levels that are made here");
    refuses("--size 32 -o rock.glb", 2, "--size");
    refuses("--cage 0m -o rock.glb", 2, "--cage");
    refuses("--max-error 1vox --levels 1 --only 3 -o rock.glb", 2, "there is no level 3 of 1");
    refuses("--max-error 0.3vox --levels 1 --gutter 16 --size 64 -o rock.glb", 1,
            "charts do not fit a texture of 64 x 64 texels; use a larger one");
    EXPECT_FALSE(std::filesystem::exists(scratch_ / "rock.glb"));
    EXPECT_THAT(run("taihu bake --help", scratch_.path()).out, HasSubstr("taihu bake rock.vdb -o"));
}

} // namespace
} // namespace taihu
