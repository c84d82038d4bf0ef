#include "stats/io/photo_mask_detail.h"

#include <algorithm>
#include <string>
#include <vector>

#include <png.h>

#include "stats/core/error.h"
#include "stats/core/file.h"

namespace taihu {
namespace {

constexpr std::size_t kMostPixels = std::size_t{1} << 28;
constexpr std::size_t kMostPixelsPerByte = 8 * 1032; // one bit a pixel, and the best of deflate

/// Frees what libpng keeps between the header and the pixels.
struct PngImage : png_image {
    PngImage() : png_image{} { version = PNG_IMAGE_VERSION; }
    PngImage(const PngImage&) = delete;
    PngImage& operator=(const PngImage&) = delete;
    ~PngImage() { png_image_free(this); }
};

} // namespace

Image read_photo_mask(const std::filesystem::path& path) {
    const std::string bytes = read_file(path, std::size_t{1} << 30);
    const auto refuse = [&](const std::string& what) {
        return Error(Fault::bad_input, base_name(path) + ": " + what);
    };
    PngImage png;
    if (!png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()))
        throw refuse(std::string("no PNG: ") + png.message + "; save the mask as PNG");
    const std::string size =
        std::to_string(png.width) + " x " + std::to_string(png.height) + " pixels";
    const std::size_t n_pixels = std::size_t{png.width} * png.height;
    if (n_pixels > kMostPixels)
        throw refuse(size + ", at most 2^28 are read; reduce the mask");
    if (n_pixels / kMostPixelsPerByte > bytes.size())
        throw refuse(size + " cannot come out of " + std::to_string(bytes.size()) +
                     " bytes; the file is cut short or forged");
    png.format = PNG_FORMAT_GRAY;
    std::vector<png_byte> grey(n_pixels); // black, on which libpng lays what is transparent
    if (!png_image_finish_read(&png, nullptr, grey.data(), 0, nullptr))
        throw refuse(std::string("damaged PNG: ") + png.message + "; save the mask again");
    Image mask(static_cast<int>(png.width), static_cast<int>(png.height), 1);
    std::transform(grey.begin(), grey.end(), mask.pixels.begin(),
                   [](png_byte level) { return level > 127 ? 1.0f : 0.0f; });
    return mask;
}

} // namespace taihu
