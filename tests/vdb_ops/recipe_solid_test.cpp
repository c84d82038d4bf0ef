#include "vdb_ops/recipe_solid.h"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <openvdb/tools/Interpolation.h>

#include "stats/core/file.h"
#include "stats/core/sha256.h"
#include "stats/io/holes_file.h"
#include "tests/support/cube_mesh.h"
#include "tests/support/errors.h"
#include "tests/support/grids.h"
#include "tests/support/scratch.h"
#include "vdb_ops/carve.h"
#include "vdb_ops/clean.h"
#include "vdb_ops/place.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/shapes.h"
#include "vdb_ops/vdb_file.h"
#include "vdb_ops/volume.h"
#include "vdb_ops/voxelize.h"

namespace taihu {
namespace {

constexpr double kPi = std::numbers::pi;

std::string recipe(const std::string& solid, const std::string& more = "\"voxel_m\": 0.02") {
    return R"({"taihu_recipe": 1, )" + more + R"(, "solid": )" + solid + "}";
}

RecipeSolid made(const std::string& solid, const RecipeSettings& settings = {},
                 const RecipeAssets& assets = {}) {
    return make_recipe(recipe(solid), "r.json", assets, settings);
}

double volume(const std::string& solid) {
    return volume_m3(*made(solid).solid);
}

const std::string kBall = R"({"sphere": {"size_m": [1, 1, 1]}})";
const std::string kBox = R"({"box": {"size_m": [1, 1, 1]}})";

std::string moved(const std::string& solid, double x) {
    return R"({"transform": {"of": )" + solid + R"(, "move_m": [)" + std::to_string(x) +
           ", 0, 0]}}";
}

// A level set's volume is good to a tenth of the voxel squared over the radius squared on smooth
// solids, and to a fraction of a voxel at edges; these tolerances are 0.5 % and 2 %.
TEST(RecipeSolid, OperatorsHaveTheirVolumes) {
    const double ball = kPi / 6;
    EXPECT_NEAR(volume(kBall), ball, 0.005 * ball);
    EXPECT_NEAR(volume(R"({"union": {"of": [)" + kBall + "," + moved(kBall, 3) + "]}}"), 2 * ball,
                0.01 * ball);
    // A cube minus the ball inside it, and the ball cut by a plane through its middle.
    EXPECT_NEAR(volume(R"({"difference": {"of": [)" + kBox + "," + kBall + "]}}"), 1 - ball, 0.01);
    EXPECT_NEAR(volume(R"({"intersection": {"of": [)" + kBall + R"(, {"plane": {}}]}})"), ball / 2,
                0.01 * ball);
    EXPECT_NEAR(volume(R"({"shell": {"of": )" + kBall + R"(, "inwards_m": 0.1}})"),
                ball * (1 - std::pow(0.8, 3)), 0.01 * ball);
    EXPECT_NEAR(volume(R"({"offset": {"of": )" + kBall + R"(, "by_m": 0.1}})"),
                ball * std::pow(1.2, 3), 0.01 * ball);
    EXPECT_NEAR(volume(R"({"transform": {"of": )" + kBall +
                       R"(, "scale": 0.5, "axis": [1, 2, 3], "angle_deg": 40}})"),
                ball / 8, 0.01 * ball / 8);
}

TEST(RecipeSolid, AnEmbeddedStoneLiesInItsBed) {
    // A ball of 0.4 in a cube, with a gap of 0.05 around it: the cube loses a shell.
    const std::string stone = R"({"sphere": {"size_m": [0.4, 0.4, 0.4]}})";
    const double bed = kPi / 6 * std::pow(0.5, 3), ball = kPi / 6 * std::pow(0.4, 3);
    EXPECT_NEAR(volume(R"({"embed": {"of": [)" + kBox + "," + stone + R"(], "gap_m": 0.05}})"),
                1 - bed + ball, 0.01);
}

TEST(RecipeSolid, ABlendRoundsTheSeam) {
    const std::string two = R"("of": [)" + kBall + "," + moved(kBall, 0.8) + "]";
    const double sharp = volume(R"({"union": {)" + two + "}}");
    const double round = volume(R"({"union": {)" + two + R"(, "blend_m": 0.2}})");
    EXPECT_GT(round, sharp + 0.005);
    EXPECT_LT(round, sharp + 0.1);
}

TEST(RecipeSolid, HolesOfALawAreThoseOfTheVerbs) {
    const std::string holes =
        R"({"holes": {"law": {"family": "exponential", "parameters": {"rate": 8}}, "porosity": 0.2,
            "scale_m": 1, "seed": 5}})";
    const RecipeSolid rock = made(R"({"clean": {"of": {"difference": {"of": [)" + kBall + "," +
                                  holes + R"(]}}, "pieces": 1, "bubbles": "fill"}})");
    Lattice lattice;
    lattice.voxel_m = 0.02;
    const auto base = rasterize(*shape_field({.kind = ShapeKind::sphere}), lattice);
    Placement placement;
    placement.porosity = 0.2;
    placement.seed = 5;
    const auto placed = place_holes(Law::exponential(8), placement, *base);
    const auto byhand = clean(*carve(*base, placed.holes).rock).solid;
    EXPECT_EQ(grid_hash(*rock.solid), grid_hash(*byhand));
    EXPECT_THAT(rock.found, testing::Contains(testing::HasSubstr("holes")));
}

