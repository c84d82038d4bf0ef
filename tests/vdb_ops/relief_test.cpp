#include "vdb_ops/relief.h"

#include <cmath>
#include <functional>
#include <set>

#include "tests/support/errors.h"
#include "vdb_ops/roughness.h"

namespace taihu {
namespace {

using testing::HasSubstr;

ReliefSettings small(std::string_view preset, int size_px = 65) {
    ReliefSettings s = relief_preset(preset).settings;
    s.size_px = size_px;
    return s;
}

/// Share of the picture's points that are brighter than a matt white surface could be.
double highlights(const Image& picture, double at_least) {
    double n = 0;
    for (std::size_t i = 0; i < picture.pixels.size(); i += 3)
        n += picture.pixels[i] >= at_least;
    return 3 * n / static_cast<double>(picture.pixels.size());
}

TEST(SeedRow, T06AFewBytesMakeTheSurfaceAgain) {
    for (const ReliefPreset& preset : relief_presets()) {
        ReliefSettings s = small(preset.name);
        s.seed = 18446744073709551615u;
        s.n_colors = 3;
        s.pixel_m = 0.1 / 3;
        const std::string recipe = format_relief(s);
        EXPECT_LT(recipe.size(), 2048u);
        const ReliefSettings back = parse_relief(recipe, "a.json");
        EXPECT_EQ(back, s) << recipe;
        const ReliefTile a = make_relief(s), b = make_relief(back);
        EXPECT_EQ(a.heights.pixels, b.heights.pixels);
        EXPECT_EQ(a.ids.pixels, b.ids.pixels);
        EXPECT_EQ(a.color_ids.pixels, b.color_ids.pixels);
    }
}

TEST(SeedRow, T11TheSmallerHTheRougherTheBrokenRock) {
    const ReliefPreset& preset = relief_preset("broken-rock");
    EXPECT_GT(preset.material.reflection.ambient, 0);
    EXPECT_GT(preset.material.reflection.diffuse, 0);
    EXPECT_GT(preset.material.reflection.specular, 0);
    ReliefSettings s = small("broken-rock", 257);
    double roughness[2]; // rms step between neighbours
    for (const int k : {0, 1}) {
        s.hurst = k == 0 ? 0.3 : 0.8;
        const Image f = make_relief(s).heights;
        double squares = 0;
        for (int y = 0; y < 257; ++y)
            for (int x = 1; x < 257; ++x)
                squares += std::pow(double{*f.at(x, y)} - *f.at(x - 1, y), 2);
        roughness[k] = std::sqrt(squares);
    }
    EXPECT_GT(roughness[0], 5 * roughness[1]); // 2^(8 * 0.5) = 16 at the finest stage
}

TEST(SeedRow, T12UnglazedChinaHasNoHighlight) {
    const ReliefPreset& preset = relief_preset("unglazed-china");
    EXPECT_EQ(preset.material.reflection.specular, 0);
    EXPECT_GT(preset.material.reflection.diffuse, 0);
    for (const double hurst : {0.3, 0.8}) { // two pots
        ReliefSettings s = small("unglazed-china", 129);
        s.hurst = hurst;
        const ReliefTile tile = make_relief(s);
        const Image picture = relief_picture(tile, preset.material);
        const double brightest = preset.material.color.x * (1 + preset.material.reflection.ambient);
        EXPECT_EQ(highlights(picture, brightest * 1.000001), 0); // Lambert gives 1 at most
    }
}

TEST(SeedRow, T14ACastingShinesWithoutDiffuseLight) {
    const ReliefPreset& preset = relief_preset("casting");
    EXPECT_EQ(preset.settings.law, ReliefLaw::casting);
    const Reflection& r = preset.material.reflection;
    EXPECT_EQ(r.diffuse, 0);
    EXPECT_GT(r.specular, 0);
    // A face towards the light but far from the bisector is as dark as one in the shade.
    const Vec3 light = DistantLight{0, 10}.direction();
    EXPECT_NEAR(intensity(r, light, {-1, 0, 0}, light), r.ambient,
                1e-9); // cos 85 degrees to the power of 10
    const ReliefTile tile = make_relief(small("casting", 257));
    const Image picture = relief_picture(tile, preset.material);
    EXPECT_GT(highlights(picture, 0.8 * preset.material.color.x), 0.005);
}

TEST(SeedRow, T19ColoursAreIndependentOfRoughness) {
    ReliefSettings s = small("convex", 129);
    s.n_colors = 20;
    const ReliefTile a = make_relief(s);
    s.seed = 1;
    const ReliefTile other_relief = make_relief(s);
    EXPECT_EQ(other_relief.color_ids.pixels, a.color_ids.pixels);
    EXPECT_NE(other_relief.ids.pixels, a.ids.pixels);
    s.seed = 0;
    s.color_seed = 1;
    const ReliefTile other_colors = make_relief(s);
    EXPECT_EQ(other_colors.ids.pixels, a.ids.pixels);
    EXPECT_NE(other_colors.color_ids.pixels, a.color_ids.pixels);
    s.color_seed = 0;
    s.n_colors = s.n_regions; // the same seed and number, yet other centres
    const ReliefTile same = make_relief(s);
    EXPECT_NE(same.ids.pixels, same.color_ids.pixels);
    s.law = ReliefLaw::fractal; // colours need no regions
    EXPECT_EQ(make_relief(s).color_ids.pixels, same.color_ids.pixels);
}

TEST(SeedRow, T20ParametersMakeManyMaterials) {
    std::set<std::vector<float>> pictures;
    std::size_t n = 0;
    for (const ReliefPreset& preset : relief_presets())
        for (const int variant : {0, 1, 2}) {
            ReliefSettings s = small(preset.name);
            s.hurst = 0.2 + 0.3 * variant;
            s.n_regions = 10 + 20 * variant;
            pictures.insert(relief_picture(make_relief(s), preset.material).pixels);
            ++n;
        }
    EXPECT_EQ(n, 24u);
    EXPECT_EQ(pictures.size(), n);
}

TEST(SeedRow, T22EveryPresetHasColourShineAndRoughness) {
    for (const ReliefPreset& preset : relief_presets()) {
        const ReliefMaterial& m = preset.material;
        for (const double c : {m.color.x, m.color.y, m.color.z})
            EXPECT_TRUE(c > 0 && c < 1) << preset.name;
        EXPECT_GT(m.reflection.exponent, 0) << preset.name;
        EXPECT_GT(m.reflection.diffuse + m.reflection.specular, 0) << preset.name;
        EXPECT_FALSE(preset.about.empty());
    }
}

TEST(Relief, TileableOnesHaveNoSeam) {
    // Steps and bends across the seam are those that there are elsewhere.
    for (const ReliefPreset& preset : relief_presets()) {
        ReliefSettings s = small(preset.name, 128);
        s.tileable = true;
        const Image f = make_relief(s).heights;
        const auto mean_step = [&](int x) { // from the column before to this one
            double sum = 0;
            for (int y = 0; y < 128; ++y)
                sum += std::abs(double{*f.at(x % 128, y)} - *f.at(x - 1, y));
            return sum / 128;
        };
        double greatest = 0;
        for (int x = 1; x < 128; ++x)
            greatest = std::max(greatest, mean_step(x));
        // One more of 127 columns of one law: it may be the greatest, but not by much.
        EXPECT_LE(mean_step(128), 1.2 * greatest) << preset.name;
        EXPECT_GT(mean_step(128), 0) << preset.name; // it is no repeated column
    }
}

TEST(Relief, IsCutFromTheNextLatticeThatFits) {
    ReliefSettings s = small("fractal", 129);
    const Image whole = make_relief(s).heights;
    s.size_px = 100;
    const Image part = make_relief(s).heights;
    ASSERT_EQ(part.width, 100);
    for (int y = 0; y < 100; ++y)
        for (int x = 0; x < 100; ++x)
            ASSERT_EQ(*part.at(x, y), *whole.at(x, y));
    EXPECT_EQ(scale_px(s), 100);
    s.patches = 4;
    EXPECT_EQ(scale_px(s), 32);
}

TEST(Relief, HeightsFollowAmplitudeAndNotThePixel) {
    ReliefSettings s = small("fractal");
    const Image f = make_relief(s).heights;
    s.pixel_m *= 10;
    EXPECT_EQ(make_relief(s).heights.pixels, f.pixels);
    s.amplitude_m *= 2;
    const Image twice = make_relief(s).heights;
    for (std::size_t i = 0; i < f.pixels.size(); ++i)
        ASSERT_FLOAT_EQ(twice.pixels[i], 2 * f.pixels[i]);
}

TEST(Relief, NamesWhatIsWrong) {
    ReliefSettings s = small("fractal", 100);
    s.tileable = true;
    expect_error(Fault::bad_argument, "has as many points times a power of two, not 100; use 128",
                 [&] { make_relief(s); });
    s.size_px = 8194;
    expect_error(Fault::bad_argument, "size_px is 8194", [&] { make_relief(s); });
    s = small("fractal");
    s.patches = 0;
    expect_error(Fault::bad_argument, "patches is 0", [&] { make_relief(s); });
    s = small("convex");
    s.n_colors = -1;
    expect_error(Fault::bad_argument, "n_colors is -1", [&] { make_relief(s); });
    expect_error(Fault::bad_argument, "no kind 'castin'; did you mean 'casting'?",
                 [] { relief_preset("castin"); });
}

TEST(ReliefRecipe, RefusesWhatItDoesNotSay) {
    const auto refused = [](const std::string& part, const char* text) {
        expect_error(Fault::bad_input, part, [&] { parse_relief(text, "a.json"); });
    };
    refused("a.json:1:", "{");
    refused("is no object", "[]");
    refused("key 'taihu_relief' is missing", R"({"law": "fractal"})");
    refused("'taihu_relief' is 2", R"({"taihu_relief": 2, "law": "fractal"})");
    refused("unknown law 'fractl'; did you mean 'fractal'?",
            R"({"taihu_relief": 1, "law": "fractl"})");
    refused("unknown key 'hurts'; did you mean 'hurst'?",
            R"({"taihu_relief": 1, "law": "fractal", "hurts": 1})");
    refused("unknown key 'hurst'", R"({"taihu_relief": 1, "law": "convex", "hurst": 1})");
    refused("'size_px' must be a whole number",
            R"({"taihu_relief": 1, "law": "convex", "size_px": 65.5})");
    refused("'size_px' is 1e+09", R"({"taihu_relief": 1, "law": "convex", "size_px": 1e9})");
    refused("'seed' must be a whole number", R"({"taihu_relief": 1, "law": "convex", "seed": -1})");
    refused("'corners_m' must be numbers",
            R"({"taihu_relief": 1, "law": "fractal", "corners_m": ["a"]})");
    refused("'tileable' must be true or false",
            R"({"taihu_relief": 1, "law": "fractal", "tileable": 1})");
    EXPECT_EQ(parse_relief(R"({"taihu_relief": 1, "law": "casting"})", "a").law,
              ReliefLaw::casting);
}

} // namespace
} // namespace taihu
