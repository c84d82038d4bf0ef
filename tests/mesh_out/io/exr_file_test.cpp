#include "mesh_out/io/exr_file.h"

#include <cmath>
#include <cstring>
#include <fstream>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfTiledOutputFile.h>

#include "mesh_out/io/foreign_formats_detail.h"
#include "stats/core/file.h"
#include "tests/support/errors.h"
#include "tests/support/scratch.h"

namespace taihu {
namespace {

ExrImage sample(std::vector<std::string> channels, int width = 37, int height = 11) {
    ExrImage exr{Image(width, height, static_cast<int>(channels.size())),
                 std::move(channels),
                 {{"a recipe", "{\"seed\": 7}"}, {"pixel_m", "0.001"}}};
    for (std::size_t i = 0; i < exr.image.pixels.size(); ++i)
        exr.image.pixels[i] = static_cast<float>((i * 7919) % 1000) / 999.0f - 0.5f;
    exr.image.pixels[3] = -1e30f;
    exr.image.pixels[4] = 1e-42f; // subnormal
    return exr;
}

/// Without the care of write_file(), which waits for the disk, as some do to cut a file short.
void spill(const std::filesystem::path& path, std::string_view bytes) {
    std::filesystem::remove(path);
    std::ofstream(path, std::ios::binary) << bytes;
}

TEST(SeedRow, T01HeightsComeBackFromAFileBitForBit) {
    const Scratch folder;
    const ExrImage tile = sample({"Y"}, 129, 129);
    write_exr(folder / "a.exr", tile);
    const ExrImage back = read_exr(folder / "a.exr");
    EXPECT_EQ(back.channels, tile.channels);
    EXPECT_EQ(back.attributes, tile.attributes);
    ASSERT_EQ(back.image.width, 129);
    EXPECT_EQ(back.image.pixels, tile.image.pixels);
}

TEST(ExrFile, ChannelsAreFoundByName) {
    const Scratch folder;
    const ExrImage tile = sample({"height", "ao", "region"});
    write_exr(folder / "a.exr", tile);
    const std::vector<std::string> two = {"region", "height"};
    const ExrImage back = read_exr(folder / "a.exr", two);
    EXPECT_EQ(back.channels, two);
    for (int y = 0; y < 11; ++y)
        for (int x = 0; x < 37; ++x) {
            ASSERT_EQ(back.image.at(x, y)[0], tile.image.at(x, y)[2]);
            ASSERT_EQ(back.image.at(x, y)[1], tile.image.at(x, y)[0]);
        }
    EXPECT_EQ(read_exr(folder / "a.exr").channels,
              (std::vector<std::string>{"ao", "height", "region"}));
    const std::vector<std::string> none = {"depth"};
    expect_error(Fault::bad_input, "a.exr: has no channel 'depth'; it has ao, height, region",
                 [&] { read_exr(folder / "a.exr", none); });
}

TEST(ExrFile, HalvesKeepElevenBitsAndRefuseWhatTheyCannotHold) {
    const Scratch folder;
    ExrImage tile = sample({"R", "G", "B"});
    expect_error(Fault::bad_argument, "is beyond what a half holds; write it as float",
                 [&] { write_exr(folder / "a.exr", tile, ExrSamples::half); });
    EXPECT_FALSE(std::filesystem::exists(folder / "a.exr"));
    tile.image.pixels[3] = 0;
    write_exr(folder / "a.exr", tile, ExrSamples::half);
    write_exr(folder / "b.exr", tile);
    EXPECT_LT(std::filesystem::file_size(folder / "a.exr"),
              0.7 * static_cast<double>(std::filesystem::file_size(folder / "b.exr")));
    const std::vector<std::string> order = {"R", "G", "B"};
    const ExrImage back = read_exr(folder / "a.exr", order);
    EXPECT_EQ(back.attributes, tile.attributes);
    for (std::size_t i = 0; i < tile.image.pixels.size(); ++i) // half a step below 1/2, and zero
        ASSERT_NEAR(back.image.pixels[i], tile.image.pixels[i], std::ldexp(1, -13));
}

TEST(ExrFile, HalvesTilesAndShiftedWindowsAreRead) {
    const Scratch folder;
    std::vector<half> values(20 * 10);
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<float>(i) / 4;
    const Imath::Box2i window({-5, 7}, {14, 16});
    Imf::Header header(Imath::Box2i({0, 0}, {63, 63}), window);
    header.channels().insert("Y", Imf::Channel(Imf::HALF));
    Imf::FrameBuffer frame;
    frame.insert("Y", Imf::Slice::Make(Imf::HALF, values.data(), window));
    {
        Imf::OutputFile file((folder / "lines.exr").c_str(), header);
        file.setFrameBuffer(frame);
        file.writePixels(10);
        header.setTileDescription(Imf::TileDescription(8, 8));
        Imf::TiledOutputFile tiles((folder / "tiles.exr").c_str(), header);
        tiles.setFrameBuffer(frame);
        tiles.writeTiles(0, tiles.numXTiles() - 1, 0, tiles.numYTiles() - 1);
    }
    for (const char* name : {"lines.exr", "tiles.exr"}) {
        const Image image = read_exr(folder / name).image;
        ASSERT_EQ(image.width, 20) << name;
        ASSERT_EQ(image.height, 10) << name;
        for (std::size_t i = 0; i < values.size(); ++i)
            ASSERT_EQ(image.pixels[i], static_cast<float>(i) / 4) << name;
    }
}

TEST(ExrFile, CutShortAnywhereIsRefusedInOneLine) {
    const Scratch folder;
    write_exr(folder / "a.exr", sample({"Y"}));
    const std::string bytes = read_file(folder / "a.exr");
    for (std::size_t n = 0; n < bytes.size(); n += 101) {
        spill(folder / "cut.exr", std::string_view(bytes).substr(0, n));
        expect_error(Fault::bad_input, "cut.exr: ", [&] { read_exr(folder / "cut.exr"); });
    }
}

TEST(ExrFile, WithAnyByteChangedIsReadOrRefused) {
    const Scratch folder;
    write_exr(folder / "a.exr", sample({"Y", "region"}));
    const std::string bytes = read_file(folder / "a.exr");
    int n_refused = 0;
    for (std::size_t i = 0; i < bytes.size(); i += i < 600 ? 1 : 17)
        for (const char to : {'\xff', '\x00', '\x7f'}) {
            std::string changed = bytes;
            changed[i] = to;
            try { // as in the program that reads for others
                EXPECT_LE(flat_exr(changed, "b.exr", {}).size(), std::size_t{1} << 24); // of 4 kB
            } catch (const std::exception&) {
                ++n_refused;
            }
            if (i % 100 != 0)
                continue;
            spill(folder / "b.exr", changed);
            try {
                read_exr(folder / "b.exr");
            } catch (const Error& e) {
                EXPECT_EQ(std::string(e.what()).rfind("b.exr: ", 0), 0u) << e.what();
            }
        }
    EXPECT_GT(n_refused, 300);
}

/// The same file with another size in its data window, which has 16 bytes after the name.
std::string resized(std::string bytes, std::int32_t x, std::int32_t y) {
    const std::size_t at = bytes.find("dataWindow") + std::strlen("dataWindow") + 1 + 6 + 4;
    std::memcpy(bytes.data() + at + 8, &x, 4); // little-endian, as this machine
    std::memcpy(bytes.data() + at + 12, &y, 4);
    return bytes;
}

TEST(ExrFile, TooLargeIsRefusedBeforeAnythingIsAllocated) {
    const Scratch folder;
    write_exr(folder / "a.exr", sample({"Y"}));
    const std::string bytes = read_file(folder / "a.exr");
    const auto refused = [&](const std::string& changed) {
        spill(folder / "b.exr", changed);
        expect_error(Fault::bad_input, "b.exr: ", [&] { read_exr(folder / "b.exr"); });
    };
    for (const std::int32_t size : {100'000, 1'000'000'000, 2'147'483'646, -5})
        for (const std::int32_t other : {10, 1'000'000'000})
            refused(resized(bytes, size, other)), refused(resized(bytes, other, size));
    // A text of 2 GB that is not there.
    std::string text = bytes;
    const std::size_t at = text.find("a recipe") + 9 + 7;
    const std::int32_t huge = 0x7fffffff;
    std::memcpy(text.data() + at, &huge, 4);
    refused(text);
}

TEST(ExrFile, NamesWhatItDoesNotRead) {
    const Scratch folder;
    write_file(folder / "a.exr", "\x89PNG\r\n");
    expect_error(Fault::bad_input, "a.exr: not an EXR", [&] { read_exr(folder / "a.exr"); });
    expect_error(Fault::io, "none.exr", [&] { read_exr(folder / "none.exr"); });
    write_exr(folder / "b.exr", sample({"Y"}));
    std::string bytes = read_file(folder / "b.exr");
    bytes[5] = '\x10'; // several parts
    write_file(folder / "b.exr", bytes);
    expect_error(Fault::unsupported, "b.exr: has several parts",
                 [&] { read_exr(folder / "b.exr"); });
    bytes[5] = '\x08';
    write_file(folder / "b.exr", bytes);
    expect_error(Fault::unsupported, "b.exr: has deep data", [&] { read_exr(folder / "b.exr"); });
    Imf::Header header(4, 4);
    header.compression() = Imf::DWAA_COMPRESSION;
    header.channels().insert("Y", Imf::Channel(Imf::FLOAT));
    const std::vector<float> values(16, 1);
    Imf::FrameBuffer frame;
    frame.insert("Y", Imf::Slice::Make(Imf::FLOAT, values.data(), header.dataWindow()));
    {
        Imf::OutputFile file((folder / "dwa.exr").c_str(), header);
        file.setFrameBuffer(frame);
        file.writePixels(4);
    }
    expect_error(Fault::unsupported, "dwa.exr: DWA compression",
                 [&] { read_exr(folder / "dwa.exr"); });
}

TEST(ExrFile, WritesOnlyWhatHasNames) {
    const Scratch folder;
    for (const std::vector<std::string>& names :
         {std::vector<std::string>{"Y", "Y"}, {"Y", ""}, {"Y"}, {}}) {
        ExrImage exr = sample({"Y", "Z"});
        exr.channels = names;
        expect_error(Fault::bad_argument, "give each channel a name of its own",
                     [&] { write_exr(folder / "a.exr", exr); });
    }
    EXPECT_FALSE(std::filesystem::exists(folder / "a.exr"));
}

} // namespace
} // namespace taihu
