#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "stats/core/image.h"

namespace taihu {

/// What the numbers of a PNG stand for.
enum class PngValues {
    light, ///< linear light, stored by the curve of sRGB
    data   ///< anything else in 0..1, such as a normal's (n + 1) / 2, stored as it is
};

/// The bytes of an 8-bit PNG of 1, 3 or 4 channels, held to 0..1; alpha is stored as it is. The
/// same image gives the same bytes. \throws as write_image(); `where` begins the message.
std::string format_png(const Image& image, PngValues values, const std::string& where,
                       const std::vector<std::pair<std::string, std::string>>& attributes = {});

/// Write 1, 3 or 4 channels as an 8-bit PNG (linear light becomes sRGB; alpha stays) or as a
/// scanline EXR (32-bit float, ZIP compression, channels Y or R, G, B, A); `attributes` become its
/// text chunks or string attributes. The extension decides. In one step, like write_file(). The
/// same image gives the same bytes. \throws Error unsupported: another extension; bad_argument: an
/// empty image, another channel count.
void write_image(const std::filesystem::path& path, const Image& image,
                 const std::vector<std::pair<std::string, std::string>>& attributes = {});

/// A PNG with its own channel count (palette and grey below 8 bits expanded). Light is linear: the
/// file's curve is sRGB's unless its gAMA chunk says something else.
/// \throws Error bad_input, io; bad_input above 2^28 pixels.
Image read_png(const std::filesystem::path& path, PngValues values = PngValues::light);

} // namespace taihu
