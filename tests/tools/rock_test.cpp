// taihu rock, through the program: presets, recipes, and what other files carry.
#include <cmath>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "stats/core/file.h"
#include "stats/io/holes_file.h"
#include "tests/support/command.h"

namespace taihu {
namespace {

using nlohmann::json;
using testing::HasSubstr;

bool same_bytes(const Scratch& folder, const std::string& a, const std::string& b) {
    return read_file(folder / a) == read_file(folder / b);
}

const std::string kRock1 = TAIHU_DATA "/measurements/rock1.csv";

TEST(Rock, MakesAgainWhatOtherVerbsMade) {
    const Scratch folder;
    must("taihu fit " + kRock1 + " -o law.json -q", folder);
    must("taihu shape boulder --seed 3 --dim 48 -o base.vdb -q", folder);
    must("taihu carve base.vdb --holes law.json --scale 25% --porosity 0.25 -o rock.vdb -q",
         folder);
    must("taihu carve base.vdb --holes law.json --scale 25% --count 9 --pattern joints -o rock.glb "
         "-q",
         folder);
    must("taihu sample law.json --in base.vdb --scale 25% --count 20 -o holes.csv -q", folder);
    must("taihu carve base.vdb --holes holes.csv --pieces all --bubbles keep -o listed.vdb -q",
         folder);
    must("taihu lod rock.vdb --levels 2 -o levels.glb -q", folder);
    for (const std::string file :
         {"base.vdb", "rock.vdb", "rock.glb", "listed.vdb", "levels.glb"}) {
        const std::string again = "again_" + file;
        must("taihu rock --from " + file + " -o " + again + " -q", folder);
        EXPECT_TRUE(same_bytes(folder, file, again)) << file;
    }
}

TEST(Rock, MeshBasesAreClosedAsAskedAndMadeAgain) {
    const Scratch folder;
    // A cube of 100 mm with +Z up, open on top.
    write_file(folder / "cube.obj", "v 0 0 0\nv 100 0 0\nv 100 100 0\nv 0 100 0\n"
                                    "v 0 0 100\nv 100 0 100\nv 100 100 100\nv 0 100 100\n"
                                    "f 4 3 2 1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
    write_file(folder / "h.csv", "x_m,y_m,z_m,radius_m\n0.05,0.05,-0.05,0.02\n");
    for (const std::string how :
         {"--close loops", "--close winding", "--close plane", "--close loops --shells parity"}) {
        must("taihu voxelize cube.obj --units mm --up z --dim 40 " + how + " -o base.vdb -q",
             folder);
        must("taihu carve cube.obj --unit 0.001 --up z --dim 40 " + how +
                 " --holes h.csv -o rock.vdb -q",
             folder);
        for (const std::string file : {"base.vdb", "rock.vdb"}) {
            must("taihu rock --from " + file + " -o again.vdb -q", folder);
            EXPECT_TRUE(same_bytes(folder, file, "again.vdb")) << how << ' ' << file;
        }
        const Finished said = run("taihu measure base.vdb --json -q", folder.path());
        EXPECT_NEAR(json::parse(said.out)["volume_m3"].get<double>(), 1e-3, 3e-5) << how;
    }
    for (const char* wrong : {"--close winding --shells parity", "--units furlong", "--up x"}) {
        const Finished said =
            run("taihu voxelize cube.obj " + std::string(wrong) + " -o no.vdb", folder.path());
        EXPECT_EQ(said.exit_code, 2) << wrong << said.err;
    }
}

TEST(Rock, AMeshOfAnotherFileIsRefused) {
    const Scratch folder;
    must("taihu shape boulder --subdivisions 3 -o base.ply -q", folder);
    must("taihu voxelize base.ply --dim 40 -o base.vdb -q", folder);
    must("taihu rock --from base.vdb -o again.vdb -q", folder);
    EXPECT_TRUE(same_bytes(folder, "base.vdb", "again.vdb"));
    must("taihu shape boulder --subdivisions 2 -o base.ply -q", folder);
    const Finished said = run("taihu rock --from base.vdb -o again.vdb -q", folder.path());
    EXPECT_EQ(said.exit_code, 1);
    EXPECT_THAT(said.err, HasSubstr("another file than the one the recipe means"));
}

TEST(Rock, PresetsAreRocksOfAnyHeightAndSeed) {
    const Scratch folder;
    const std::string preset = "taihu rock --preset taihu --dim 40 --height 1.8m ";
    must(preset + "--seed 7 -o a.vdb -q", folder);
    must(preset + "--seed 7 --threads 1 -o b.vdb -q", folder);
    must(preset + "--seed 8 -o c.vdb -q", folder);
    must(preset + "--seed 7 --set holes=1 -o d.vdb -q", folder);
    EXPECT_TRUE(same_bytes(folder, "a.vdb", "b.vdb"));
    EXPECT_FALSE(same_bytes(folder, "a.vdb", "c.vdb"));
    const auto measured = [&](const char* file) {
        return json::parse(run(std::string("taihu measure --json ") + file, folder.path()).out);
    };
    const json a = measured("a.vdb"), d = measured("d.vdb");
    EXPECT_GT(d["volume_m3"].get<double>(), a["volume_m3"].get<double>());
    // Holes may bite the top and the foot off, no more than that.
    const double height = a["box_hi_m"][1].get<double>() - a["box_lo_m"][1].get<double>();
    EXPECT_LE(height, 1.81);
    EXPECT_GT(height, 1.2);
}

TEST(Rock, EachPresetIsACertifiedRock) {
    const Scratch folder;
    const json list = json::parse(run("taihu rock --list --json", folder.path()).out);
    EXPECT_GE(list.size(), 12u);
    for (const auto& [name, about] : list.items()) {
        must("taihu rock --preset " + name + " --dim 40 -o rock.ply -q", folder);
        must("taihu check rock.ply -q", folder);
    }
}

TEST(Rock, ADryRunIsNearWhatItWillBe) {
    const Scratch folder;
    const json dry = json::parse(
        run("taihu rock --preset ladder_c --dim 128 --dry-run --json", folder.path()).out);
    const json run_of = json::parse(
        run("taihu rock --preset ladder_c --dim 128 -o r.vdb --json", folder.path()).out);
    // Leaves follow the surface, which a voxel four times as large has a little less of.
    const double ratio = dry["leaves"].get<double>() / run_of["leaves"].get<double>();
    EXPECT_GT(ratio, 0.5);
    EXPECT_LT(ratio, 2);
}

TEST(Rock, SaysWhatIsWrongInOneLine) {
    const Scratch folder;
    write_file(folder / "r.json",
               R"({"taihu_recipe": 1, "solid": {"sphere": {"size_m": [1, 1]}}})");
    const auto refusal = [&](const std::string& command, int code) {
        const Finished said = run(command, folder.path());
        EXPECT_EQ(said.exit_code, code) << command;
        EXPECT_EQ(std::count(said.err.begin(), said.err.end(), '\n'), 1) << said.err;
        return said.err;
    };
    EXPECT_THAT(refusal("taihu rock --preset taihuu -o a.vdb", 2),
                HasSubstr("did you mean 'taihu'"));
    EXPECT_THAT(refusal("taihu rock r.json -o a.vdb", 1),
                HasSubstr("r.json: solid.sphere: 'size_m'"));
    EXPECT_THAT(refusal("taihu rock -o a.vdb", 2), HasSubstr("say what to make"));
    EXPECT_THAT(refusal("taihu rock --preset taihu --set hole=1 -o a.vdb", 2),
                HasSubstr("did you mean 'holes'"));
    EXPECT_THAT(refusal("taihu rock --preset taihu", 2), HasSubstr("say where to write it"));
    write_file(folder / "ball.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    EXPECT_THAT(refusal("taihu rock --from ball.obj -o a.vdb", 1), HasSubstr("carries no recipe"));
}

/// How regular holes are: mean distance to the nearest other centre over the lattice constant of
/// as many in a cubic lattice, and the coefficient of variation of their radii.
struct Regularity {
    double nearest = 0, size_cv = 0;
};

Regularity regularity(const std::vector<Sphere>& holes) {
    Regularity r;
    double sum = 0, squares = 0, spread = 0;
    for (const Sphere& a : holes) {
        double nearest = std::numeric_limits<double>::infinity();
        for (const Sphere& b : holes)
            if (&a != &b)
                nearest = std::min(nearest, length(a.center - b.center));
        r.nearest += nearest;
        spread += nearest * nearest;
        sum += a.radius_m;
        squares += a.radius_m * a.radius_m;
    }
    const auto n = static_cast<double>(holes.size());
    r.nearest = std::sqrt(std::max(0.0, spread / n - r.nearest * r.nearest / (n * n))) /
                (r.nearest / n); // how much these distances vary: 0 in a lattice
    r.size_cv = std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n))) / (sum / n);
    return r;
}

TEST(SeedRow, E55TheLadderRisesFromALatticeToMeasuredHoles) {
    const Scratch folder;
    std::vector<Regularity> steps;
    for (const char* step : {"a", "b", "c", "d"}) {
        must(std::string("taihu rock --preset ladder_") + step +
                 " --dim 40 --holes h.csv -o r.vdb -q",
             folder);
        steps.push_back(regularity(read_holes(folder / "h.csv")));
    }
    EXPECT_LT(steps[0].nearest, 1e-6); // a lattice of equal balls, but for rounding in the file
    EXPECT_LT(steps[0].size_cv, 1e-6);
    EXPECT_GT(steps[1].nearest, 0.2); // anywhere: 0.36 for a Poisson process in space
    EXPECT_LT(steps[1].size_cv, 1e-6);
    EXPECT_NEAR(steps[2].size_cv, 0.577, 0.15); // uniform from 0: 1 / sqrt(3)
    EXPECT_NEAR(steps[3].size_cv, 1, 0.25);     // exponential
}

} // namespace
} // namespace taihu
