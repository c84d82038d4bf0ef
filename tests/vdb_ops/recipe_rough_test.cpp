#include <string>

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include "tests/support/errors.h"
#include "tests/support/grids.h"
#include "tests/support/scratch.h"
#include "vdb_ops/recipe_solid.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

using testing::HasSubstr;

std::string recipe(const std::string& solid, int seed = 0) {
    return R"({"taihu_recipe": 1, "voxel_m": 0.04, "seed": )" + std::to_string(seed) +
           R"(, "set": {"amplitude": "/solid/rough/amplitude_m"}, "solid": )" + solid + "}";
}

const std::string kBall = R"({"sphere": {"size_m": [1, 1, 1]}})";

std::string node(const std::string& kind, const std::string& keys, const std::string& of = kBall) {
    return "{\"" + kind + "\": {\"of\": " + of + (keys.empty() ? "" : ", ") + keys + "}}";
}

const std::string kRough = node("rough", R"("amplitude_m": 0.03, "largest_m": 0.4, "seed": 5)");
const std::string kBites =
    node("bites", R"("count": 40, "mean_m": 0.15, "least_m": 0.1, "most_m": 0.3)");

RecipeSolid made(const std::string& text, const RecipeSettings& settings = {}) {
    return make_recipe(text, "r.json", {}, settings);
}

TEST(RecipeRough, NodesNestAndFollowTheRecipesSeed) {
    const std::string tree =
        node("clean", "",
             node("rough", R"("relief": "furrows", "amplitude_m": 0.02, "largest_m": 0.2)",
                  node("weather", R"("sigma_m": 0.05)",
                       node("warp", R"("amplitude_m": 0.03, "largest_m": 0.8)", kBites))));
    const RecipeSolid one = made(recipe(tree, 1)), two = made(recipe(tree, 2));
    EXPECT_NE(volume_m3(*one.solid), volume_m3(*two.solid));
    EXPECT_EQ(one.field, nullptr); // only the level set says where its surface is
    EXPECT_THAT(one.found, testing::Contains(HasSubstr("bites: 40 bites")));
    EXPECT_THAT(one.found, testing::Contains(HasSubstr("weather: volume -")));
    // The recipe in the output makes it again, on one thread, too.
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(grid_hash(*made(one.recipe).solid), grid_hash(*one.solid));
}

TEST(RecipeRough, GrowsWithTheSolid) {
    const double once = volume_m3(*made(recipe(kRough)).solid);
    RecipeSettings larger;
    const std::string twice = R"({"transform": {"of": )" + kRough + R"(, "scale": 2}})";
    larger.voxel_m = 0.08;
    // Rounding aside it is the same lattice: a thousandth.
    EXPECT_NEAR(volume_m3(*made(recipe(twice), larger).solid), 8 * once, 0.008 * once);
}

TEST(RecipeRough, SettingsReachTheNodes) {
    const std::string text = with_setting(recipe(kRough), "r.json", "amplitude", "0");
    const double ball = volume_m3(*made(recipe(kBall)).solid);
    EXPECT_NEAR(volume_m3(*made(text).solid), ball, 0.002 * ball); // redistanced
}

TEST(RecipeRough, BuildsOnFieldsAndUnderThem) {
    const std::string holed =
        R"({"difference": {"of": [)" + kRough +
        R"(, {"transform": {"of": {"sphere": {"size_m": [1, 1, 1]}}, "move_m": [0.5, 0, 0]}}]}})";
    const double rough = volume_m3(*made(recipe(kRough)).solid),
                 cut = volume_m3(*made(recipe(holed)).solid);
    EXPECT_GT(rough - cut, 0.05);
    EXPECT_GT(cut, 0.2);
}

TEST(RecipeRough, ANodeIsMadeOnceThoughHolesAreBlendedIntoIt) {
    const std::string holes =
        R"({"holes": {"law": {"family": "exponential", "parameters": {"rate": 10}}, "count": 9}})";
    const RecipeSolid sponge =
        made(recipe(R"({"difference": {"blend_m": 0.02, "of": [)" + kBites + ", " + holes + "]}}"));
    EXPECT_EQ(std::count_if(sponge.found.begin(), sponge.found.end(),
                            [](const std::string& line) { return line.ends_with("40 bites"); }),
              1);
}

TEST(RecipeRough, EstimatesComeFromACoarserSolid) {
    const RecipeEstimate e = estimate_recipe(recipe(kRough), "r.json", {});
    EXPECT_GT(e.size.n_leaves, 50);
}

TEST(RecipeRough, TilesAreRefusedByName) {
    const Scratch scratch;
    expect_error(Fault::unsupported,
                 "r.json: solid.rough: needs the whole solid in memory, and tiles are made one by "
                 "one; make it without --tiles",
                 [&] { make_recipe_tiles(recipe(kRough), "r.json", {}, {}, scratch / "t", 64); });
}

TEST(RecipeRough, SaysWhereANodeIsWrong) {
    const auto refused = [](const std::string& solid, const std::string& what) {
        expect_error(Fault::bad_input, what, [&] { made(recipe(solid)); });
    };
    refused(node("rough", R"("amplitude_m": 0.1)"),
            "r.json: solid.rough: key 'largest_m' is missing");
    refused(node("rough", R"("amplitude": 0.1, "largest_m": 1)"), "did you mean 'amplitude_m'");
    refused(node("rough", R"("amplitude_m": -1, "largest_m": 1)"), "'amplitude_m' is -1");
    refused(node("rough", R"("amplitude_m": 0.1, "largest_m": 1, "relief": "bumps")"),
            "must be one of fractal, furrows, facets, beds");
    refused(node("rough", R"("amplitude_m": 0.1, "largest_m": 1, "crack": 1)"), "'crack'");
    refused(node("rough", R"("amplitude_m": 0.1, "largest_m": 1, "relief": "beds", "hurst": 1)"),
            "'hurst'");
    refused(node("rough", R"("amplitude_m": 0.1, "largest_m": 1, "relief": "furrows",
                              "hurst": [1, 0.5])"),
            "only a fractal has one for up and one for down");
    refused(node("rough", R"("amplitude_m": 0.1, "largest_m": 1, "removes": 1)"),
            "'removes' must be true or false");
    refused(node("warp", R"("amplitude_m": 0.1, "largest_m": 1, "hurst": [1, 1])"), "'hurst'");
    refused(node("weather", R"("sigma_m": 0.1, "steps": 1.5)"), "'steps' is 1.5; must be a whole");
    refused(node("weather", R"("sigma_m": 0.1, "hollowing": 3)"), "'hollowing' is 3");
    refused(node("bites", R"("count": 4, "mean_m": 1, "least_m": 1, "most_m": 2,
                              "begin": "inside", "offset": 1)"),
            "'offset' is from the surface, and they begin inside; drop one of them");
    refused(node("rough", R"("amplitude_m": 0.1, "largest_m": 1, "smallest_m": 2)"),
            "solid.rough: smallest_m is 2, must be 1.52587890625e-05..1");
}

} // namespace
} // namespace taihu
