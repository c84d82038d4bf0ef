// Where the holes of a law lie and how large they are, as sample and carve offer it.
#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <openvdb/openvdb.h>

#include "stats/io/holes_file.h"
#include "tests/support/command.h"

namespace taihu {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

/// An exponential law in metres, mean 0.1 m; half of its holes are below the limit. Its table has
/// diameters of 0.07 to 0.3 m.
void write_law(
    const Scratch& scratch, const std::string& name = "law.json",
    const std::string& more = R"("empirical": [[0.07, 0], [0.1, 0.4], [0.2, 0.9], [0.3, 1]],)") {
    write_file(scratch / name, R"({"taihu_law": 1, "family": "exponential",
        "parameters": {"rate": 10}, "intervals": {"rate": [8, 12]}, "level": 0.95,
        "unit": "m", "mean_diameter": 0.1,
        "n_v": {"estimate": 400, "lo": 300, "hi": 500, "extrapolated_share": 0.5},
        "detection_limit": 0.07, "n_profiles": 40, "area": 1,
        "ranking": [], )" + more + R"("source": []})");
}

/// The holes of `taihu sample law.json --box 1 OPTIONS`.
std::vector<Sphere> sample(const std::string& options, const Scratch& scratch) {
    result("taihu sample law.json --box 1 -o holes.csv " + options, scratch);
    return read_holes(scratch / "holes.csv");
}

/// Kolmogorov's distance from the uniform law on 0..1, in units of its 1 % critical value.
double distance_from_uniform(std::vector<double> u) {
    std::sort(u.begin(), u.end());
    double greatest = 0;
    const auto n = static_cast<double>(u.size());
    for (std::size_t i = 0; i < u.size(); ++i)
        greatest = std::max({greatest, u[i] - double(i) / n, double(i + 1) / n - u[i]});
    return greatest * std::sqrt(n) / 1.628;
}

double mean_diameter(const std::vector<Sphere>& holes) {
    double mean = 0;
    for (const Sphere& h : holes)
        mean += 2 * h.radius_m / static_cast<double>(holes.size());
    return mean;
}

TEST(Patterns, EachIsChosenByOneWordAndRecorded) {
    const Scratch scratch;
    write_law(scratch);
    result("taihu shape sphere --size 1 --dim 32 -o ball.vdb", scratch);
    const std::vector<std::array<std::string, 3>> kWords = {
        {"thomas", "pattern thomas: 20", R"({"thomas":{"clusters_m3":20,"spread_m":0.07)"},
        {"matern", "pattern matern: 20", R"({"matern":{"clusters_m3":20,"spread_m":0.18)"},
        {"joints", "pattern joints: 3 planes", R"({"joints":{"n":3,"scatter_m":0.015)"},
        {"hard-core", "pattern hard-core: gap 0.00", R"({"hard_core":{"gap_m":0.00)"}};
    for (const auto& [word, comment, node] : kWords) {
        const std::string options = " --count 40 --scale 0.3m --pattern " + word + " -q -o ";
        result("taihu sample law.json --in ball.vdb" + options + "holes.csv", scratch);
        EXPECT_THAT(read_file(scratch / "holes.csv"), HasSubstr("\n# " + comment));
        EXPECT_EQ(read_holes(scratch / "holes.csv").size(), 40u);
        const Finished told =
            run("taihu carve ball.vdb --holes law.json --count 40 --scale 0.3m --pattern " + word +
                    " -o rock.vdb",
                scratch.path());
        EXPECT_THAT(told.err, HasSubstr("rock.vdb: " + comment));
        const json recipe = result("taihu info rock.vdb", scratch)["recipe"];
        const json holes = recipe["solid"]["clean"]["of"]["difference"]["of"][1]["holes"];
        // Of the longest axis, which a level set knows to a part of its voxel.
        const json pattern = holes["pattern"], expected = json::parse(node + "}}");
        ASSERT_EQ(pattern.begin().key(), expected.begin().key());
        for (const auto& [key, value] : expected.begin()->items())
            EXPECT_NEAR(pattern.begin()->at(key).get<double>(), value.get<double>(),
                        word == "hard-core" ? 0.006 : 0.02 * value.get<double>())
                << word << ' ' << key;
    }
}

