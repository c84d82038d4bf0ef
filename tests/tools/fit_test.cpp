// taihu fit, through the program: what it says of photos, and of laws that were asked for.
#include <cmath>
#include <cstdlib>
#include <string>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "stats/core/file.h"
#include "stats/core/rng.h"
#include "stats/section_draws.h"
#include "tests/support/process.h"

namespace taihu {
namespace {

using nlohmann::json;
using testing::HasSubstr;

/// A labelme file of 60 holes of mean 40 px on 1200 x 900 px, and a scale bar of 300 px.
void draw_photo(const Scratch& folder, const std::string& image = "stone.jpg") {
    json shapes = json::array();
    const auto add = [&](const char* label, double x1, double y1, double x2, double y2) {
        shapes.push_back(
            {{"label", label}, {"points", {{x1, y1}, {x2, y2}}}, {"shape_type", "line"}});
    };
    const SectionDraws draws(Law::exponential(1 / 40.0), 12);
    const Rng rng{1, 2};
    for (std::uint64_t i = 0; i < 60; ++i) {
        const double d = draws.diameter({1, 1}, i);
        const double x = d / 2 + (1200 - d) * rng.uniform(i, 0);
        const double y = 900 * rng.uniform(i, 1);
        add("hole", x - d / 2, y, x + d / 2, y);
    }
    add("scale", 50, 850, 350, 850);
    write_file(folder / "photo.json", json({{"version", "5.0.1"},
                                            {"shapes", shapes},
                                            {"imagePath", image},
                                            {"imageHeight", 900},
                                            {"imageWidth", 1200}})
                                          .dump());
}

const std::string kFit = "taihu fit photo.json --scale-bar 0.5m --detection-limit 0.02 "
                         "--family exponential --resamples 99 ";

std::string report(const Scratch& folder, const std::string& more = "") {
    const Finished said = run(kFit + "--report r.html " + more, folder.path());
    EXPECT_EQ(said.exit_code, 0) << said.err;
    return read_file(folder / "r.html");
}

TEST(Fit, OneCommandTurnsAPhotoIntoLawCountAndPage) {
    const Scratch folder;
    draw_photo(folder);
    ASSERT_EQ(run("taihu shape sphere --size 1m -o ball.vdb --dim 48 -q", folder.path()).exit_code,
              0);
    const Finished said =
        run(kFit + "--in ball.vdb --report r.html -o law.json --json", folder.path());
    ASSERT_EQ(said.exit_code, 0) << said.err;
    const json law = json::parse(said.out);
    EXPECT_EQ(law["unit"], "m");
    EXPECT_EQ(law["n_profiles"], 60);
    EXPECT_GT(law["empirical"].size(), 5u);
    // N_V times the volume of the ball, which 48 voxels have to a percent.
    const double expected = law["n_v"]["estimate"].get<double>() * M_PI / 6;
    const auto at = said.err.find("Your rock has about ");
    ASSERT_NE(at, std::string::npos) << said.err;
    // Two digits, and the voxels of the ball.
    EXPECT_NEAR(std::atof(said.err.c_str() + at + 20), expected, 0.07 * expected);
    const std::string page = read_file(folder / "r.html");
    for (const char* part : {"What this says", "What was marked", "Which law", "<svg",
                             "Where the holes lie", "What to do better next time", "SHA-256"})
        EXPECT_NE(page.find(part), std::string::npos) << part;
    for (const char* part : {"src=", "href=\"http", "url(http"}) // nothing is fetched
        EXPECT_EQ(page.find(part), std::string::npos) << part;
}

TEST(Fit, TheReportIsTheSameEveryTime) {
    const Scratch folder;
    draw_photo(folder);
    const std::string page = report(folder);
    EXPECT_TRUE(page == report(folder));
    EXPECT_FALSE(page == report(folder, "--seed 5"));
}

TEST(Fit, NamesOfPhotosAreNoMarkup) {
    const Scratch folder;
    draw_photo(folder, "<script>alert(1)&.jpg");
    const std::string page = report(folder);
    EXPECT_EQ(page.find("<script"), std::string::npos);
    EXPECT_NE(page.find("&lt;script&gt;alert(1)&amp;.jpg"), std::string::npos);
}

TEST(Fit, AReportForProgramsHasTheTests) {
    const Scratch folder;
    draw_photo(folder);
    ASSERT_EQ(run(kFit + "--volume 2 --report r.json", folder.path()).exit_code, 0);
    const json r = json::parse(read_file(folder / "r.json"));
    EXPECT_GT(r["goodness"]["anderson_darling"]["p_value"], 0.05);
    EXPECT_EQ(r["locations"][0]["points"], 60);
    EXPECT_GT(r["holes"]["estimate"], 0);
    EXPECT_TRUE(r["holes_biting"].is_null()); // a volume has no surface
}

TEST(Fit, WithoutGnuplotAReportNamesThePackage) {
    const Scratch folder;
    draw_photo(folder);
    write_file(folder / "go.sh", "PATH='" TAIHU_PROGRAM_DIR "' exec " + kFit + "--report r.html");
    const Finished said = run("/bin/sh go.sh", folder.path());
    EXPECT_EQ(said.exit_code, 1);
    EXPECT_THAT(said.err, HasSubstr("install the Debian package gnuplot-nox"));
    EXPECT_FALSE(std::filesystem::exists(folder / "r.html"));
}

TEST(Fit, AnAreaFactorThinsTheHoles) {
    const Scratch folder;
    draw_photo(folder);
    const auto n_v = [&](const std::string& more) {
        return json::parse(run(kFit + "--json " + more, folder.path()).out)["n_v"]["estimate"]
            .get<double>();
    };
    EXPECT_NEAR(n_v("--area-factor 2"), n_v("") / 2, 1e-9 * n_v(""));
    const Finished said = run(kFit + "--area 3 --area-factor 2", folder.path());
    EXPECT_EQ(said.exit_code, 2);
    EXPECT_THAT(said.err, HasSubstr("give the area of the surface itself"));
    EXPECT_THAT(run(kFit + "--area-factor 0.5", folder.path()).err, HasSubstr("must be in 1..100"));
}

TEST(Fit, SaysWhetherProfilesObeyALaw) {
    const Scratch folder;
    draw_photo(folder);
    ASSERT_EQ(run(kFit + "-o own.json", folder.path()).exit_code, 0);
    const Finished own = run(kFit + "--expect own.json --json", folder.path());
    EXPECT_EQ(own.exit_code, 0) << own.err;
    EXPECT_TRUE(json::parse(own.out)["obeys"]);
    // Lengths twice as long: the sizes are off, and so is the number per volume.
    const Finished other = run(kFit + "--expect own.json --expect-scale 2m --json", folder.path());
    EXPECT_EQ(other.exit_code, 3);
    EXPECT_LT(json::parse(other.out)["sizes_p"], 0.02);
    EXPECT_THAT(other.err, HasSubstr("do not obey"));
    const Finished more = run(kFit + "--expect own.json --expect-density 2000", folder.path());
    EXPECT_EQ(more.exit_code, 3);
    EXPECT_THAT(more.err, HasSubstr("number of profiles: 60 found"));
}

TEST(Fit, TheThesisTableIsALawToDrawFrom) {
    const Scratch folder;
    const std::string rock1 = TAIHU_DATA "/measurements/rock1.csv";
    ASSERT_EQ(run("taihu fit " + rock1 + " --method thesis -o t.json", folder.path()).exit_code, 0);
    const json law = json::parse(read_file(folder / "t.json"));
    EXPECT_EQ(law["family"], "empirical");
    EXPECT_EQ(law["n_profiles"], 46);
    EXPECT_EQ(run("taihu sample t.json --box 1 --scale 20cm --count 50 -o h.csv", folder.path())
                  .exit_code,
              0);
}

TEST(Fit, RefusesWhatDoesNotGoTogether) {
    const Scratch folder;
    draw_photo(folder);
    const auto refusal = [&](const std::string& command) {
        const Finished said = run(command, folder.path());
        EXPECT_NE(said.exit_code, 0) << command;
        EXPECT_EQ(std::count(said.err.begin(), said.err.end(), '\n'), 1) << said.err;
        return said.err;
    };
    EXPECT_THAT(refusal("taihu fit photo.json --family exponentail -q"), HasSubstr("exponential"));
    EXPECT_THAT(refusal("taihu fit photo.json --in none.vdb -q"), HasSubstr("give --scale-bar"));
    EXPECT_THAT(refusal(kFit + "-q --report r.pdf"), HasSubstr("a .html or a .json"));
    EXPECT_THAT(refusal(kFit + "-q --report law.json -o law.json"), HasSubstr("law.json"));
    EXPECT_THAT(refusal("taihu fit photo.json --expect-scale 1m -q"), HasSubstr("--expect"));
    EXPECT_THAT(refusal("taihu fit photo.json --scale-bar 40 -q"), HasSubstr("write 40cm or 40m"));
    // Before anything is written.
    EXPECT_THAT(refusal(kFit + "--expect none.json -o early.json -q"), HasSubstr("none.json"));
    EXPECT_FALSE(std::filesystem::exists(folder / "early.json"));
    EXPECT_THAT(refusal("taihu fit photo.json --method thesis --report r.html -q"),
                HasSubstr("are for --method ml"));
}

} // namespace
} // namespace taihu
