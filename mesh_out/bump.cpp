#include "mesh_out/bump.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "stats/core/error.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

void check(const Image& map, int channels, const char* what) {
    const auto expected = static_cast<std::size_t>(std::max(map.width, 0)) *
                          static_cast<std::size_t>(std::max(map.height, 0)) *
                          static_cast<std::size_t>(channels);
    if (map.channels != channels || expected == 0 || map.pixels.size() != expected)
        throw Error(Fault::bad_argument,
                    std::string("bump: ") + what + " are " + std::to_string(map.width) + " x " +
                        std::to_string(map.height) + " pixels of " + std::to_string(map.channels) +
                        " channels, need " + std::to_string(channels) + " and a pixel at least");
    for (std::size_t i = 0; i < map.pixels.size(); ++i)
        if (!std::isfinite(map.pixels[i]))
            throw Error(Fault::bad_argument, std::string("bump: ") + what + ": value " +
                                                 std::to_string(i) +
                                                 " is not finite; mend the map first");
}

/// The neighbours of texels.
struct Grid {
    int w, h;
    bool wrap;

    std::size_t at(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(w) +
               static_cast<std::size_t>(x);
    }
    std::size_t size() const { return at(0, h); }
    /// fn(texel, the one to its right, 0) and fn(texel, the one above, 1), in a fixed order.
    template <class Fn>
    void each_pair(Fn&& fn) const {
        for (int y = 0; y < h; ++y)
            for (int x = 0; x < w; ++x) {
                if (x + 1 < w || wrap)
                    fn(at(x, y), at(x + 1 < w ? x + 1 : 0, y), std::size_t{0});
                if (y > 0 || wrap)
                    fn(at(x, y), at(x, y > 0 ? y - 1 : h - 1), std::size_t{1});
            }
    }
};

Grid grid_of(const Image& map, MapBorder border) {
    return {map.width, map.height, border == MapBorder::wrap};
}

/// What is left of the normal equations: divergence of (offsets - differences of `heights`).
std::vector<double> residual(const Grid& grid, const Image& offsets,
                             const std::vector<double>& heights) {
    std::vector<double> r(grid.size());
    grid.each_pair([&](std::size_t i, std::size_t j, std::size_t channel) {
        const double miss = offsets.pixels[2 * i + channel] - (heights[j] - heights[i]);
        r[j] += miss;
        r[i] -= miss;
    });
    return r;
}

double dot(const std::vector<double>& a, const std::vector<double>& b) {
    return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

/// Along the lowest row, then up the columns.
std::vector<double> summed(const Grid& grid, const Image& offsets) {
    std::vector<double> heights(grid.size());
    for (int y = grid.h - 1; y >= 0; --y)
        for (int x = 0; x < grid.w; ++x) {
            if (y < grid.h - 1)
                heights[grid.at(x, y)] =
                    heights[grid.at(x, y + 1)] + offsets.pixels[2 * grid.at(x, y + 1) + 1];
            else if (x > 0)
                heights[grid.at(x, y)] =
                    heights[grid.at(x - 1, y)] + offsets.pixels[2 * grid.at(x - 1, y)];
        }
    return heights;
}

} // namespace

Image bump_offsets(const Image& heights, MapBorder border) {
    check(heights, 1, "heights");
    Image out(heights.width, heights.height, 2);
    grid_of(heights, border).each_pair([&](std::size_t i, std::size_t j, std::size_t channel) {
        out.pixels[2 * i + channel] = heights.pixels[j] - heights.pixels[i];
    });
    return out;
}

Image bump_heights(const Image& offsets, MapBorder border) {
    check(offsets, 2, "offsets");
    const Grid grid = grid_of(offsets, border);
    std::vector<double> heights = summed(grid, offsets);
    std::vector<double> r = residual(grid, offsets, heights), p = r, ap(r.size());
    const std::vector<double> none(grid.size());
    const std::vector<double> whole = residual(grid, offsets, none);
    constexpr double kEnough = 1e-7; // of the offsets: the last bits of a float
    const double target = kEnough * kEnough * dot(whole, whole);
    double rr = dot(r, r);
    for (int i = 0; i < 8 * (grid.w + grid.h) && rr > target; ++i) {
        std::fill(ap.begin(), ap.end(), 0.0);
        grid.each_pair([&](std::size_t a, std::size_t b, std::size_t) {
            ap[a] += p[a] - p[b];
            ap[b] += p[b] - p[a];
        });
        const double step = rr / dot(p, ap);
        if (!std::isfinite(step))
            break; // nothing is left but a constant
        for (std::size_t k = 0; k < r.size(); ++k) {
            heights[k] += step * p[k];
            r[k] -= step * ap[k];
        }
        const double next = dot(r, r);
        for (std::size_t k = 0; k < r.size(); ++k)
            p[k] = r[k] + next / rr * p[k];
        rr = next;
    }
    const double mean =
        std::accumulate(heights.begin(), heights.end(), 0.0) / static_cast<double>(heights.size());
    Image out(offsets.width, offsets.height, 1);
    for (std::size_t k = 0; k < heights.size(); ++k)
        out.pixels[k] = static_cast<float>(heights[k] - mean);
    return out;
}

Image bump_normals(const Image& offsets, double scale) {
    check(offsets, 2, "offsets");
    if (!std::isfinite(scale))
        throw Error(Fault::bad_argument,
                    "bump: scale is " + shortest(scale) + ", must be finite; give another");
    Image out(offsets.width, offsets.height, 3);
    for (std::size_t i = 0; i < offsets.pixels.size() / 2; ++i) {
        const double u = -scale * offsets.pixels[2 * i], v = -scale * offsets.pixels[2 * i + 1];
        const double length = std::sqrt(u * u + v * v + 1);
        out.pixels[3 * i] = static_cast<float>(u / length);
        out.pixels[3 * i + 1] = static_cast<float>(v / length);
        out.pixels[3 * i + 2] = static_cast<float>(1 / length);
    }
    return out;
}

} // namespace taihu
