// Levels of detail by their verb.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "stats/core/file.h"
#include "stats/core/sha256.h"
#include "tests/support/command.h"

namespace taihu {
namespace {

using nlohmann::json;
using testing::HasSubstr;

/// A ball of 1 m without another, at y = 1.
class LevelFiles : public testing::Test {
protected:
    LevelFiles() {
        write_file(scratch_ / "r.json",
                   R"({"taihu_recipe": 1, "dim": 48, "solid": {"transform": {"move_m": [0, 1, 0],
                   "of": {"difference": {"of": [{"sphere": {"size_m": [1, 1, 1]}},
                   {"transform": {"of": {"sphere": {"size_m": [0.7, 0.7, 0.7]}},
                   "move_m": [0.4, 0.1, 0]}}]}}}}})");
        result("taihu rock r.json -o rock.vdb", scratch_);
    }
    const Scratch scratch_;
};

TEST_F(LevelFiles, SplitLevelsComeWithDistances) {
    result("taihu lod rock.vdb --levels 3 --split --fov 90 -o levels", scratch_);
    const json manifest = json::parse(read_file(scratch_ / "levels/manifest.json"));
    ASSERT_EQ(manifest["levels"].size(), 3u);
    double from_m = -1;
    for (const json& level : manifest["levels"]) {
        const std::string file = "levels/" + level["file"].get<std::string>();
        EXPECT_EQ(level["sha256"], sha256_hex(read_file(scratch_ / file)));
        EXPECT_GT(level["from_m"].get<double>(), from_m);
        from_m = level["from_m"];
        const json check = result("taihu check " + file, scratch_);
        EXPECT_EQ(check["levels"][0]["triangles"], level["triangles"]);
    }
    // At 90 degrees half the screen is as high as it is far: 540 pixels.
    EXPECT_NEAR(from_m, manifest["levels"][2]["error_m"].get<double>() * 540, 1e-9);
    EXPECT_TRUE(std::filesystem::exists(scratch_ / "levels/report.json"));
}

TEST_F(LevelFiles, SeedRowE62PixelsAreBounds) {
    const json made = result("taihu lod rock.vdb --pixels 66,34,19 -o rock.glb", scratch_);
    ASSERT_EQ(made["levels"].size(), 3u) << made["note"];
    const double height_m = 1; // the ball's
    const double pixels[] = {66, 34, 19};
    for (std::size_t j = 0; j < 3; ++j) {
        EXPECT_NEAR(made["levels"][j]["bound_m"].get<double>(), height_m / pixels[j], 1e-3);
        EXPECT_LE(made["levels"][j]["error_m"], made["levels"][j]["bound_m"]);
    }
}

TEST_F(LevelFiles, TrianglesAreReached) {
    const json made = result("taihu lod rock.vdb --triangles 1200,500 -o rock.glb", scratch_);
    ASSERT_EQ(made["levels"].size(), 2u) << made["note"];
    EXPECT_NEAR(made["levels"][0]["triangles"].get<double>(), 1200, 24);
    EXPECT_NEAR(made["levels"][1]["triangles"].get<double>(), 500, 10);
}

TEST_F(LevelFiles, TheFootMayBeTheOriginAndOcclusionLeftOut) {
    result("taihu lod rock.vdb --levels 1 -o world.glb", scratch_);
    result("taihu lod rock.vdb --levels 1 --origin foot --no-ao -o foot.glb", scratch_);
    const std::string world = read_file(scratch_ / "world.glb"),
                      foot = read_file(scratch_ / "foot.glb");
    EXPECT_THAT(world, HasSubstr("COLOR_0"));
    EXPECT_THAT(foot, testing::Not(HasSubstr("COLOR_0")));
    EXPECT_THAT(foot, HasSubstr("translation"));
    const json again = result("taihu rock --from foot.glb -o again.glb", scratch_);
    EXPECT_EQ(read_file(scratch_ / "again.glb"), foot);
}

TEST_F(LevelFiles, RefusalsNameTheOption) {
    const auto refused = [&](const std::string& options) {
        const Finished said = run("taihu lod rock.vdb " + options, scratch_.path());
        EXPECT_NE(said.exit_code, 0) << options;
        return said.err;
    };
    EXPECT_THAT(refused("--pixels 20,40 -o a.glb"), HasSubstr("--pixels: 40 after 20"));
    EXPECT_THAT(refused("--triangles 20,40 -o a.glb"), HasSubstr("--triangles: 40 after 20"));
    EXPECT_THAT(refused("--triangles 500 --levels 2 -o a.glb"), HasSubstr("--levels"));
    EXPECT_THAT(refused("--split -o a.glb"), HasSubstr("--split writes a folder"));
    EXPECT_THAT(refused("-o a.ply"), HasSubstr("levels go into a .glb"));
    EXPECT_FALSE(std::filesystem::exists(scratch_ / "a.glb"));
}

TEST_F(LevelFiles, OpenVDBsMesherStays) {
    const json uniform = result("taihu mesh rock.vdb --uniform -o u.ply", scratch_);
    const json same = result("taihu mesh rock.vdb --method openvdb -o v.ply", scratch_);
    EXPECT_EQ(uniform["certificate"], same["certificate"]);
    const json larger =
        result("taihu mesh rock.vdb --method openvdb --adaptivity 0.3 -o w.ply", scratch_);
    EXPECT_LT(larger["certificate"]["triangles"].get<int>(),
              uniform["certificate"]["triangles"].get<int>() / 2);
    EXPECT_THAT(run("taihu mesh rock.vdb --adaptivity 0.3 -o x.ply", scratch_.path()).err,
                HasSubstr("add --method openvdb"));
}

} // namespace
} // namespace taihu