TEST(Patterns, ALatticeTakesASpacingOrADensity) {
    const Scratch scratch;
    write_law(scratch);
    EXPECT_EQ(sample("--pattern lattice --spacing 20cm", scratch).size(), 125u);
    EXPECT_EQ(sample("--pattern lattice --spacing 25%", scratch).size(), 64u);
    EXPECT_EQ(sample("--pattern lattice --density 1000", scratch).size(), 1000u);
    EXPECT_EQ(sample("--pattern lattice", scratch).size(), 343u); // n_v of 400: every 13.6 cm
    EXPECT_THAT(read_file(scratch / "holes.csv"), HasSubstr("pattern lattice (chosen): spacing"));
    write_law(scratch, "all.json", "");
    std::string text = read_file(scratch / "all.json");
    const std::size_t at = text.find("{\"estimate\"");
    text.replace(at, text.find('}', at) + 1 - at, "null");
    write_file(scratch / "law.json", text);
    EXPECT_EQ(sample("--pattern lattice", scratch).size(), 1000u); // 10 % of the axis
}

TEST(Patterns, WhatAPatternDoesNotUseIsRefusedByName) {
    const Scratch scratch;
    write_law(scratch);
    const auto fails = [&](const std::string& options, int code, const std::string& part) {
        const Finished said =
            run("taihu sample law.json --box 1 -o holes.csv " + options, scratch.path());
        EXPECT_EQ(said.exit_code, code) << options;
        EXPECT_EQ(std::count(said.err.begin(), said.err.end(), '\n'), 1) << said.err;
        EXPECT_THAT(said.err, HasSubstr(part));
    };
    fails("--count 5 --spread 5cm", 2, "--spread: is for --pattern thomas or matern, not uniform");
    fails("--count 5 --pattern joints --clusters 3", 2, "--clusters: is for --pattern thomas");
    fails("--count 5 --pattern thomas --joints 3", 2, "--joints: is for --pattern joints");
    fails("--count 5 --pattern thomas --scatter 3mm", 2, "--scatter: is for --pattern joints");
    fails("--count 5 --pattern thomas --gap 3mm", 2, "--gap: is for --pattern hard-core");
    fails("--count 5 --pattern thomas --spacing 3mm", 2, "--spacing: is for --pattern lattice");
    fails("--count 5 --pattern lattice", 2, "--count: a lattice has as many holes as");
    fails("--porosity 0.1 --pattern lattice", 2, "--porosity: a lattice has as many holes as");
    fails("--density 5 --pattern lattice --spacing 3cm", 2, "--density: --spacing says it already");
    fails("--count 5 --pattern thoma", 2, "--pattern");
    fails("--count 5 --pattern hard-core --gap -1mm", 2, "--gap: '-1mm' is no length");
    fails("--count 5 --pattern joints --joints 0", 2, "--joints");
    for (const char* height : {"1", "0:0", "0.2:", "-1:1", "0.2:1.5", "a:b", "0:1:1"})
        fails(std::string("--count 5 --height=") + height, 2, "--height: '");
    fails("--count 5 --where none.vdb", 1, "none.vdb");
    write_file(scratch / "table.csv", "x_m,y_m,z_m,radius_m\n0,0,0,0.1\n");
    result("taihu shape sphere --dim 16 -o ball.vdb", scratch);
    for (const char* option : {"--pattern joints", "--empirical", "--height 0:1", "--count 3"}) {
        const Finished said =
            run(std::string("taihu carve ball.vdb --holes table.csv -o a.vdb ") + option,
                scratch.path());
        EXPECT_EQ(said.exit_code, 2);
        EXPECT_THAT(said.err,
                    HasSubstr("drop " +
                              std::string(option).substr(0, std::string(option).find(' ')) +
                              ", it is for a law.json"));
    }
}

