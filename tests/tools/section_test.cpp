// taihu section: from a law to a rock, to profiles, and back to the law.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "stats/fit.h"
#include "stats/io/measurements.h"
#include "tests/support/command.h"

namespace taihu {
namespace {

using nlohmann::json;
using testing::HasSubstr;

/// A ball of radius 1 m full of holes, exponential with this rate: base.vdb, holes.csv, rock.vdb.
void make_rock(const Scratch& scratch, int dim = 64, int rate = 12, int density = 300,
               const std::string& cleaning = "") {
    const Finished made =
        run("taihu shape sphere --size 2 --dim " + std::to_string(dim) + " -o base.vdb -q",
            scratch.path());
    ASSERT_EQ(made.exit_code, 0) << made.err;
    json law = {{"taihu_law", 1},
                {"family", "exponential"},
                {"level", 0.95},
                {"unit", "m"},
                {"n_v", nullptr},
                {"area", nullptr},
                {"mean_diameter", 1. / rate},
                {"detection_limit", 0},
                {"n_profiles", 50},
                {"source", json::array()}};
    law["parameters"] = {{"rate", rate}};
    law["intervals"] = {{"rate", {rate - 1, rate + 1}}};
    law["ranking"] = {{{"family", "exponential"}, {"aicc", 0}, {"weight", 1}}};
    write_file(scratch / "law.json", law.dump());
    result("taihu sample law.json --in base.vdb --density " + std::to_string(density) +
               " --seed 4 -o holes.csv",
           scratch);
    result("taihu carve base.vdb --holes holes.csv -o rock.vdb " + cleaning, scratch);
}

/// The arguments by which fit reads three photos of a folder.
std::string three_photos(const std::string& folder) {
    std::string files, masks;
    for (const std::string name : {"plane-1", "plane-2", "plane-3"}) {
        files += " " + folder + "/" + name + ".json";
        masks += " --mask " + name + ".png=" + folder + "/" + name + "-mask.png";
    }
    return files + masks;
}

TEST(SectionVerb, ClosesTheLoopFromLawToLaw) {
    const Scratch scratch;
    make_rock(scratch);
    const json cut = result("taihu section rock.vdb --base base.vdb --holes holes.csv --planes 4 "
                            "--seed 2 -o profiles.csv",
                            scratch);
    EXPECT_EQ(cut["planes"], 4);
    EXPECT_EQ(cut["resolution_m"], 0);
    EXPECT_GT(cut["profiles"].get<int>(), 50);
    const json law = result("taihu fit profiles.csv --detection-limit 0 -o again.json", scratch);
    EXPECT_EQ(law["n_profiles"], cut["profiles"]);
    // Which family fits best is a matter of luck, and moves the mean; vdb_ops' tests have the law.
    EXPECT_GT(law["mean_diameter"].get<double>(), 0.04);
    EXPECT_LT(law["mean_diameter"].get<double>(), 0.16);
    EXPECT_NEAR(law["area"].get<double>(), cut["area_m2"].get<double>(), 1e-12);
}

TEST(SectionVerb, SeesHolesWithoutTheirList) {
    const Scratch scratch;
    make_rock(scratch);
    const Finished said =
        run("taihu section rock.vdb --base base.vdb --planes 3 --direction 0,1,0 -o seen.csv",
            scratch.path());
    EXPECT_EQ(said.exit_code, 0) << said.err;
    EXPECT_THAT(said.err, HasSubstr("fit with --detection-limit 0.0"));
    const json outline =
        result("taihu section rock.vdb --planes 3 --major -o outline.csv", scratch);
    EXPECT_GT(outline["profiles"].get<int>(), 3);
    EXPECT_EQ(outline["clipped"], 0);
    EXPECT_THAT(read_file(scratch / "outline.csv"), HasSubstr("\nplane,u_m,v_m,diameter_m\n"));
}

TEST(SectionVerb, PhotosCloseTheLoopThroughTheFilesPeopleUse) {
    const Scratch scratch;
    make_rock(scratch, 130, 25, 600, "--pieces all --bubbles keep");
    const std::string cut = "taihu section rock.vdb --base base.vdb --holes holes.csv --planes 3 "
                            "--pixel 8mm --detection-limit 32mm --scale-bar 50cm --photos ";
    const json made = result(cut + "straight", scratch)["photos"];
    EXPECT_EQ(made["photos"], 3);
    EXPECT_EQ(made["solid"], 0);
    const json law =
        result("taihu fit" + three_photos("straight") + " --scale-bar 50cm --detection-limit 0.032",
               scratch);
    EXPECT_EQ(law["unit"], "m");
    EXPECT_EQ(law["n_profiles"], made["marked"]);
    EXPECT_GT(law["n_profiles"].get<int>(), 80);
    EXPECT_NEAR(law["area"].get<double>(), made["area_m2"].get<double>(), 1e-9);
    EXPECT_LE(law["n_v"]["lo"].get<double>(), 600);
    EXPECT_GE(law["n_v"]["hi"].get<double>(), 600);

    // The tilt leaves the diameters alone, and shortens the area by the factor that is named.
    const json tilted = result(cut + "tilted --tilt 40deg", scratch)["photos"];
    // Pixels at the rim of the mask differ, and with them a hole or two that lie in them.
    EXPECT_NEAR(tilted["marked"].get<int>(), made["marked"].get<int>(), 2);
    EXPECT_NEAR(tilted["area_factor"].get<double>(), 1.3054, 1e-4);
    const json again =
        result("taihu fit" + three_photos("tilted") + " --scale-bar 50cm --detection-limit 0.032",
               scratch);
    EXPECT_NEAR(again["n_profiles"].get<int>(), law["n_profiles"].get<int>(), 2);
    EXPECT_NEAR(again["area"].get<double>() * tilted["area_factor"].get<double>(),
                law["area"].get<double>(), 0.003 * law["area"].get<double>());

    MeasurementSettings settings;
    settings.scale_bar_m = 0.5;
    settings.detection_limit = 0.032;
    const std::vector<std::filesystem::path> files = {scratch / "straight/plane-1.json",
                                                      scratch / "tilted/plane-2.json"};
    const Fit fit = fit_law(read_measurements(files, settings).sample, Family::exponential);
    EXPECT_LE(fit.intervals[0].lo, 25);
    EXPECT_GE(fit.intervals[0].hi, 25);
}

TEST(SectionVerb, ThePhotosInTheDataGiveTheirLawBack) {
    const Scratch scratch;
    const json law = result("taihu fit" + three_photos(TAIHU_DATA "/photos") +
                                " --scale-bar 20cm --detection-limit 0.008",
                            scratch);
    EXPECT_EQ(law["n_profiles"], 47 + 59 + 50);
    EXPECT_EQ(law["family"], "exponential");
    EXPECT_LE(law["intervals"]["rate"][0].get<double>(), 50);
    EXPECT_GE(law["intervals"]["rate"][1].get<double>(), 50);
    EXPECT_LE(law["n_v"]["lo"].get<double>(), 3500);
    EXPECT_GE(law["n_v"]["hi"].get<double>(), 3500);
}

TEST(SectionVerb, PhotosNeedNoListAndNoTable) {
    const Scratch scratch;
    make_rock(scratch);
    const Finished said =
        run("taihu section rock.vdb --planes 2 --photos new/folder --pixel 1% --tilt 25 --json",
            scratch.path());
    EXPECT_EQ(said.exit_code, 0) << said.err;
    EXPECT_THAT(said.err, HasSubstr("new/folder/plane-2.json: "));
    EXPECT_THAT(said.err,
                HasSubstr("fit with: taihu fit new/folder/plane-*.json --mask "
                          "new/folder/plane-*-mask.png --scale-bar 0.5m --detection-limit"));
    // As it stands, by a shell.
    const std::string line = said.err.substr(said.err.find("taihu fit"));
    EXPECT_EQ(run(line.substr(0, line.find('\n')), scratch.path()).exit_code, 0);
    EXPECT_THAT(said.err, HasSubstr("fit with --area-factor 1.10338"));
    const json object = json::parse(said.out);
    EXPECT_FALSE(object.contains("file"));
    EXPECT_EQ(object["photos"]["scale_bar_m"], 0.5);
    EXPECT_GT(object["photos"]["marked"].get<int>(), 2);
    for (const char* name : {"plane-1.png", "plane-1-mask.png", "plane-2.png"})
        EXPECT_THAT(read_file(scratch / ("new/folder/" + std::string(name))),
                    testing::StartsWith("\x89PNG"));
    const json labels = json::parse(read_file(scratch / "new/folder/plane-1.json"));
    EXPECT_EQ(labels["imagePath"], "plane-1.png");
    EXPECT_EQ(labels["shapes"].back()["label"], "scale");
}

TEST(SectionVerb, PhotosAreTheSameBytesOnAnyNumberOfThreads) {
    const Scratch scratch;
    make_rock(scratch);
    for (const std::string n : {"1", "3"})
        result("taihu section rock.vdb --base base.vdb --planes 1 --direction 0,1,0 --pixel 5mm "
               "--tilt 30deg --threads " +
                   n + " --photos on" + n,
               scratch);
    for (const std::string file : {"plane-1.png", "plane-1-mask.png", "plane-1.json"})
        EXPECT_EQ(read_file(scratch / ("on1/" + file)), read_file(scratch / ("on3/" + file)));
}

TEST(SectionVerb, RefusesByName) {
    const Scratch scratch;
    const auto fails = [&](const std::string& options, int code, const std::string& part) {
        const Finished said = run("taihu section " + options, scratch.path());
        EXPECT_EQ(said.exit_code, code) << options;
        EXPECT_THAT(said.err, HasSubstr(part));
    };
    fails("none.vdb -o a.csv", 1, "none.vdb");
    fails("none.vdb --planes 0 -o a.csv", 2, "--planes");
    fails("none.vdb --major --holes h.csv -o a.csv", 2, "excludes");
    ASSERT_EQ(run("taihu shape sphere --dim 16 -o ball.vdb -q", scratch.path()).exit_code, 0);
    fails("ball.vdb --direction 0,0,0 -o a.csv", 2, "the direction is not finite or 0");
    fails("ball.vdb", 2, "nothing to write; give -o profiles.csv, --photos DIR, or both");
    fails("ball.vdb -o a.csv --pixel 2mm", 2, "--photos");
    fails("ball.vdb --photos p --tilt 85deg", 2, "tilt_deg is 85; must be in 0..80");
    fails("ball.vdb --photos p --tilt 1rad", 2, "--tilt: '1rad' is no angle; write 25deg");
    fails("ball.vdb --photos p --pixel 1um", 2, "; choose pixels from ");
    fails("ball.vdb --photos p --scale-bar 9m", 2, "scale_bar_m is 9, longer than the picture");
    fails("ball.vdb --photos ball.vdb", 1, "ball.vdb: is no folder");
    fails("ball.vdb --photos ball.vdb/p", 1, "ball.vdb/p: ball.vdb is no folder");
    EXPECT_FALSE(std::filesystem::exists(scratch / "p")); // what fails makes no folder
    std::filesystem::create_directory(scratch / "p");
    write_file(scratch / "p/plane-2.json", "mine");
    fails("ball.vdb --photos p --planes 3 --no-clobber", 1, "p/plane-2.json: exists");
    EXPECT_EQ(read_file(scratch / "p/plane-2.json"), "mine");
    EXPECT_FALSE(std::filesystem::exists(scratch / "p/plane-1.json"));
}

} // namespace
} // namespace taihu
