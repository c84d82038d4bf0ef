// Levels with maps by their verb.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "stats/core/file.h"
#include "tests/support/process.h"

namespace taihu {
namespace {

using nlohmann::json;
using testing::HasSubstr;

json result(const std::string& command, const Scratch& scratch) {
    const Finished said = run(command + " --json -q", scratch.path());
    EXPECT_EQ(said.exit_code, 0) << command << '\n' << said.err;
    return json::parse(said.out, nullptr, false);
}

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

TEST_F(Bake, SaysWhatIsWrongInOneLine) {
    const auto refuses = [&](const std::string& options, int code, const char* part) {
        const Finished said = run("taihu bake rock.vdb " + options, scratch_.path());
        EXPECT_EQ(said.exit_code, code) << options;
        EXPECT_THAT(said.err, HasSubstr(part));
        EXPECT_EQ(std::count(said.err.begin(), said.err.end(), '\n'), 1) << said.err;
    };
    refuses("-o rock.ply", 1, "levels with maps go into a .glb; name one");
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