TEST(Patterns, HeightAndPlaceThinThemOut) {
    const Scratch scratch;
    write_law(scratch);
    double upper = 0;
    for (const Sphere& h : sample("--count 1000 --height 0:1 --pattern thomas", scratch))
        upper += h.center.y > 0.5;
    EXPECT_GT(upper, 600); // 750 of a straight trend; clusters make it uncertain
    EXPECT_THAT(read_file(scratch / "holes.csv"),
                HasSubstr("# height: 0 of the holes at the bottom, 1 at the top (chosen)"));

    result("taihu shape sphere --size 1 --dim 32 -o ball.vdb", scratch);
    for (const Sphere& h : sample("--count 200 --where ball.vdb", scratch))
        EXPECT_LT(length(h.center), 0.505); // the ball is about the corner of the box
    EXPECT_THAT(read_file(scratch / "holes.csv"), HasSubstr("# where ball.vdb: inside alone"));

    openvdb::initialize();
    const auto fog = openvdb::FloatGrid::create(0);
    fog->setGridClass(openvdb::GRID_FOG_VOLUME);
    fog->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
    fog->fill(openvdb::CoordBBox({-2, -2, -2}, {5, 20, 20}), 0.5f);
    openvdb::io::File file(scratch / "fog.vdb");
    file.write({fog});
    file.close();
    for (const Sphere& h : sample("--count 200 --where fog.vdb", scratch))
        EXPECT_LT(h.center.x, 0.6);
    result("taihu carve ball.vdb --holes law.json --count 9 --where fog.vdb --height 1:0.5 -o "
           "rock.vdb",
           scratch);
    const json recipe = result("taihu info rock.vdb", scratch)["recipe"];
    const json holes = recipe["solid"]["clean"]["of"]["difference"]["of"][1]["holes"];
    EXPECT_EQ(holes["where"]["file"], "fog.vdb");
    EXPECT_EQ(holes["where"]["sha256"].get<std::string>().size(), 64u);
    EXPECT_EQ(holes["height"], (json{1, 0.5}));
}

TEST(Patterns, ATableIsDrawnFromWhereTheFileHasOne) {
    const Scratch scratch;
    write_law(scratch);
    // n_v counts the half below the limit, the table does not.
    sample("--empirical", scratch);
    EXPECT_THAT(
        read_file(scratch / "holes.csv"),
        HasSubstr("# density 200 per m^3 (measured: the law's n_v of 400 times 0.5, because "
                  "the table has no holes below the detection limit)"));
    write_law(scratch, "bare.json", "");
    const Finished said =
        run("taihu sample bare.json --box 1 --empirical -o holes.csv", scratch.path());
    EXPECT_EQ(said.exit_code, 2);
    EXPECT_THAT(said.err, HasSubstr("bare.json: has no table 'empirical' for --empirical to draw "
                                    "from; drop it to draw from the fitted exponential law"));
    // A law that is a table already: the same holes with the word and without it.
    std::string text = read_file(scratch / "law.json");
    for (const auto& [from, to] : {std::pair<std::string, std::string>{"exponential", "empirical"},
                                   {R"({"rate": 10})", "{}"},
                                   {R"({"rate": [8, 12]})", "{}"},
                                   {R"("mean_diameter": 0.1)", R"("mean_diameter": 0.134)"}})
        text.replace(text.find(from), from.size(), to);
    write_file(scratch / "law.json", text);
    const auto with = sample("--count 50 --empirical", scratch);
    EXPECT_EQ(with, sample("--count 50", scratch));
}

