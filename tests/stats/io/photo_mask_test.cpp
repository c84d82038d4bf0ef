#include "stats/io/photo_mask_detail.h"

#include <fstream>

#include "tests/stats/io/annotation_makers.h"
#include "tests/stats/io/png_maker.h"
#include "tests/support/errors.h"
#include "tests/support/scratch.h"

namespace taihu {
namespace {

std::vector<float> mask_of(const std::string& png) {
    const Scratch scratch;
    std::ofstream(scratch / "m.png", std::ios::binary) << png; // not synced: quicker
    return read_photo_mask(scratch / "m.png").pixels;
}

TEST(PhotoMask, IsWhereThePictureIsBright) {
    EXPECT_EQ(mask_of(png_of(3, 2, PNG_FORMAT_GRAY, {0, 127, 128, 255, 1, 200})),
              (std::vector<float>{0, 0, 1, 1, 0, 1}));
    EXPECT_EQ(mask_of(png_of(2, 1, PNG_FORMAT_RGB, {255, 255, 255, 0, 0, 90})),
              (std::vector<float>{1, 0}));
    // What is transparent is outside, however bright.
    EXPECT_EQ(mask_of(png_of(2, 1, PNG_FORMAT_GA, {255, 255, 255, 0})), (std::vector<float>{1, 0}));
}

TEST(PhotoMask, RefusesWhatIsNoPng) {
    const std::string good = png_of(3, 2, PNG_FORMAT_GRAY, {0, 127, 128, 255, 1, 200});
    for (std::size_t n = 0; n < good.size() - 12; ++n) // the last chunk says nothing
        expect_error(Fault::bad_input, "m.png: ", [&] { mask_of(good.substr(0, n)); });
    std::string flipped = good;
    flipped[good.find("IDAT") + 8] ^= 0x10; // in the compressed rows
    expect_error(Fault::bad_input, "m.png: damaged PNG", [&] { mask_of(flipped); });
}

TEST(PhotoMask, RefusesSizesThatItsBytesCannotHold) {
    const auto with_size = [](std::uint32_t width, std::uint32_t height) {
        std::string png = png_of(3, 2, PNG_FORMAT_GRAY, {0, 127, 128, 255, 1, 200});
        png.replace(16, 8, big_endian(width, 4) + big_endian(height, 4));
        return png.replace(29, 4, big_endian(crc32_of(png.substr(12, 17)), 4));
    };
    expect_error(Fault::bad_input, "30000 x 30000 pixels, at most 2^28 are read",
                 [&] { mask_of(with_size(30000, 30000)); });
    expect_error(Fault::bad_input, "10000 x 10000 pixels cannot come out of",
                 [&] { mask_of(with_size(10000, 10000)); });
}

} // namespace
} // namespace taihu
