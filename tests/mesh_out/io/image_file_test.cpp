#include "mesh_out/io/image_file.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "tests/support/scratch.h"

namespace taihu {
namespace {

using testing::HasSubstr;

Image ramp(int channels) {
    Image image(37, 11, channels);
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
        image.pixels[i] = static_cast<float>((i * 7919) % 1000) / 999.0f;
    return image;
}

/// The curve as the standard writes it.
double srgb(double linear) {
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

void expect_error(Fault fault, const std::string& part, const std::function<void()>& call) {
    try {
        call();
        FAIL() << "no exception, expected " << part;
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), fault);
        EXPECT_THAT(e.what(), HasSubstr(part));
        EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    }
}

class PngChannels : public testing::TestWithParam<int> {};

TEST_P(PngChannels, ComeBackWithinAStepOfEightBits) {
    const Scratch folder;
    const int channels = GetParam();
    const Image image = ramp(channels);
    write_image(folder / "a.png", image);
    const Image back = read_png(folder / "a.png");
    ASSERT_EQ(back.width, image.width);
    ASSERT_EQ(back.height, image.height);
    ASSERT_EQ(back.channels, channels);
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        const bool alpha = channels == 4 && i % 4 == 3;
        const double a = alpha ? image.pixels[i] : srgb(image.pixels[i]);
        const double b = alpha ? back.pixels[i] : srgb(back.pixels[i]);
        EXPECT_NEAR(a, b, 0.5 / 255 + 1e-6)
            << i; // rounded to 8 bits, then held in single precision
    }
}
INSTANTIATE_TEST_SUITE_P(PngImage, PngChannels, testing::Values(1, 3, 4),
                         testing::PrintToStringParamName());

TEST(PngImage, DataIsStoredWithoutACurve) {
    const Scratch folder;
    const Image image = ramp(3);
    write_file(folder / "a.png", format_png(image, PngValues::data, "a.png"));
    const Image back = read_png(folder / "a.png", PngValues::data);
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
        ASSERT_NEAR(back.pixels[i], image.pixels[i], 0.5001 / 255); // half a step of 8 bits
    EXPECT_EQ(read_file(folder / "a.png").find("sRGB"), std::string::npos);
    expect_error(Fault::bad_argument, "map: the image has 2 channels",
                 [&] { format_png(ramp(2), PngValues::data, "map"); });
}

TEST(PngImage, CutsWhatDoesNotFit) {
    const Scratch folder;
    Image image(5, 1, 1);
    image.pixels = {-1, 2, std::nanf(""), INFINITY, 0};
    write_image(folder / "a.png", image);
    EXPECT_THAT(read_png(folder / "a.png").pixels, testing::ElementsAre(0, 1, 0, 1, 0));
}

TEST(PngImage, HasTheSameBytesTwiceAndNoTime) {
    const Scratch folder;
    write_image(folder / "a.png", ramp(3), {{"Seed", "17"}});
    write_image(folder / "b.png", ramp(3), {{"Seed", "17"}});
    const std::string bytes = read_file(folder / "a.png");
    EXPECT_EQ(bytes, read_file(folder / "b.png"));
    EXPECT_EQ(bytes.find("tIME"), std::string::npos);
    EXPECT_NE(bytes.find(std::string("tEXtSeed\0", 9) + "17"), std::string::npos);
}

TEST(PngImage, CutShortAnywhereIsRefusedInOneLine) {
    const Scratch folder;
    write_image(folder / "a.png", ramp(3));
    const std::string bytes = read_file(folder / "a.png");
    for (std::size_t n = 0; n < bytes.size(); n += 13) {
        write_file(folder / "cut.png", std::string_view(bytes).substr(0, n));
        expect_error(Fault::bad_input, "cut.png: ", [&] { read_png(folder / "cut.png"); });
    }
}

TEST(PngImage, WithAFlippedBitIsRefused) {
    const Scratch folder;
    write_image(folder / "a.png", ramp(1));
    std::string bytes = read_file(folder / "a.png");
    const std::size_t data = bytes.find("IDAT") + 4;
    bytes[data + 20] = static_cast<char>(bytes[data + 20] ^ 8);
    write_file(folder / "b.png", bytes);
    expect_error(Fault::bad_input, "b.png: damaged PNG", [&] { read_png(folder / "b.png"); });
}

TEST(PngImage, OfAPaletteIsExpanded) {
    const Scratch folder;
    const std::array<png_byte, 9> palette = {255, 0, 0, 0, 255, 0, 0, 0, 188};
    const std::array<png_byte, 4> indices = {0, 1, 2, 1};
    png_image source{};
    source.version = PNG_IMAGE_VERSION;
    source.width = source.height = 2;
    source.format = PNG_FORMAT_RGB_COLORMAP;
    source.colormap_entries = 3;
    ASSERT_TRUE(png_image_write_to_file(&source, (folder / "a.png").c_str(), 0, indices.data(), 0,
                                        palette.data()));
    const Image image = read_png(folder / "a.png");
    ASSERT_EQ(image.channels, 3);
    const float blue = image.at(0, 1)[2];
    EXPECT_NEAR(srgb(blue), 188 / 255.0, 1e-6); // held in single precision
    EXPECT_THAT(image.pixels, testing::ElementsAre(1, 0, 0, 0, 1, 0, 0, 0, blue, 0, 1, 0));
}