TEST(RecipeSolid, AHoledRockGrowsWithItsHoles) {
    const std::string solid = R"({"difference": {"of": [)" + kBall +
                              R"(, {"holes": {"law": {"family": "constant", "parameters":
                                 {"diameter": 0.3}}, "count": 5, "seed": 2}}]}})";
    const RecipeSolid one = made(solid), three = made(solid, {.height_m = 3.0});
    EXPECT_NEAR(three.voxel_m, 0.06, 1e-12);
    // The same voxels, three times as large; rounding of the holes' places moves surfaces by less.
    EXPECT_NEAR(volume_m3(*three.solid) / volume_m3(*one.solid), 27, 27e-4);
    // What it says makes it again, bit for bit.
    const RecipeSolid again = make_recipe(three.recipe, "again", {});
    EXPECT_EQ(grid_hash(*again.solid), grid_hash(*three.solid));
    EXPECT_EQ(again.recipe, three.recipe);
}

TEST(RecipeSolid, SeedRowE04AMaterialIsTheSameInEveryBase) {
    const std::string material =
        R"("voxel_m": 0.02, "material": {"law": {"family": "uniform", "parameters": {"lo": 0.1,
           "hi": 0.4}}, "count": 200, "seed": 3, "box_m": [[-1, -1, -1], [1, 1, 1]]})";
    const auto in = [&](const std::string& base) {
        return make_recipe(recipe(R"({"difference": {"of": [)" + base + R"(, {"material": {}}]}})",
                                  material),
                           "r.json", {})
            .solid;
    };
    const auto ball = in(kBall), box = in(kBox);
    // Deep in both bases, the two rocks are the same.
    auto a = ball->getAccessor(), b = box->getAccessor();
    int n_void = 0;
    for (int x = -9; x <= 9; ++x)
        for (int y = -9; y <= 9; ++y)
            for (int z = -9; z <= 9; ++z) {
                const openvdb::Coord c(x, y, z);
                EXPECT_EQ(a.getValue(c) < 0, b.getValue(c) < 0) << c;
                n_void += a.getValue(c) >= 0;
            }
    EXPECT_GT(n_void, 100);
}

