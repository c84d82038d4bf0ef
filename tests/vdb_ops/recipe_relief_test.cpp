#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include "stats/core/file.h"
#include "stats/core/sha256.h"
#include "tests/support/errors.h"
#include "tests/support/grids.h"
#include "tests/support/scratch.h"
#include "vdb_ops/band_detail.h"
#include "vdb_ops/recipe_solid.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

constexpr double kVoxel = 0.02;

std::string recipe(const std::string& solid, const std::string& seed = "0") {
    return R"({"taihu_recipe": 1, "voxel_m": 0.02, "seed": )" + seed + R"(, "solid": )" + solid +
           "}";
}

std::string relief(const std::string& keys, const std::string& of) {
    return R"({"relief": {"of": )" + of + ", " + keys + "}}";
}

const std::string kBlock = R"({"box": {"size_m": [1.2, 0.6, 1.2]}})",
                  kBall = R"({"sphere": {"size_m": [1, 1, 1]}})",
                  kFractal = R"("tile": {"taihu_relief": 1, "law": "fractal", "size_px": 65,
                                "hurst": 0.6}, "side_m": 0.5, "amplitude_m": 0.05)";

/// Height of the surface above (x, z): where the values pass through 0, from above.
double height_at(const BandReader& reader, double x, double z, double top) {
    for (double y = top; y > -top; y -= kVoxel)
        if (const double below = reader.at({x, y - kVoxel, z}); below < 0) {
            const double above = reader.at({x, y, z});
            return y - kVoxel * above / (above - below);
        }
    return -top;
}

/// Two waves across, three away from the one who looks; along +X and along -Z from the top.
double wave_m(double u_m, double v_m, double side_m, double height_m) {
    constexpr double kTurn = 2 * 3.141592653589793;
    return height_m * std::sin(2 * kTurn * u_m / side_m) * std::cos(3 * kTurn * v_m / side_m);
}

/// A tileable file of it, as a reader gives it.
ReliefTile wave_tile(int n, double side_m, double height_m) {
    ReliefTile tile{Image(n, n, 1), {}, {}, side_m / n, true};
    for (int row = 0; row < n; ++row)
        for (int column = 0; column < n; ++column)
            *tile.heights.at(column, row) =
                static_cast<float>(wave_m((column - (n - 1) / 2.) * side_m / n,
                                          ((n - 1) / 2. - row) * side_m / n, side_m, height_m));
    return tile;
}

class RecipeRelief : public testing::Test {
protected:
    RecipeRelief() {
        write_file(folder_ / "wave.exr", "a tile");
        assets_.folders = {folder_.path()};
        assets_.read_relief = [](const std::filesystem::path&) { return wave_tile(64, 0.8, 0.03); };
    }
    RecipeSolid made(const std::string& text, const RecipeSettings& settings = {}) const {
        return make_recipe(text, "r.json", assets_, settings);
    }
    void refused(const std::string& keys, const std::string& what,
                 Fault fault = Fault::bad_input) const {
        expect_error(fault, what, [&] { made(recipe(relief(keys, kBall))); });
    }
    const Scratch folder_;
    RecipeAssets assets_;
    const std::string file_ =
        R"("tile": {"file": "wave.exr", "sha256": ")" + sha256_hex("a tile") + "\"}";
};

TEST_F(RecipeRelief, AFlatFaceHasTheHeightsOfTheTile) {
    const struct {
        std::string keys;
        double side_m, height_m;
    } cases[] = {{"", 0.8, 0.03},
                 {R"(, "amplitude_m": 0.06, "side_m": 1.2)", 1.2, 0.06},
                 {R"(, "amplitude_m": 0.06, "facing": [0.5, 1, 1])", 0.8, 0.03}};
    for (const auto& c : cases) {
        const RecipeSolid solid = made(recipe(relief(file_ + c.keys, kBlock)));
        const BandReader reader(solid.solid);
        double worst = 0, squares = 0, truth = 0;
        for (double x = -0.42; x <= 0.42; x += 0.035)
            for (double z = -0.42; z <= 0.42; z += 0.035) {
                const double wave = wave_m(x, -z, c.side_m, c.height_m),
                             error = height_at(reader, x, z, 0.42) - 0.3 - wave;
                worst = std::max(worst, std::fabs(error));
                squares += error * error;
                truth += wave * wave;
            }
        // A shortest wave of 13 voxels: linear between voxels and first order distances.
        EXPECT_LT(worst, 0.2 * c.height_m) << c.keys;
        EXPECT_LT(squares, 0.006 * truth) << c.keys;
    }
}

