// taihu relief: tiles, and what a photo says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "mesh_out/io/exr_file.h"
#include "mesh_out/io/image_file.h"
#include "tests/support/command.h"

namespace taihu {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(Relief, ATileCarriesItsScaleAndItsRecipe) {
    const Scratch scratch;
    const json made = result("taihu relief broken-rock --size 257 --pixel 2mm --hurst 0.4 --seed 9 "
                             "-o a.exr --preview a.png",
                             scratch);
    EXPECT_EQ(made["size_px"], 257);
    EXPECT_EQ(made["seed"], 9);
    const json& hurst = made["roughness"]["hurst"];
    EXPECT_NEAR(hurst["estimate"].get<double>(), 0.4, 0.1); // of 257 points a side
    EXPECT_LT(hurst["hi"].get<double>() - hurst["lo"].get<double>(), 0.2);
    const ExrImage tile = read_exr(scratch / "a.exr");
    EXPECT_THAT(tile.channels, ElementsAre("Y"));
    EXPECT_EQ(tile.image.width, 257);
    const auto [lo, hi] = std::minmax_element(tile.image.pixels.begin(), tile.image.pixels.end());
    EXPECT_EQ(static_cast<float>(made["lowest_m"].get<double>()), *lo);
    EXPECT_EQ(static_cast<float>(made["highest_m"].get<double>()), *hi);
    EXPECT_THAT(tile.attributes, testing::Contains(testing::Pair("pixel_m", "0.002")));
    EXPECT_THAT(tile.attributes, testing::Contains(testing::Pair("Y_unit", "m")));
    EXPECT_EQ(read_png(scratch / "a.png").channels, 3);

