#include "vdb_ops/reflection.h"

#include <numbers>

#include <tbb/parallel_for.h>

namespace taihu {
namespace {

/// Difference quotient of the heights along a line of `n` samples, `stride` floats apart.
double slope(const float* line, std::ptrdiff_t stride, int i, int n, double pixel_m,
             bool tileable) {
    const auto height = [&](int k) { return double{line[k * stride]}; };
    if (tileable)
        return (height((i + 1) % n) - height((i + n - 1) % n)) / (2 * pixel_m);
    const int before = std::max(i - 1, 0), after = std::min(i + 1, n - 1);
    return (height(after) - height(before)) / ((after - before) * pixel_m);
}

} // namespace

Vec3 DistantLight::direction() const {
    const double a = azimuth_deg * std::numbers::pi / 180,
                 e = elevation_deg * std::numbers::pi / 180;
    return {std::cos(a) * std::cos(e), std::sin(a) * std::cos(e), std::sin(e)};
}

Vec3 height_normal(const Image& heights, double pixel_m, bool tileable, int x, int y) {
    const double across = slope(heights.at(0, y), 1, x, heights.width, pixel_m, tileable);
    const double down =
        slope(heights.at(x, 0), heights.width, y, heights.height, pixel_m, tileable);
    return normalized({-across, down, 1});
}

Image shaded_heights(const Image& heights, double pixel_m, bool tileable,
                     const Reflection& reflection, const DistantLight& light) {
    const Vec3 to_light = light.direction(), to_viewer{0, 0, 1};
    Image out(heights.width, heights.height, 1);
    tbb::parallel_for(0, heights.height, [&](int y) {
        for (int x = 0; x < heights.width; ++x)
            *out.at(x, y) = static_cast<float>(intensity(
                reflection, height_normal(heights, pixel_m, tileable, x, y), to_light, to_viewer));
    });
    return out;
}

} // namespace taihu