TEST_F(RecipeRelief, ReachesEveryFace) {
    const RecipeSolid flat = made(recipe(kBlock)),
                      raised = made(recipe(relief(
                          R"("tile": {"taihu_relief": 1, "law": "convex", "size_px": 33,
                             "n_regions": 1, "radius_m": 9}, "side_m": 4, "amplitude_m": 0.05)",
                          kBlock)));
    // One dome far wider than the block, so all of its six faces go out by nearly 0.05 m.
    const double area_m2 = 2 * (1.2 * 0.6 + 1.2 * 1.2 + 1.2 * 0.6);
    EXPECT_NEAR(volume_m3(*raised.solid) - volume_m3(*flat.solid), 0.05 * area_m2,
                0.1 * 0.05 * area_m2);
}

TEST_F(RecipeRelief, IsMadeAgainByItsRecipeOnOneThreadAndGrowsWithTheSolid) {
    const std::string text = recipe(relief(kFractal, kBall), "7");
    const RecipeSolid one = made(text);
    EXPECT_NE(volume_m3(*one.solid), volume_m3(*made(recipe(relief(kFractal, kBall))).solid));
    {
        const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, 1);
        EXPECT_EQ(grid_hash(*made(one.recipe).solid), grid_hash(*one.solid));
    }
    RecipeSettings larger;
    larger.voxel_m = 2 * kVoxel;
    const std::string twice =
        R"({"transform": {"of": )" + relief(kFractal, kBall) + R"(, "scale": 2}})";
    // Rounding aside it is the same lattice: a thousandth.
    const double once = volume_m3(*one.solid);
    EXPECT_NEAR(volume_m3(*made(recipe(twice, "7"), larger).solid), 8 * once, 0.008 * once);
}

TEST_F(RecipeRelief, WavesThatTheLatticeCannotShowAreLeftOut) {
    assets_.read_relief = [](const std::filesystem::path&) {
        return wave_tile(64, 0.064, 0.02); // a point a millimetre, waves of 20 and 30
    };
    const RecipeSolid solid = made(recipe(relief(file_, kBlock)));
    const BandReader reader(solid.solid);
    for (double x = -0.4; x <= 0.4; x += 0.07)
        EXPECT_NEAR(height_at(reader, x, 0.3 * x, 0.42), 0.3, 0.1 * 0.02);
}

TEST_F(RecipeRelief, SaysWhereItIsWrong) {
    refused(R"("amplitude_m": 0.1)", "r.json: solid.relief: key 'tile' is missing");
    refused(R"("tile": 3)", "r.json: solid.relief.tile: is no object with 'taihu_relief'");
    refused(R"("tile": {"taihu_relief": 1, "law": "fractl"})", "did you mean 'fractal'");
    refused(R"("tile": {"taihu_relief": 1, "law": "fractal", "size_px": 9000})",
            "'size_px' is 9000");
    refused(file_ + R"(, "amplitude_m": -1)", "'amplitude_m' is -1");
    refused(file_ + R"(, "side_m": 0)", "'side_m' is 0");
    refused(file_ + R"(, "sharpness": 0)", "'sharpness' is 0");
    refused(file_ + R"(, "smooth": 1)", "unknown key 'smooth'");
    for (const std::string name : {"../wave.exr", "/etc/wave.exr", "a/wave.exr", ".."})
        refused(R"("tile": {"file": ")" + name + R"(", "sha256": "0"})",
                "'file' is '" + name + "'; must be a name without folders");
    refused(R"("tile": {"file": "wave.exr", "sha256": "0"})",
            "'wave.exr' is another file than the one the recipe means");
    refused(R"("tile": {"file": "no.exr", "sha256": "0"})", "there is no file 'no.exr'", Fault::io);
    refused(file_ + R"(, "amplitude_m": 30)", "at most 1000 are handled");
}

TEST_F(RecipeRelief, TilesOfUnknownSizeNeedASide) {
    assets_.read_relief = [](const std::filesystem::path&) {
        ReliefTile tile = wave_tile(8, 1, 0.1);
        tile.pixel_m = 0;
        return tile;
    };
    refused(file_, "the tile does not say how large it is; give 'side_m'");
    EXPECT_NO_THROW(made(recipe(relief(file_ + R"(, "side_m": 1)", kBall))));
    assets_.read_relief = nullptr;
    refused(file_, "nothing here reads tiles");
}

TEST_F(RecipeRelief, ManyLargeTilesAreRefusedBeforeTheyAreMade) {
    std::string solid = kBall;
    for (int i = 0; i < 5; ++i)
        solid = relief(R"("tile": {"taihu_relief": 1, "law": "convex", "n_regions": 1,
                          "size_px": 8193})",
                       solid);
    expect_error(Fault::bad_input, "the tiles of the recipe have more than 2^26 points",
                 [&] { made(recipe(solid)); });
}

} // namespace
} // namespace taihu