TEST(RecipeSolid, SeedRowE12TreesEqualGridsComposedByHand) {
    // (A - holes1) + (B - holes2), all of it within a clip.
    const std::string solid =
        R"({"intersection": {"of": [{"union": {"of": [
             {"difference": {"of": [)" +
        kBall +
        R"(, {"transform": {"of": {"sphere": {"size_m": [0.5, 0.5, 0.5]}}, "move_m": [0.4, 0, 0]}}]}},
             {"difference": {"of": [)" +
        moved(kBox, 0.9) +
        R"(, {"transform": {"of": {"capsule": {"size_m": [0.3, 2, 0.3]}}, "move_m": [0.9, 0, 0]}}]}}]}},
             {"box": {"size_m": [2.4, 0.7, 2]}}]}})";
    const auto grid = made(solid).solid;
    const auto sphere = [](const Vec3& p, double r) { return length(p) - r; };
    int n = 0;
    for (auto v = grid->cbeginValueOn(); v; ++v, ++n) {
        const openvdb::Vec3d w = grid->indexToWorld(v.getCoord());
        const Vec3 p{w.x(), w.y(), w.z()};
        const auto box = [](const Vec3& q, const Vec3& h) {
            const Vec3 d{std::fabs(q.x) - h.x, std::fabs(q.y) - h.y, std::fabs(q.z) - h.z};
            const Vec3 out{std::max(d.x, 0.0), std::max(d.y, 0.0), std::max(d.z, 0.0)};
            return length(out) + std::min(0.0, std::max({d.x, d.y, d.z}));
        };
        const Vec3 q = p - Vec3{0.9, 0, 0};
        const Vec3 axis{q.x, q.y - std::clamp(q.y, -0.85, 0.85), q.z};
        const double a = std::max(sphere(p, 0.5), -sphere(p - Vec3{0.4, 0, 0}, 0.25));
        const double b = std::max(box(q, {0.5, 0.5, 0.5}), -(length(axis) - 0.15));
        const double d = std::max(std::min(a, b), box(p, {1.2, 0.35, 1}));
        // Floats of distances up to the band, on places of size 1.
        ASSERT_NEAR(*v, d, 1e-5) << p.x << " " << p.y << " " << p.z;
    }
    EXPECT_GT(n, 10'000);
}

TEST(RecipeSolid, FilesAreFoundByNameAndHash) {
    const Scratch folder;
    write_file(folder / "holes.csv", "x_m,y_m,z_m,radius_m\n0,0,0,0.3\n");
    const std::string hash = sha256_hex(read_file(folder / "holes.csv"));
    const auto with = [&](const std::string& name, const std::string& sha) {
        return R"({"difference": {"of": [)" + kBall + R"(, {"holes": {"file": ")" + name +
               R"(", "sha256": ")" + sha + R"("}}]}})";
    };
    const RecipeAssets assets{{folder.path()}, {}};
    const double shell = kPi / 6 * (1 - std::pow(0.6, 3));
    EXPECT_NEAR(volume_m3(*made(with("holes.csv", hash), {}, assets).solid), shell, 0.01 * shell);
    expect_error(Fault::bad_input, "another file than the one the recipe means",
                 [&] { made(with("holes.csv", std::string(64, '0')), {}, assets); });
    expect_error(Fault::io, "there is no file 'none.csv'",
                 [&] { made(with("none.csv", hash), {}, assets); });
    expect_error(Fault::bad_input, "a name without folders",
                 [&] { made(with("../holes.csv", hash), {}, assets); });
}

TEST(RecipeSolid, ALevelSetGivesItsLattice) {
    const Scratch folder;
    Lattice lattice;
    lattice.voxel_m = 0.02;
    lattice.origin = {0.007, 0, 0};
    const auto ball = rasterize(*shape_field({.kind = ShapeKind::sphere}), lattice);
    write_vdb(folder / "ball.vdb", *ball, "");
    const std::string node = R"({"level_set": {"file": "ball.vdb", "sha256": ")" +
                             sha256_hex(read_file(folder / "ball.vdb")) + R"("}})";
    const RecipeAssets assets{{folder.path()}, {}};
    EXPECT_EQ(grid_hash(*made(node, {}, assets).solid), grid_hash(*ball));
    // On a finer lattice it is sampled again.
    const auto fine = made(node, {.voxel_m = 0.015}, assets).solid;
    EXPECT_NEAR(volume_m3(*fine), kPi / 6, 0.01 * kPi / 6);
}

TEST(RecipeSolid, SaysWhereARecipeIsWrong) {
    const auto wrong = [](const char* words, const std::string& solid) {
        expect_error(Fault::bad_input, words, [&] { made(solid); });
    };
    wrong("r.json: solid: unknown kind 'shpere'; did you mean 'sphere'", R"({"shpere": {}})");
    wrong("solid.sphere: ", R"({"sphere": {"size": [1, 1, 1]}})");
    wrong("solid.sphere: 'size_m' is [1,-1,1]; must be three numbers",
          R"({"sphere": {"size_m": [1, -1, 1]}})");
    wrong("solid.union: 'of' has 1 nodes", R"({"union": {"of": [)" + kBall + "]}}");
    wrong("solid.union.of[1]: a node is an object with one key",
          R"({"union": {"of": [)" + kBall + ", 3]}}");
    wrong("has no bounds", R"({"plane": {}})");
    wrong("need a solid", R"({"holes": {"law": {"family": "constant", "parameters":
                             {"diameter": 1}}, "count": 2}})");
    wrong("has no 'material'", R"({"difference": {"of": [)" + kBall + R"(, {"material": {}}]}})");
    wrong("is empty", R"({"intersection": {"of": [)" + kBall + "," + moved(kBall, 5) + "]}}");
    expect_error(Fault::bad_input, "this program reads 1",
                 [] { make_recipe(R"({"taihu_recipe": 2, "solid": {}})", "r.json", {}); });
    expect_error(Fault::bad_input, "no recipe", [] { make_recipe("[1]", "r.json", {}); });
    expect_error(Fault::bad_argument, "height", [] { made(kBall, {.height_m = -1.0}); });
}