// Number and scale of diameters are the user's; the density is another form of the number.
TEST(SeedRow, E40NumberScaleAndDensityAreExposed) {
    const Scratch scratch;
    write_law(scratch);
    const auto some = sample("--count 300", scratch);
    ASSERT_EQ(some.size(), 300u);
    const auto larger = sample("--count 300 --scale 3m", scratch);
    ASSERT_EQ(larger.size(), 300u);
    for (std::size_t i = 0; i < 300; ++i) { // the same holes, three times as large
        EXPECT_EQ(larger[i].center, some[i].center);
        EXPECT_NEAR(larger[i].radius_m, 3 * some[i].radius_m, 1e-15);
    }
    EXPECT_EQ(sample("--count 120", scratch).size(), 120u);
    // Spheres of a Poisson process that touch the box: centres in it and round it.
    const auto few = static_cast<double>(sample("--density 300", scratch).size()),
               many = static_cast<double>(sample("--density 900", scratch).size());
    EXPECT_GT(few, 300);
    // Four standard deviations of the ratio of two Poisson numbers of about 400 and 1200.
    EXPECT_NEAR(many / few, 3, 4 * 3 * std::sqrt(1 / few + 1 / many));
}

// Centres are uniform along X, Y and Z, from a generator with the same bytes on every machine.
TEST(SeedRow, E45CentresAreUniformAndPortable) {
    const Scratch scratch;
    write_law(scratch);
    const auto holes = sample("--count 5000 --seed 45", scratch);
    for (int axis = 0; axis < 3; ++axis) {
        std::vector<double> u;
        for (const Sphere& h : holes)
            u.push_back(h.center[axis]);
        EXPECT_LT(distance_from_uniform(u), 1) << axis;
    }
    // Recorded once: these bits must come out on every machine and of every later version.
    sample("--count 2 --seed 45", scratch);
    EXPECT_THAT(
        read_file(scratch / "holes.csv"),
        HasSubstr(
            "0.6494494872738797,0.10129120406123449,0.3569449630584035,0.010602557214285852\n"
            "0.5052269969776028,0.9277225661801792,0.9460539932868127,0.028640108424318973\n"));
}

// "From this photo" and fitted: a switch, and not the same.
TEST(SeedRow, E53EmpiricalAndFittedSamplingDiffer) {
    const Scratch scratch;
    write_law(scratch);
    const auto fitted = sample("--count 2000", scratch),
               measured = sample("--count 2000 --empirical", scratch);
    EXPECT_THAT(read_file(scratch / "holes.csv"),
                HasSubstr("# law law.json: empirical table of 4 points (measured, 40 profiles), in "
                          "place of the fitted exponential (chosen)"));
    std::vector<double> by_family, by_table;
    const std::vector<std::pair<double, double>> kTable = {
        {0.07, 0}, {0.1, 0.4}, {0.2, 0.9}, {0.3, 1}};
    for (std::size_t i = 0; i < 2000; ++i) {
        EXPECT_EQ(fitted[i].center, measured[i].center);
        by_family.push_back(1 - std::exp(-10 * 2 * fitted[i].radius_m));
        const double d = 2 * measured[i].radius_m;
        std::size_t k = 1;
        while (k < 3 && d > kTable[k].first)
            ++k;
        const auto [d0, f0] = kTable[k - 1];
        const auto [d1, f1] = kTable[k];
        by_table.push_back(f0 + (f1 - f0) * (d - d0) / (d1 - d0));
    }
    EXPECT_LT(distance_from_uniform(by_family), 1);
    EXPECT_LT(distance_from_uniform(by_table), 1);
    EXPECT_NEAR(mean_diameter(fitted), 0.1, 4 * 0.1 / std::sqrt(2000));
    EXPECT_NEAR(mean_diameter(measured), 0.134, 4 * 0.06 / std::sqrt(2000));

    result("taihu shape sphere --size 1 --dim 24 -o ball.vdb", scratch);
    result("taihu carve ball.vdb --holes law.json --count 9 --empirical -o table.vdb", scratch);
    result("taihu carve ball.vdb --holes law.json --count 9 -o family.vdb", scratch);
    EXPECT_THAT(result("taihu info table.vdb", scratch).dump(), HasSubstr(R"("empirical":true)"));
    EXPECT_THAT(result("taihu info family.vdb", scratch).dump(), Not(HasSubstr("empirical")));
}

} // namespace
} // namespace taihu
