#pragma once
#include <cstddef>
#include <vector>

namespace taihu {

/// A picture or a map: `channels` floats per pixel, row-major, the first row is the top one.
struct Image {
    int width = 0, height = 0, channels = 0;
    std::vector<float> pixels; ///< width * height * channels, linear light unless said otherwise

    Image() = default;
    Image(int w, int h, int c)
        : width(w), height(h), channels(c),
          pixels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) *
                 static_cast<std::size_t>(c)) {}

    float* at(int x, int y) {
        return pixels.data() + (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                static_cast<std::size_t>(x)) *
                                   static_cast<std::size_t>(channels);
    }
    const float* at(int x, int y) const { return const_cast<Image*>(this)->at(x, y); }
};

} // namespace taihu