TEST(RecipeSolid, NamesTheFileWhateverIsWrong) {
    const std::string law =
        R"("law": {"family": "exponential", "parameters": {"mu": 1}}, "scale_m": 0.00001, )";
    for (const std::string more : {R"("density_m3": 1e18)", R"("porosity": 0.5)"})
        try {
            made(R"({"difference": {"of": [)" + kBox + R"(, {"holes": {)" + law + more + "}}]}}");
            ADD_FAILURE() << more;
        } catch (const Error& e) {
            EXPECT_EQ(e.fault(), Fault::bad_input) << e.what();
            EXPECT_THAT(e.what(), testing::StartsWith("r.json: ")) << more;
        }
}

TEST(RecipeSolid, PartsThatAreTooManyAreRefusedBeforeTheyAreMade) {
    std::string of;
    for (int i = 0; i < 20; ++i)
        of += std::string(i == 0 ? "" : ", ") +
              R"({"boulder": {"size_m": [1, 1, 1], "subdivisions": 8}})";
    expect_error(Fault::unsupported, "solid.union.of[2]",
                 [&] { made(R"({"union": {"of": [)" + of + "]}}", {.memory_bytes = 1e9}); });
}

TEST(RecipeSolid, MeshesAreClosedAsTheyAsk) {
    const Scratch folder;
    write_file(folder / "nest.obj", "the callback knows what it holds");
    const std::string file =
        R"("file": "nest.obj", "sha256": ")" + sha256_hex(read_file(folder / "nest.obj")) + '"';
    TriMesh nested = cube();
    nested.triangles.resize(10); // open at x = 1/2
    append(nested, cube({}, 0.5));
    const RecipeAssets assets{{folder.path()},
                              [&](const std::filesystem::path&, double, bool) { return nested; }};
    const auto with = [&](const std::string& keys) {
        return made(R"({"mesh": {)" + file + keys + "}}", {}, assets);
    };
    EXPECT_NEAR(volume_m3(*with("").solid), 1, 0.02);
    EXPECT_NEAR(volume_m3(*with(R"(, "shells": "parity")").solid), 1 - 0.125, 0.02);
    EXPECT_NEAR(volume_m3(*with(R"(, "close": "winding")").solid), 1, 0.02);
    EXPECT_NEAR(volume_m3(*with(R"(, "close": "plane")").solid), 1, 0.02);
    EXPECT_THAT(with(R"(, "close": "plane")").found,
                testing::Contains(testing::HasSubstr("closed with flat bases")));
    expect_error(Fault::bad_input, "open: 4 open edges", [&] { with(R"(, "close": "none")"); });
    expect_error(Fault::bad_input, "must be one of loops, winding, plane, none",
                 [&] { with(R"(, "close": "fan")"); });
    expect_error(Fault::bad_input, "drop one of them",
                 [&] { with(R"(, "close": "winding", "shells": "parity")"); });
}

TEST(RecipeSolid, SettingsReplaceValues) {
    const std::string preset =
        recipe(kBall, R"("dim": 40, "set": {"width": "/solid/sphere/size_m/0"})");
    const std::string wide = with_setting(preset, "p", "width", "2");
    EXPECT_THAT(wide, testing::HasSubstr("[2,1,1]"));
    EXPECT_THAT(with_setting(preset, "p", "/solid/sphere/size_m/1", "3"),
                testing::HasSubstr("[1,3,1]"));
    EXPECT_THAT(with_setting(preset, "p", "seed", "9"), testing::HasSubstr("\"seed\":9"));
    EXPECT_THAT(with_setting(preset, "p", "voxel_m", "0.1"),
                testing::Not(testing::HasSubstr("\"dim\":40")));
    expect_error(Fault::bad_argument, "did you mean 'width'",
                 [&] { with_setting(preset, "p", "widht", "2"); });
    expect_error(Fault::bad_argument, "there is nothing at",
                 [&] { with_setting(preset, "p", "/solid/cube/size_m", "2"); });
}

TEST(RecipeSolid, SeedsThatAreLeftOutFollowTheRecipes) {
    const std::string solid = R"({"difference": {"of": [)" + kBall +
                              R"(, {"holes": {"law": {"family": "constant", "parameters":
                                 {"diameter": 0.3}}, "count": 5}}]}})";
    const auto hash = [&](std::uint64_t seed) {
        return grid_hash(*made(solid, {.seed = seed}).solid);
    };
    EXPECT_EQ(hash(1), hash(1));
    EXPECT_NE(hash(1), hash(2));
}

} // namespace
} // namespace taihu