TEST(PngImage, OfSixteenBitsWithItsOwnGammaKeepsBoth) {
    const Scratch folder;
    const std::array<png_uint_16, 4> grey_alpha = {1000, 65535, 30000, 65535};
    png_image source{};
    source.version = PNG_IMAGE_VERSION;
    source.width = 2;
    source.height = 1;
    source.format = PNG_FORMAT_LINEAR_Y_ALPHA; // libpng writes gAMA 1
    ASSERT_TRUE(png_image_write_to_file(&source, (folder / "a.png").c_str(), 0, grey_alpha.data(),
                                        0, nullptr));
    const Image image = read_png(folder / "a.png");
    ASSERT_EQ(image.channels, 2);
    EXPECT_THAT(image.pixels, testing::ElementsAre(testing::FloatEq(1000 / 65535.0f), 1,
                                                   testing::FloatEq(30000 / 65535.0f), 1));
}

/// A PNG of w x h grey pixels that has a header, one empty data chunk and nothing else.
std::string hollow_png(std::uint32_t w, std::uint32_t h) {
    const auto crc = [](std::string_view s) {
        std::uint32_t c = ~0u;
        for (const char ch : s) {
            c ^= static_cast<unsigned char>(ch);
            for (int k = 0; k < 8; ++k)
                c = c & 1 ? 0xEDB88320u ^ (c >> 1) : c >> 1;
        }
        return ~c;
    };
    const auto word = [](std::uint32_t x) {
        return std::string{static_cast<char>(x >> 24), static_cast<char>(x >> 16),
                           static_cast<char>(x >> 8), static_cast<char>(x)};
    };
    const auto chunk = [&](const std::string& body) {
        return word(static_cast<std::uint32_t>(body.size() - 4)) + body + word(crc(body));
    };
    return "\x89PNG\r\n\x1a\n" +
           chunk("IHDR" + word(w) + word(h) + std::string("\x08\0\0\0\0", 5)) + chunk("IDAT");
}

TEST(PngImage, TooLargeIsRefusedBeforeAnythingIsAllocated) {
    const Scratch folder;
    write_file(folder / "a.png", hollow_png(0x7fffffff, 0x7fffffff));
    expect_error(Fault::bad_input, "2147483647 x 2147483647 pixels, at most 2^28",
                 [&] { read_png(folder / "a.png"); });
    write_file(folder / "b.png", hollow_png(16384, 16384));
    expect_error(Fault::bad_input, "16384 x 16384 pixels cannot come out of 45 bytes",
                 [&] { read_png(folder / "b.png"); });
}

TEST(ExrImage, IsReadBackBitForBitByOpenExr) {
    const Scratch folder;
    for (const int channels : {1, 3, 4}) {
        Image image = ramp(channels);
        image.pixels[5] = -1e30f; // no range is imposed
        write_image(folder / "a.exr", image, {{"seed", "17"}});
        Imf::InputFile file((folder / "a.exr").c_str());
        EXPECT_EQ(file.header().compression(), Imf::ZIP_COMPRESSION);
        EXPECT_EQ(file.header().typedAttribute<Imf::StringAttribute>("seed").value(), "17");
        const auto window = file.header().dataWindow();
        ASSERT_EQ(window.max.x - window.min.x + 1, image.width);
        ASSERT_EQ(window.max.y - window.min.y + 1, image.height);
        Image back(image.width, image.height, channels);
        Imf::FrameBuffer frame;
        for (int c = 0; c < channels; ++c) {
            const std::string name(1, channels == 1 ? 'Y' : "RGBA"[c]);
            ASSERT_NE(file.header().channels().findChannel(name), nullptr) << name;
            EXPECT_EQ(file.header().channels().findChannel(name)->type, Imf::FLOAT);
            const std::size_t pixel = sizeof(float) * static_cast<std::size_t>(channels);
            frame.insert(name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(back.at(0, 0) + c),
                                          pixel, pixel * static_cast<std::size_t>(back.width)));
        }
        file.setFrameBuffer(frame);
        file.readPixels(window.min.y, window.max.y);
        EXPECT_EQ(back.pixels, image.pixels);
    }
}

TEST(ExrImage, HasTheSameBytesTwice) {
    const Scratch folder;
    write_image(folder / "a.exr", ramp(3));
    write_image(folder / "b.exr", ramp(3));
    EXPECT_EQ(read_file(folder / "a.exr"), read_file(folder / "b.exr"));
}

TEST(ExrImage, RefusesAnAttributeThatWouldHideItsOwn) {
    const Scratch folder;
    expect_error(Fault::bad_argument, "a.exr: OpenEXR refuses", [&] {
        write_image(folder / "a.exr", ramp(3), {{"channels", "x"}});
    });
    EXPECT_FALSE(std::filesystem::exists(folder / "a.exr"));
}

TEST(WriteImage, NamesWhatIsWrong) {
    const Scratch folder;
    expect_error(Fault::unsupported, "a.jpg: images are written as .png or .exr, not '.jpg'",
                 [&] { write_image(folder / "a.jpg", ramp(3)); });
    expect_error(Fault::bad_argument, "the image has 2 channels; give 1, 3 or 4",
                 [&] { write_image(folder / "a.png", ramp(2)); });
    expect_error(Fault::bad_argument, "0 numbers are no image of 0 x 0 pixels",
                 [&] { write_image(folder / "a.png", Image(0, 0, 3)); });
    Image torn = ramp(3);
    torn.pixels.pop_back();
    expect_error(Fault::bad_argument, "no image of 37 x 11 pixels",
                 [&] { write_image(folder / "a.exr", torn); });
    expect_error(Fault::bad_argument, "attribute '': a PNG takes names of 1 to 79", [&] {
        write_image(folder / "a.png", ramp(1), {{"", "x"}});
    });
}

} // namespace
} // namespace taihu
