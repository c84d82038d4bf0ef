#include "vdb_ops/recipe.h"

#include "tests/support/errors.h"

namespace taihu {
namespace {

TEST(Recipe, IsWrittenInOneOrderAndShortestNumbers) {
    Placement placement;
    placement.porosity = 0.25;
    placement.scale_m = 0.1;
    placement.seed = 7;
    const std::string solid =
        clean_node(difference_node(shape_node({.kind = ShapeKind::box, .size_m = {1, 2, 0.5}}),
                                   holes_node("law.json", "ab", placement)),
                   {});
    EXPECT_EQ(format_recipe(solid, 0.01, 7),
              R"({"taihu_recipe":1,"seed":7,"voxel_m":0.01,"solid":{"clean":{"of":{"difference":)"
              R"({"of":[{"box":{"size_m":[1.0,2.0,0.5]}},{"holes":{"law":"law.json","sha256":"ab",)"
              R"("porosity":0.25,"scale_m":0.1,"seed":7}}]}},"pieces":1,"bubbles":"fill"}}})");
}

TEST(Recipe, ShapesSayWhatTheyRead) {
    EXPECT_EQ(shape_node({.kind = ShapeKind::rounded_box, .round_m = 0.1}),
              R"({"rounded_box":{"size_m":[1.0,1.0,1.0],"round_m":0.1}})");
    EXPECT_EQ(shape_node({.kind = ShapeKind::superquadric, .vertical = 0.5}),
              R"({"superquadric":{"size_m":[1.0,1.0,1.0],"exponents":[0.5,1.0]}})");
    EXPECT_EQ(shape_node({.kind = ShapeKind::capsule}), R"({"capsule":{"size_m":[1.0,1.0,1.0]}})");
}

TEST(Recipe, HolesSayHowTheyLie) {
    const auto node = [](const Pattern& pattern) {
        Placement placement;
        placement.pattern = pattern;
        const std::string text = holes_node("law.json", "ab", placement);
        return text.substr(text.find(R"("seed")"));
    };
    EXPECT_EQ(node(UniformPattern{}), R"("seed":0}})");
    EXPECT_EQ(node(ClusterSettings{ClusterSettings::Shape::thomas, 20, 0.07}),
              R"("seed":0,"pattern":{"thomas":{"clusters_m3":20.0,"spread_m":0.07}}}})");
    EXPECT_EQ(node(ClusterSettings{ClusterSettings::Shape::matern, 20, 0.07}),
              R"("seed":0,"pattern":{"matern":{"clusters_m3":20.0,"spread_m":0.07}}}})");
    EXPECT_EQ(node(JointsPattern{4, 0.01}),
              R"("seed":0,"pattern":{"joints":{"n":4,"scatter_m":0.01}}}})");
    EXPECT_EQ(node(HardCorePattern{0.5}), R"("seed":0,"pattern":{"hard_core":{"gap_m":0.5}}}})");
    EXPECT_EQ(node(LatticePattern{0.25}), R"("seed":0,"pattern":{"lattice":{"spacing_m":0.25}}}})");
}

TEST(Recipe, HolesSayWhatTheyAreMadeFrom) {
    Placement placement;
    placement.count = 3;
    placement.height = {0.25, 1};
    EXPECT_EQ(holes_node("law.json", "ab", placement, {true, SourceFile{"fog.vdb", "cd"}}),
              R"({"holes":{"law":"law.json","sha256":"ab","empirical":true,"count":3,)"
              R"("scale_m":1.0,"seed":0,"height":[0.25,1.0],)"
              R"("where":{"file":"fog.vdb","sha256":"cd"}}})");
}

TEST(Recipe, ASolidCanBeBuiltOn) {
    const std::string ball = shape_node({.kind = ShapeKind::sphere});
    const std::string recipe = format_recipe(ball, 0.01, 0);
    EXPECT_EQ(recipe_solid(recipe), ball);
    const std::string chain = format_recipe(ball, 0.01, 0, RecipeLod{.bounds_m = {0.005, 0.01}});
    EXPECT_EQ(recipe_solid(chain), ball);
    EXPECT_THAT(chain, testing::HasSubstr(R"("lod":{"bounds_m":[0.005,0.01]})"));
}

TEST(Recipe, WhatIsNoneIsSaid) {
    EXPECT_EQ(recipe_solid("{}"), std::nullopt);
    EXPECT_EQ(recipe_solid("not json"), std::nullopt);
    EXPECT_EQ(recipe_solid(std::string(200000, '[')), std::nullopt);
    EXPECT_EQ(recipe_solid("{\"taihu_recipe\": 1, \"solid\": \"\xff\"}"), std::nullopt);
}

} // namespace
} // namespace taihu
