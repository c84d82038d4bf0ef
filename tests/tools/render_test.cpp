// taihu render: what lies around a mesh, turns, and its options.
#include <array>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "mesh_out/io/exr_file.h"
#include "mesh_out/io/image_file.h"
#include "tests/support/command.h"

namespace taihu {
namespace {

using nlohmann::json;
using testing::HasSubstr;

/// A ball of 20 cm and a tile of 5 cm.
class RenderCommand : public testing::Test {
protected:
    RenderCommand() {
        must("taihu shape sphere --size 20cm --subdivisions 3 -o ball.glb -q", scratch_);
        must("taihu relief broken-rock --size 65 --pixel 1mm -o tile.exr -q", scratch_);
    }
    json render(const std::string& options) {
        return result("taihu render ball.glb --size 48x48 --samples 1 " + options, scratch_);
    }
    Image picture(const std::string& name) { return read_png(scratch_ / name); }

    Scratch scratch_;
};

TEST_F(RenderCommand, AReliefChangesThePictureAndItsScaleAndSideDo) {
    render("-o plain.png");
    render("--relief tile.exr -o bumped.png");
    EXPECT_NE(picture("plain.png").pixels, picture("bumped.png").pixels);
    render("--relief tile.exr --relief-scale 0 -o flat.png");
    EXPECT_EQ(picture("flat.png").pixels, picture("plain.png").pixels);
    for (const char* option : {"--relief-scale 2", "--tile-side 50%", "--around sphere",
                               "--around cube", "--around cylinder", "--around planar",
                               "--displace", "--material unglazed-china", "--grain tile.exr"}) {
        render(std::string("--relief tile.exr ") + option + " -o other.png --no-ground");
        render("--relief tile.exr -o bumped.png --no-ground");
        EXPECT_NE(picture("other.png").pixels, picture("bumped.png").pixels) << option;
    }
}

TEST_F(RenderCommand, ColourSubregionsArePaintedWhateverTheirFileHolds) {
    must("taihu relief convex --size 64 --tileable --pixel 1mm --colors 6 -o cells.exr -q",
         scratch_);
    const std::string lit = " --material convex --reflection 0.5,0,0,1 --no-ground -o ";
    render("--relief cells.exr" + lit + "even.png");
    render("--relief cells.exr --colors" + lit + "painted.png");
    const auto n_colors = [&](const char* name) {
        const Image image = picture(name);
        std::set<std::array<float, 3>> seen; // in the middle, where nothing is but the ball
        for (int y = 14; y < 34; ++y)
            for (int x = 14; x < 34; ++x)
                seen.insert({image.at(x, y)[0], image.at(x, y)[1], image.at(x, y)[2]});
        return seen.size();
    };
    EXPECT_EQ(n_colors("even.png"), 1u); // ambient light alone
    EXPECT_GE(n_colors("painted.png"), 3u);

    ExrImage odd;
    odd.channels = {"Y", "color_region"};
    odd.attributes = {{"pixel_m", "0.01"}};
    odd.image = Image(4, 4, 2);
    for (std::size_t i = 1; i < odd.image.pixels.size(); i += 2)
        odd.image.pixels[i] = i % 4 == 1 ? -3e9F : 1e30F;
    write_exr(scratch_ / "odd.exr", odd);
    render("--relief odd.exr --colors -o odd.png");
}

TEST_F(RenderCommand, ATurnIsASheetOrFiles) {
    const json sheet = render("--views 3 -o sheet.png");
    EXPECT_EQ(sheet["files"], json({"sheet.png"}));
    const Image image = picture("sheet.png");
    EXPECT_EQ(image.width, 96);
    EXPECT_EQ(image.height, 96);
    const json apart = render("--views 3 -o turn_##.png");
    EXPECT_EQ(apart["files"], json({"turn_00.png", "turn_01.png", "turn_02.png"}));
    render("--turntable 120 -o one.png");
    EXPECT_EQ(picture("one.png").pixels, picture("turn_01.png").pixels);
    for (int y = 0; y < 48; ++y)
        EXPECT_TRUE(
            std::equal(image.at(48, y), image.at(48, y) + 3 * 48, picture("turn_01.png").at(0, y)));
}

TEST_F(RenderCommand, RefusesOptionsWithoutWhatTheyAreFor) {
    const auto refused = [&](const std::string& options, const char* why, int code = 2) {
        const Finished said = run("taihu render ball.glb -o x.png " + options, scratch_.path());
        EXPECT_EQ(said.exit_code, code) << options;
        EXPECT_THAT(said.err, HasSubstr(why));
        EXPECT_FALSE(std::filesystem::exists(scratch_ / "x.png"));
    };
    refused("--displace", "--displace: is for --relief");
    refused("--tile-side 1cm", "--tile-side: is for --relief or --grain");
    refused("--colors", "--colors: is for --relief");
    refused("--reflection 0,1,0,1", "--reflection: is for --material");
    refused("--material fractal --reflection 0,1", "--reflection");
    refused("--relief tile.exr --colors", "color_region", 1); // the tile has none
    refused("--light-azimuth 90", "--light-azimuth: is for --material");
    refused("--material marble", "marble");
    refused("--views 300 --size 1000x1000", "larger than 16384 pixels");
    write_image(scratch_ / "height.exr", Image(4, 4, 1));
    refused("--relief height.exr", "--tile-side", 1); // the file does not say
}

} // namespace
} // namespace taihu