    result("taihu relief --from a.exr -o b.exr --threads 1", scratch);
    EXPECT_EQ(read_file(scratch / "a.exr"), read_file(scratch / "b.exr"));
    write_file(scratch / "recipe.json", made["recipe"].dump());
    result("taihu relief --from recipe.json -o c.exr", scratch);
    EXPECT_EQ(read_file(scratch / "a.exr"), read_file(scratch / "c.exr"));
}

TEST(Relief, RegionsAndColoursAreChannels) {
    const Scratch scratch;
    result("taihu relief convex --size 64 --tileable --regions 9 --colors 5 -o a.exr", scratch);
    const ExrImage tile = read_exr(scratch / "a.exr");
    EXPECT_THAT(tile.channels, ElementsAre("Y", "color_region", "region"));
    EXPECT_THAT(tile.attributes, testing::Contains(testing::Pair("wrap", "periodic")));
    for (std::size_t i = 0; i < tile.image.pixels.size(); i += 3) {
        ASSERT_LT(tile.image.pixels[i + 1], 5);
        ASSERT_LT(tile.image.pixels[i + 2], 9);
    }
}

TEST(Relief, APresetKeepsItsLookAtAnySize) {
    const Scratch scratch;
    const json small = result("taihu relief casting --size 65 --pixel 1mm -o a.exr", scratch);
    const json large = result("taihu relief casting --size 65 --pixel 1m -o b.exr", scratch);
    EXPECT_NEAR(large["highest_m"].get<double>() / small["highest_m"].get<double>(), 1000, 0.01);
    const json told = result("taihu relief casting --size 65 --amplitude 10% -o b.exr", scratch);
    EXPECT_NEAR(told["recipe"]["amplitude_m"].get<double>(), 0.0064, 1e-12);
}

TEST(Relief, APhotoBecomesATileThatIsAsRough) {
    const Scratch scratch;
    // Matt and gentle: what the estimate assumes. The preview's light is 40 degrees up.
    result("taihu relief fractal --hurst 0.7 --amplitude 5% --pixel 0.5mm --seed 2 -o a.exr "
           "--preview photo.png",
           scratch);
    const json truth = result("taihu relief --from a.exr -o again.exr", scratch);
    const json made = result("taihu relief --from photo.png --light-elevation 40deg --ambient 0.19 "
                             "--pixel 0.5mm --patch 0,0,512,500 --size 513 -o alike.exr",
                             scratch);
    const json& photo = made["photo"];
    EXPECT_EQ(photo["file"], "photo.png");
    EXPECT_LT(photo["hurst"]["lo"].get<double>(), 0.7);
    EXPECT_GT(photo["hurst"]["hi"].get<double>(), 0.7);
    EXPECT_NEAR(photo["light_azimuth_deg"].get<double>(), 135, 15);
    EXPECT_EQ(photo["doubts"].size(), 0u);
    const auto size = [](const json& r) {
        return r["departure_m"]["estimate"].get<double>() *
               std::pow(16, r["hurst"]["estimate"].get<double>());
    };
    EXPECT_NEAR(size(photo) / size(truth["roughness"]), 1, 0.25); // 10 % each, and 8 bits
    EXPECT_NEAR(size(made["roughness"]) / size(photo), 1, 0.1);   // scaled at 8 pixels
    EXPECT_EQ(made["recipe"]["law"], "fractal");
    result("taihu relief --from photo.png", scratch); // the figures alone
}

TEST(Relief, HeightsAndOffsetsMakeEachOther) {
    const Scratch scratch;
    for (const char* kind : {"fractal --size 65", "convex --tileable --size 64 --pixel 3mm"}) {
        result("taihu relief " + std::string(kind) + " -o heights.exr", scratch);
        result("taihu relief --from heights.exr --as offsets -o offsets.exr", scratch);
        const json back = result("taihu relief --from offsets.exr --as heights -o b.exr", scratch);
        const ExrImage offsets = read_exr(scratch / "offsets.exr");
        EXPECT_THAT(offsets.channels, ElementsAre("u", "v"));
        EXPECT_THAT(offsets.attributes, testing::Contains(testing::Pair("u_unit", "m per texel")));
        const std::vector<std::string> only_heights = {"Y"};
        const ExrImage heights = read_exr(scratch / "heights.exr", only_heights);
        const ExrImage again = read_exr(scratch / "b.exr");
        for (const char* key : {"pixel_m", "wrap", "Y_unit"}) {
            const auto has = [&](const auto& pair) { return pair.first == key; };
            EXPECT_EQ(*std::find_if(again.attributes.begin(), again.attributes.end(), has),
                      *std::find_if(heights.attributes.begin(), heights.attributes.end(), has));
        }
        const std::vector<float>&a = heights.image.pixels, &b = again.image.pixels;
        ASSERT_EQ(a.size(), b.size());
        const auto [lo, hi] = std::minmax_element(a.begin(), a.end());
        for (std::size_t i = 0; i < a.size(); ++i)
            ASSERT_NEAR(a[i] - a[0], b[i] - b[0], 1e-5 * (*hi - *lo)) << kind;
        EXPECT_LT(back["left_rms_m"].get<double>(), 1e-5 * back["offsets_rms_m"].get<double>());
    }
    // Leaning to the right everywhere, on a map that repeats: no height field does.
    write_exr(scratch / "slope.exr", {Image(8, 8, 2), {"u", "v"}, {{"wrap", "periodic"}}});
    ExrImage slope = read_exr(scratch / "slope.exr");
    for (std::size_t i = 0; i < slope.image.pixels.size(); i += 2)
        slope.image.pixels[i] = 1;
    write_exr(scratch / "slope.exr", slope);
    const json none = result("taihu relief --from slope.exr --as heights -o flat.exr", scratch);
    EXPECT_NEAR(none["highest_m"].get<double>(), 0, 1e-6);
    EXPECT_DOUBLE_EQ(none["left_rms_m"].get<double>(), none["offsets_rms_m"].get<double>());
}

TEST(Relief, RefusesInOneLine) {
    const Scratch scratch;
    write_image(scratch / "black.png", Image(128, 128, 3));
    write_exr(scratch / "plain.exr", {Image(8, 8, 1), {"Y"}, {}});
    const auto fails = [&](const std::string& options, int code, const std::string& part) {
        const Finished said = run("taihu relief " + options, scratch.path());
        EXPECT_EQ(said.exit_code, code) << options << '\n' << said.err;
        EXPECT_EQ(std::count(said.err.begin(), said.err.end(), '\n'), 1) << said.err;
        EXPECT_THAT(said.err, HasSubstr(part));
    };
    fails("-o a.exr", 2, "say what to make");
    fails("castin -o a.exr", 2, "did you mean 'casting'?");
    fails("casting", 2, "nothing to write; give -o tile.exr");
    fails("casting -o a.png", 1, "tiles are 32-bit .exr");
    fails("casting --draws gaussian -o a.exr", 2, "casting has no --draws; drop it");
    fails("convex --hurst 0.5 -o a.exr", 2, "convex has no --hurst; drop it");
    fails("convex --wavelength 1cm -o a.exr", 2, "convex has no --wavelength");
    fails("fractal --regions 5 -o a.exr", 2, "fractal has no --regions");
    fails("fractal --ambient 0.5 -o a.exr", 2, "--ambient is for --from PHOTO.png");
    fails("fractal --corners 1,2,x,4 -o a.exr", 2, "--corners: 'x' is no number");
    fails("fractal --corners 1,2,3 -o a.exr", 2, "3 corners are given; 1 patches a side have 4");
    fails("fractal --tileable --size 500 -o a.exr", 2, "not 500; use 512");
    fails("fractal --size 9000 -o a.exr", 2, "--size");
    fails("fractal --color-seed 3 -o a.exr", 2, "--color-seed");
    fails("--from plain.exr -o a.exr", 1, "plain.exr: carries no recipe of a relief");
    fails("--from plain.exr --seed 4 -o a.exr", 2, "--seed is not for a tile made again");
    fails("--from black.png --hurst 0.5 -o a.exr", 2, "--hurst is not for a photo");
    fails("--from black.png", 1, "black or white");
    fails("--from black.png --patch 100,100,100,100", 2, "is not inside of the photo");
    fails("--from plain.exr --as heights -o a.exr", 1, "plain.exr: has no channel 'u'");
    fails("--from plain.exr --as slopes -o a.exr", 2, "--as");
    fails("--from plain.exr --as offsets --seed 4 -o a.exr", 2, "--seed is not for a map");
    fails("casting --as offsets -o a.exr", 2, "--as is for --from TILE.exr");
    fails("--from a.jpg -o a.exr", 1, "--from takes a photo (.png)");
    EXPECT_FALSE(std::filesystem::exists(scratch / "a.exr"));
}

} // namespace
} // namespace taihu
