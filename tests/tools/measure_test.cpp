// taihu measure --pores and --tradition.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/command.h"

namespace taihu {
namespace {

using nlohmann::json;
using testing::HasSubstr;

/// A box of a metre with 300 equal holes of 0.12 m: base.vdb, rock.vdb, law.json.
void make_rock(const Scratch& scratch) {
    write_file(scratch / "law.json",
               R"({"taihu_law": 1, "family": "constant", "parameters": {"diameter": 0.12},
                   "intervals": {}, "level": null, "unit": "m", "mean_diameter": 0.12,
                   "n_v": null, "detection_limit": null, "n_profiles": 0, "area": null,
                   "ranking": [], "source": []})");
    result("taihu shape box --dim 72 -o base.vdb", scratch);
    result("taihu carve base.vdb --holes law.json --density 300 --pieces all --bubbles keep "
           "-o rock.vdb",
           scratch);
}

TEST(MeasureVerb, PoresStandBesideWhatTheLawPredicts) {
    const Scratch scratch;
    make_rock(scratch);
    const std::string command =
        "taihu measure rock.vdb --base base.vdb --pores --samples 5000 --seed 2 --law law.json "
        "--density 300";
    const json m = result(command, scratch);
    const json& pores = m["pores"];
    EXPECT_EQ(pores["lines"], 5000);
    EXPECT_EQ(pores["seed"], 2);
    EXPECT_EQ(pores["coarser"], 1);
    EXPECT_NEAR(pores["voxel_m"].get<double>(), 1 / 72., 1e-4);
    EXPECT_EQ(pores["correlation"].size(), 32u);
    EXPECT_EQ(pores["solid_chords"]["histogram"]["shares"].size(), 20u);
    EXPECT_EQ(pores["walls"]["quantiles_m"].size(), 5u);
    EXPECT_NEAR(pores["pores"]["quantiles_m"][2][1].get<double>(), 0.12, 1 / 72.);
    const json& compared = m["compared"];
    EXPECT_EQ(compared.size(), 4u + 32u);
    for (const char* key : {"porosity", "s_v_m1", "solid_chord_m", "hole_chord_m"}) {
        const double differs = compared[key]["differs_se"].get<double>();
        EXPECT_LT(std::abs(differs), 5) << key; // four, and what ridges lose at nine voxels a hole
        EXPECT_NEAR(
            differs,
            (compared[key]["measured"].get<double>() - compared[key]["predicted"].get<double>()) /
                compared[key]["se"].get<double>(),
            1e-9);
    }
    EXPECT_EQ(compared["porosity"]["predicted"], m["predicted"]["porosity"]);
    const Finished said = run(command, scratch.path());
    for (const char* words : {"hole surface", "a line runs through", "walls", "Euler", "predicted",
                              "both in holes", " se"})
        EXPECT_THAT(said.err, HasSubstr(words));
    EXPECT_EQ(said.out, "");
}

TEST(MeasureVerb, MeshesAreVoxelizedForIt) {
    const Scratch scratch;
    make_rock(scratch);
    result("taihu mesh base.vdb --uniform -o base.ply", scratch);
    result("taihu mesh rock.vdb --uniform -o rock.ply", scratch);
    const json grids =
        result("taihu measure rock.vdb --base base.vdb --pores --samples 2000", scratch);
    for (const char* command :
         {"taihu measure rock.vdb --base base.ply --pores --samples 2000",
          "taihu measure rock.ply --dim 72 --base base.ply --pores --samples 2000"}) {
        const json meshes = result(command, scratch);
        // The same lines through other samples of the same surface.
        EXPECT_NEAR(meshes["pores"]["s_v_m1"]["value"].get<double>(),
                    grids["pores"]["s_v_m1"]["value"].get<double>(), 0.5)
            << command;
    }
}

TEST(MeasureVerb, TraditionSaysWhatIsResolved) {
    const Scratch scratch;
    make_rock(scratch);
    const json t = result("taihu measure rock.vdb --tradition", scratch)["tradition"];
    for (const auto& [group, keys] : std::map<std::string, std::vector<std::string>>{
             {"thin", {"body_in_hull", "body_in_box", "slenderness", "waist", "wall_share"}},
             {"seen_through",
              {"open_share", "views_with_window_share", "windows_per_view", "widest_window_m"}},
             {"leaky", {"channel_m", "sealed_voids", "sealed_porosity"}},
             {"wrinkled", {"area_ratio", "roughness_share", "curvature", "concave_share"}}})
        for (const std::string& key : keys) {
            const json& item = t[group][key];
            ASSERT_TRUE(item["value"].is_number()) << group << ' ' << key;
            const double fine = item["value"].get<double>(), coarse = item["coarse"].get<double>();
            EXPECT_EQ(item["settled"].get<bool>(),
                      std::abs(fine - coarse) <= 0.05 * std::max(std::abs(fine), std::abs(coarse)));
        }
    ASSERT_EQ(t["leaky"]["balls"].size(), 4u);
    EXPECT_EQ(t["leaky"]["balls"][0]["diameter_m"], 0);
    EXPECT_GT(t["leaky"]["sealed_voids"]["value"].get<int>(), 0); // bubbles were kept
    const Finished said = run("taihu measure rock.vdb --tradition", scratch.path());
    for (const char* words :
         {"thin:", "seen through:", "leaky:", "wrinkled:", "half the resolution"})
        EXPECT_THAT(said.err, HasSubstr(words));
}

TEST(MeasureVerb, SaysTheSameOnAnyNumberOfThreads) {
    const Scratch scratch;
    make_rock(scratch);
    const std::string command = "taihu measure rock.vdb --base base.vdb --pores --tradition "
                                "--samples 1000 --threads ";
    EXPECT_EQ(result(command + "1", scratch), result(command + "3", scratch));
}

TEST(MeasureVerb, RefusesOptionsWithoutEffect) {
    const Scratch scratch;
    result("taihu shape sphere --dim 16 -o ball.vdb", scratch);
    for (const auto& [options, words] :
         std::map<std::string, std::string>{{"--samples 1000", "--pores"},
                                            {"--pores --samples 99", "100"},
                                            {"--seed 3", "--pores"},
                                            {"--dim 64", "drop --dim"},
                                            {"--pores --dim 64", "drop --dim"}}) {
        const Finished said = run("taihu measure ball.vdb " + options, scratch.path());
        EXPECT_EQ(said.exit_code, 2) << options;
        EXPECT_THAT(said.err, HasSubstr(words)) << options;
    }
}

} // namespace
} // namespace taihu
