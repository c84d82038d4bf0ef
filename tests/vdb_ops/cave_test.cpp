#include "vdb_ops/cave.h"

#include "tests/support/errors.h"
#include "tests/support/grids.h"
#include "vdb_ops/clean.h"
#include "vdb_ops/recipe.h"
#include "vdb_ops/recipe_solid.h"

namespace taihu {
namespace {

RecipeSolid made(const CaveSettings& settings, int dim) {
    return make_recipe(format_recipe(cave_node(settings), 0, settings.seed), "cave", {},
                       {.dim = dim});
}

TEST(SeedRow, D21TheVoidOfACaveIsOnePieceWithAnEntrance) {
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
        const CaveSettings settings{
            .size_m = {1.4, 1, 1.2}, .fractal = {.base = 0, .iterations = 2}, .seed = seed};
        const RecipeSolid cave = made(settings, 96);
        const CaveReport report = measure_cave(*cave.solid, settings.size_m);
        EXPECT_EQ(report.n_voids, 1u) << seed;
        EXPECT_GT(report.mouth_m2, 0.02) << seed;
        EXPECT_GT(report.void_share, 0.05) << seed;
        EXPECT_LT(report.void_share, 0.7) << seed;
        // Nothing is sealed, and the block is one piece.
        const CleanResult cleaned = clean(*cave.solid);
        EXPECT_EQ(cleaned.n_bubbles, 0u) << seed;
        EXPECT_EQ(cleaned.n_pieces, 1u) << seed;
    }
}

TEST(SeedRow, D21EachRockHasItsMiddleInAnEarlierOne) {
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
        const CaveSettings settings{
            .n_rocks = 10, .fractal = {.base = 0, .iterations = 1}, .seed = seed};
        const std::vector<CaveRock> rocks = cave_rocks(settings);
        ASSERT_EQ(rocks.size(), 10u);
        EXPECT_EQ(rocks[0].at_m.z, 0.5); // half way out of the +Z side
        for (std::size_t i = 1; i < rocks.size(); ++i) {
            bool inside_one = false;
            for (std::size_t j = 0; j < i; ++j) {
                const double voxel = 0.01 * rocks[j].shape.size_m.x;
                const auto grid = rasterize(*shape_field(rocks[j].shape), {voxel, {}, 3});
                const Vec3 at = (rocks[i].at_m - rocks[j].at_m) / voxel;
                inside_one =
                    inside_one || grid->tree().getValue({static_cast<int>(std::lround(at.x)),
                                                         static_cast<int>(std::lround(at.y)),
                                                         static_cast<int>(std::lround(at.z))}) < 0;
            }
            EXPECT_TRUE(inside_one) << i;
            for (int axis = 0; axis < 3; ++axis)
                EXPECT_LE(std::fabs(rocks[i].at_m[axis]) + 0.5 * rocks[i].shape.size_m[axis],
                          0.45 + 1e-12); // behind walls of 5 %
        }
    }
}

TEST(Cave, TheMouthIsSeenWhereverTheLatticeMeetsItsSide) {
    const CaveSettings settings{
        .size_m = {2, 1, 1.5}, .fractal = {.base = 0, .iterations = 2}, .seed = 2};
    // The mouth's side lies on points of the lattice, or half-way between two.
    const double on = measure_cave(*made(settings, 72).solid, settings.size_m).mouth_m2,
                 between = measure_cave(*made(settings, 60).solid, settings.size_m).mouth_m2;
    EXPECT_GT(on, 0.1);
    EXPECT_NEAR(between, on, 0.15 * on); // of voxels 3 cm wide: a tenth of the mouth's
}

TEST(Cave, IsARecipeThatMakesTheSameAgain) {
    const CaveSettings settings{.n_rocks = 3, .fractal = {.base = 0, .iterations = 1}, .seed = 5};
    const RecipeSolid cave = made(settings, 48);
    const RecipeSolid again = make_recipe(cave.recipe, "again", {});
    EXPECT_EQ(grid_hash(*cave.solid), grid_hash(*again.solid));
    EXPECT_NE(cave_node(settings), cave_node({.n_rocks = 3, .fractal = settings.fractal}));
}

TEST(Cave, AMouthIsMeasured) {
    // A channel of 0.2 x 0.1 m through a block, from side to side: two mouths.
    const std::string block = shape_node({.kind = ShapeKind::box});
    const std::string channel = shape_node({.kind = ShapeKind::box, .size_m = {0.2, 0.1, 3}});
    const auto solid =
        make_recipe(format_recipe(difference_node(block, channel), 0.01, 0), "block", {}).solid;
    const CaveReport report = measure_cave(*solid, {1, 1, 1});
    EXPECT_EQ(report.n_voids, 1u);
    // Half a voxel around the channel, 0.6 m, and corners.
    EXPECT_NEAR(report.mouth_m2, 2 * 0.02, 2 * 0.6 * 0.006);
    EXPECT_NEAR(report.void_share, 0.02, 0.6 * 0.006);
}

TEST(Cave, RefusesWhatItCannotPlace) {
    const auto cave = [](const CaveSettings& settings) {
        return [settings] { cave_rocks(settings); };
    };
    expect_error(Fault::bad_argument, "n_rocks is 0, must be 1..200", cave({.n_rocks = 0}));
    expect_error(Fault::bad_argument, "size_m.y", cave({.size_m = {1, 0, 1}}));
    expect_error(Fault::bad_argument, "room", cave({.room = 2}));
    expect_error(Fault::bad_argument, "ask for thinner walls or larger rocks",
                 cave({.room = 0.05, .wall = 0.4, .fractal = {.base = 0, .iterations = 1}}));
}

} // namespace
} // namespace taihu
