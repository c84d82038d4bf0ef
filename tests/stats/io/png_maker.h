#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include <png.h>

namespace taihu {

/// A PNG of 8-bit samples, in one of libpng's PNG_FORMAT_s.
inline std::string png_of(unsigned width, unsigned height, unsigned format,
                          const std::vector<unsigned char>& samples) {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = width;
    image.height = height;
    image.format = format;
    std::string bytes(samples.size() * 2 + 4096, '\0');
    png_alloc_size_t size = bytes.size();
    if (!png_image_write_to_memory(&image, bytes.data(), &size, 0, samples.data(), 0, nullptr))
        return {};
    bytes.resize(size);
    return bytes;
}

} // namespace taihu
