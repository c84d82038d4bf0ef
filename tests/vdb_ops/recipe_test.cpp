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
                   1, true);
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

TEST(Recipe, ASolidCanBeBuiltOn) {
    const std::string ball = shape_node({.kind = ShapeKind::sphere});
    const std::string recipe = format_recipe(ball, 0.01, 0);
    EXPECT_EQ(recipe_solid(recipe), ball);
    const std::string chain = format_recipe(ball, 0.01, 0, RecipeLod{4, 0.005, 2});
    EXPECT_EQ(recipe_solid(chain), ball);
    EXPECT_THAT(chain, testing::HasSubstr(R"("lod":{"levels":4,"bound_m":0.005,"factor":2.0})"));
}

TEST(Recipe, WhatIsNoneIsSaid) {
    EXPECT_EQ(recipe_solid("{}"), std::nullopt);
    EXPECT_EQ(recipe_solid("not json"), std::nullopt);
    EXPECT_EQ(recipe_solid(std::string(200000, '[')), std::nullopt);
    EXPECT_EQ(recipe_solid("{\"taihu_recipe\": 1, \"solid\": \"\xff\"}"), std::nullopt);
}

} // namespace
} // namespace taihu
