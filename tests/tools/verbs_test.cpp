// One real job of every verb.
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/command.h"

namespace taihu {
namespace {

using nlohmann::json;
using testing::HasSubstr;

/// Run a command that must succeed, with --json, and give its object.
const std::string kRock1 = TAIHU_DATA "/measurements/rock1.csv";

TEST(Verbs, FromMeasurementsToACertifiedRock) {
    const Scratch scratch;
    const json law = result("taihu fit " + kRock1 + " -o law.json", scratch);
    EXPECT_EQ(law["family"], "exponential");
    EXPECT_NEAR(law["parameters"]["rate"].get<double>(), 5.54, 0.005);
    result("taihu shape boulder --size 1,0.8,0.7 --seed 3 -o base.ply", scratch);
    const json base = result("taihu voxelize base.ply --dim 96 -o base.vdb", scratch);
    EXPECT_EQ(base["found"].size(), 0u);
    const json holes = result(
        "taihu sample law.json --in base.vdb --scale 25% --porosity 0.2 -o holes.csv", scratch);
    EXPECT_NEAR(holes["porosity"].get<double>(), 0.2, 0.005);
    const json rock = result("taihu carve base.vdb --holes holes.csv -o rock.vdb", scratch);
    EXPECT_NEAR(rock["porosity"].get<double>(), 0.2, 0.005);
    EXPECT_NEAR(rock["base_m3"].get<double>(), base["volume_m3"].get<double>(), 1e-12);
    const json chain = result("taihu lod rock.vdb --levels 3 -o rock.glb", scratch);
    ASSERT_EQ(chain["levels"].size(), 3u);
    for (std::size_t j = 0; j < 3; ++j) {
        const json& level = chain["levels"][j];
        EXPECT_LE(level["error_m"].get<double>(), level["bound_m"].get<double>());
        if (j > 0) {
            EXPECT_LT(level["triangles"].get<int>(),
                      chain["levels"][j - 1]["triangles"].get<int>());
        }
    }
    EXPECT_EQ(json::parse(read_file(scratch / "report.json")), chain);
    const json check = result("taihu check rock.glb", scratch);
    EXPECT_TRUE(check["holds"].get<bool>());
    ASSERT_EQ(check["levels"].size(), 3u);
    EXPECT_EQ(check["levels"][0]["components"], 1);
    // Of lod's own figure for the finest level, or that of the places which it names apart; and
    // every level farther off than the one before.
    const json far = result("taihu check rock.glb --against rock.vdb", scratch);
    const double far_m = far["levels"][0]["distance"]["max_m"],
                 error_m = chain["levels"][0]["error_m"],
                 apart_m = chain["levels"][0]["unresolved_error_m"];
    EXPECT_GT(far_m, 0.9 * error_m);
    EXPECT_LT(far_m, 1.1 * std::max(error_m, apart_m)); // samples of another surface
    EXPECT_GT(far["levels"][2]["distance"]["rms_m"], far["levels"][0]["distance"]["rms_m"]);
    const Finished no =
        run("taihu check rock.glb --against rock.vdb --within 0.6vox", scratch.path());
    EXPECT_EQ(no.exit_code, 3);
    EXPECT_THAT(no.err, HasSubstr("level 2: NO: "));
    EXPECT_THAT(run("taihu check rock.glb --within 1mm", scratch.path()).err,
                HasSubstr("name a file with --against"));
    const json measures = result("taihu measure rock.vdb --base base.vdb", scratch);
    EXPECT_GT(measures["porosity_hull"].get<double>(), 0.1);
    EXPECT_NEAR(measures["porosity_base"].get<double>(), rock["porosity_cleaned"].get<double>(),
                1e-9);
    result("taihu render rock.glb --size 64x64 --samples 2 -o rock.png", scratch);
    result("taihu render rock.vdb --size 64x64 --samples 2 -o rock.exr", scratch);
    EXPECT_THAT(read_file(scratch / "rock.png"), testing::StartsWith("\x89PNG"));
    const json info = result("taihu info rock.glb", scratch);
    const json& difference = info["recipe"]["solid"]["clean"]["of"]["difference"]["of"];
    EXPECT_EQ(difference[0]["mesh"]["file"], "base.ply");
    EXPECT_EQ(difference[1]["holes"]["file"], "holes.csv");
    EXPECT_EQ(result("taihu info rock.vdb", scratch)["recipe"]["solid"], info["recipe"]["solid"]);
}

TEST(Verbs, ShapeMakesAMeshAndALevelSetOfOneSolid) {
    const Scratch scratch;
    for (const std::string kind : {"rounded_box --round 15%", "capsule --size 0.5,1,0.5",
                                   "torus --tube 20%", "superquadric --exponents 0.5,1.5"}) {
        const json mesh = result("taihu shape " + kind + " -o a.ply", scratch);
        result("taihu shape " + kind + " --dim 64 -o a.vdb", scratch);
        const double solid = result("taihu measure a.vdb", scratch)["volume_m3"].get<double>();
        // Meshes are inscribed; the tube of 32 sides lacks 2 (pi / 32)^2 / 3 of its volume.
        EXPECT_NEAR(mesh["volume_m3"].get<double>(), solid, 0.01 * solid) << kind;
    }
}

TEST(SeedRow, D17TheNineStagesAreWritten) {
    const Scratch scratch;
    result("taihu shape fractal-rock --base 0 --size 1,0.7,0.9 --stages st -o rock.ply", scratch);
    const std::pair<const char*, std::size_t> stages[] = {
        {"1-base", 20},           {"2-displaced", 80},
        {"3-damped", 320},        {"4-displaced-again", 1280},
        {"5-damped-again", 5120}, {"6-rescaled", 5120},
        {"7-lit", 5120},          {"8-textured", 5120},
        {"9-bump-mapped", 81920}};
    std::set<std::string> pictures;
    for (const auto& [name, n] : stages) {
        const json said = result("taihu check st/" + std::string(name) + ".glb", scratch);
        EXPECT_EQ(said["levels"][0]["triangles"], n) << name;
        pictures.insert(read_file(scratch / ("st/" + std::string(name) + ".png")));
    }
    EXPECT_EQ(pictures.size(), 9u);
    const std::string dynamic = read_file(scratch / "st/9-bump-mapped.glb");
    result(
        "taihu shape fractal-rock --base 0 --size 1,0.7,0.9 --stages st --bump static -o rock.ply",
        scratch); // D11
    EXPECT_NE(read_file(scratch / "st/9-bump-mapped.glb"), dynamic);
}

TEST(Verbs, AFractalRockIsABaseForCarving) {
    const Scratch scratch;
    write_file(scratch / "holes.csv", "x_m,y_m,z_m,radius_m\n0,0,0.4,0.2\n");
    result("taihu shape fractal-rock --iterations 2 --seed 3 -o base.ply", scratch);
    const json carved =
        result("taihu carve base.ply --dim 64 --holes holes.csv -o rock.ply", scratch);
    EXPECT_TRUE(carved["certificate"]["holds"]);
    const Finished twice = run("taihu shape fractal-rock --base 0 --along normal --amplitude 1 "
                               "--iterations 2 -o crossed.ply",
                               scratch.path());
    EXPECT_EQ(twice.exit_code, 0) << twice.err;
    EXPECT_THAT(twice.err, HasSubstr("pairs of triangles cross"));
}

TEST(Verbs, ACaveSaysWhatItIs) {
    const Scratch scratch;
    const json cave =
        result("taihu shape cave --rocks 5 --base 0 --seed 2 --dim 64 -o cave.ply", scratch);
    EXPECT_EQ(cave["voids"], 1);
    EXPECT_GT(cave["mouth_m2"].get<double>(), 0);
    EXPECT_EQ(cave["genus"], cave["certificate"]["genus"]);
    result("taihu rock --from cave.ply -o again.ply", scratch);
    EXPECT_EQ(read_file(scratch / "cave.ply"), read_file(scratch / "again.ply"));
}

TEST(Verbs, TheThesisTablesAreThoseOfTheThesis) {
    const Scratch scratch;
    const Finished said = run("taihu fit " + kRock1 + " --method thesis", scratch.path());
    EXPECT_EQ(said.exit_code, 0);
    for (const char* number :
         {"16.33", "16.09", "4.92", "2.45", "2.39", "2.76", "0.62", "0.35", "0.70", "0.81", "0.86",
          "0.92", "0.98", "0.99", "72.911", "55.989", "5.714"})
        EXPECT_THAT(said.out, HasSubstr(number));
}

TEST(Verbs, OutputsAreTheSameBytesOnAnyNumberOfThreads) {
    const Scratch scratch;
    result("taihu fit " + kRock1 + " -o law.json", scratch);
    result("taihu shape boulder -o base.ply", scratch);
    for (const std::string extension : {".vdb", ".glb"}) {
        for (const std::string n : {"1", "2", "16"})
            result("taihu carve base.ply --dim 64 --holes law.json --scale 30% --porosity 0.2 "
                   "--threads " +
                       n + " -o rock" + n + extension,
                   scratch);
        const std::string one = read_file(scratch / ("rock1" + extension));
        EXPECT_EQ(read_file(scratch / ("rock2" + extension)), one);
        EXPECT_EQ(read_file(scratch / ("rock16" + extension)), one);
    }
}

TEST(Verbs, CarveWritesEveryFormatAndCheckReadsIt) {
    const Scratch scratch;
    write_file(scratch / "holes.csv", "x_m,y_m,z_m,radius_m\n0.4,0,0,0.3\n");
    for (const char* name : {"a.vdb", "a.obj", "a.ply", "a.stl", "a.off", "a.glb"}) {
        result("taihu shape sphere --dim 48 -o ball.vdb", scratch);
        result(std::string("taihu carve ball.vdb --holes holes.csv -o ") + name, scratch);
        const json check = result(std::string("taihu check ") + name, scratch);
        EXPECT_TRUE(check["holds"].get<bool>()) << name;
        EXPECT_EQ(check["levels"][0]["genus"], 0) << name;
    }
    const json uniform = result("taihu mesh a.vdb --uniform -o u.ply", scratch);
    const json adaptive = result("taihu mesh a.vdb --max-error 0.5vox -o v.ply", scratch);
    EXPECT_LT(adaptive["certificate"]["triangles"].get<int>(),
              uniform["certificate"]["triangles"].get<int>() / 3);
    // Half a voxel of 1/48 m over an area of 3 m^2 would be 0.03.
    EXPECT_NEAR(adaptive["certificate"]["volume_m3"].get<double>(),
                uniform["certificate"]["volume_m3"].get<double>(), 0.02);
}

TEST(Verbs, CheckSaysNoWithExit3) {
    const Scratch scratch;
    write_file(scratch / "open.obj",
               "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n");
    const Finished said = run("taihu check open.obj --json", scratch.path());
    EXPECT_EQ(said.exit_code, 3);
    EXPECT_FALSE(json::parse(said.out)["holds"].get<bool>());
    EXPECT_THAT(said.err, HasSubstr("NO: 3 boundary edges"));
}

TEST(Verbs, ALawWithoutAScaleOrANumberIsRefused) {
    const Scratch scratch;
    result("taihu fit " + kRock1 + " -o law.json", scratch);
    result("taihu shape box --dim 32 -o base.vdb", scratch);
    const Finished scale =
        run("taihu carve base.vdb --holes law.json --count 3 -o a.vdb", scratch.path());
    EXPECT_EQ(scale.exit_code, 2);
    EXPECT_THAT(scale.err, HasSubstr("--scale"));
    const Finished number =
        run("taihu carve base.vdb --holes law.json --scale 10% -o a.vdb", scratch.path());
    EXPECT_EQ(number.exit_code, 2);
    EXPECT_THAT(number.err, HasSubstr("--count"));
    write_file(scratch / "none.csv", "x_m,y_m,z_m,radius_m\n");
    const Finished none = run("taihu carve base.vdb --holes none.csv -o a.vdb", scratch.path());
    EXPECT_EQ(none.exit_code, 1);
    EXPECT_THAT(none.err, HasSubstr("none.csv: a header without holes"));
}

TEST(Verbs, HolesOfALawMayFollowItsOwnDensity) {
    const Scratch scratch;
    write_file(scratch / "d.csv",
               "# unit=m\n# area=2\ndiameter\n.1\n.12\n.2\n.15\n.11\n.3\n.13\n.14\n.1\n.18\n");
    const json law = result("taihu fit d.csv --detection-limit 0.1 -o law.json", scratch);
    ASSERT_TRUE(law["n_v"].is_object());
    const json holes = result("taihu sample law.json --box 2,2,2 -o holes.csv", scratch);
    // Touching holes of a Poisson process: more than those centred in the box, fewer than thrice.
    const double inside = law["n_v"]["estimate"].get<double>() * 8;
    EXPECT_GT(holes["holes"].get<double>(), 0.7 * inside);
    EXPECT_LT(holes["holes"].get<double>(), 3 * inside);
    EXPECT_THAT(read_file(scratch / "holes.csv"), HasSubstr("measured: the law's n_v"));
}

TEST(Verbs, MeasurePredictsWhatHolesAtRandomMake) {
    const Scratch scratch;
    write_file(scratch / "law.json",
               R"({"taihu_law": 1, "family": "constant", "parameters": {"diameter": 1.2},
                   "intervals": {}, "level": null, "unit": "greatest", "mean_diameter": 1.2,
                   "n_v": null, "detection_limit": null, "n_profiles": 0, "area": null,
                   "ranking": [], "source": []})");
    result("taihu shape box --dim 100 -o base.vdb", scratch);
    result("taihu carve base.vdb --holes law.json --scale 0.1m --density 300 --pieces all "
           "--bubbles keep -o rock.vdb",
           scratch);
    const std::string command = "taihu measure rock.vdb --base base.vdb --law law.json ";
    const json m = result(command + "--scale 0.1m --density 300", scratch);
    const json& predicted = m["predicted"];
    // Equal balls of 0.12 m: n v = 300 pi / 6 0.12^3, S_V = n pi 0.12^2 exp(-n v).
    EXPECT_NEAR(predicted["porosity"].get<double>(), 0.2377, 1e-4);
    EXPECT_NEAR(predicted["s_v_m1"].get<double>(), 10.346, 1e-3);
    // One sample of about 300 holes: the sd is exp(-n v) v sqrt(300) = 0.012; three of them.
    EXPECT_NEAR(m["porosity_base"].get<double>(), 0.2377, 0.036);
    // The same 6 % of the number, and 2 % for the rims that a voxel of a twelfth cuts.
    EXPECT_NEAR(m["s_v_base_m1"].get<double>(), 10.346, 0.12 * 10.346);
    EXPECT_THAT(run(command + "--scale 0.1m", scratch.path()).err, HasSubstr("give --density"));
    EXPECT_THAT(run(command + "--density 300", scratch.path()).err, HasSubstr("--scale 0.4m"));
}

TEST(Verbs, PiecesAndBubblesAreKeptOnRequest) {
    const Scratch scratch;
    result("taihu shape sphere --dim 64 -o ball.vdb", scratch);
    write_file(scratch / "holes.csv", "x_m,y_m,z_m,diameter_m\n0,0,0,0.4\n");
    EXPECT_EQ(result("taihu carve ball.vdb --holes holes.csv -o a.vdb", scratch)["bubbles_filled"],
              1);
    const json kept =
        result("taihu carve ball.vdb --holes holes.csv --bubbles keep -o b.vdb", scratch);
    EXPECT_EQ(kept["bubbles"], 1);
    EXPECT_EQ(kept["bubbles_filled"], 0);
    EXPECT_EQ(result("taihu check b.vdb", scratch)["levels"][0]["cavities"], 1);
}

} // namespace
} // namespace taihu
