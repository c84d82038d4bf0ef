#include "mesh_out/bump.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "mesh_out/texture_coordinates.h"
#include "stats/core/error.h"
#include "stats/core/portable_math.h"
#include "stats/core/rng.h"
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

Image bump_heights(const Image& offsets, MapBorder border, Progress* progress) {
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
        check_cancelled(progress);
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

Image static_bump_map(int side, double hurst, std::uint64_t seed) {
    constexpr std::uint32_t kStream = 0x62756d70; // "bump"
    constexpr int kCells = 8;
    if (side < 16 || side > 8192 || !(hurst >= 0.05 && hurst <= 2))
        throw Error(Fault::bad_argument, "bump: a map of side " + std::to_string(side) +
                                             " and hurst " + shortest(hurst) +
                                             "; take a side in 16..8192, hurst in 0.05..2");
    Image out(side, side, 1);
    double amplitude = 1, sum = 0;
    std::uint32_t octave = 0;
    for (int cells = kCells; 2 * cells <= side; cells *= 2, ++octave) {
        const auto at = [&](int x, int y) {
            const auto item =
                static_cast<std::uint64_t>(y % cells) << 32 | static_cast<std::uint64_t>(x % cells);
            return 2 * Rng{seed, kStream}.uniform(item, octave) - 1;
        };
        const auto ease = [](double t) { return t * t * (3 - 2 * t); };
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x) {
                const double u = static_cast<double>(x) * cells / side,
                             v = static_cast<double>(y) * cells / side;
                const int i = static_cast<int>(u), j = static_cast<int>(v);
                const double s = ease(u - i), t = ease(v - j);
                const double low = at(i, j) + s * (at(i + 1, j) - at(i, j));
                const double high = at(i, j + 1) + s * (at(i + 1, j + 1) - at(i, j + 1));
                *out.at(x, y) += static_cast<float>(amplitude * (low + t * (high - low)));
            }
        sum += amplitude;
        amplitude *= portable_exp(-hurst * portable_log(2));
    }
    for (float& v : out.pixels)
        v = static_cast<float>(v / sum);
    return out;
}

std::vector<Vec3> bumped_normals(const TriMesh& mesh, const Image& offsets, const Box& of,
                                 double scale, int repeats) {
    check(offsets, 2, "offsets");
    if (mesh.normals.size() != mesh.positions.size() || repeats < 1 || !std::isfinite(scale))
        throw Error(Fault::bad_argument,
                    "bump: need a mesh with normals, a finite scale and a repeat at least; has " +
                        std::to_string(mesh.normals.size()) + " normals, scale " + shortest(scale) +
                        ", " + std::to_string(repeats) + " repeats");
    const auto at = texture_coordinates(mesh, TextureMap::spherical, of);
    const Vec3 middle = of.center();
    std::vector<Vec3> normals = mesh.normals;
    const auto texel = [](double share, int n) {
        return std::min(static_cast<int>((share - std::floor(share)) * n), n - 1);
    };
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t vertex = mesh.triangles[i][k];
            const Vec3 out = mesh.positions[vertex] - middle, &n = mesh.normals[vertex];
            const Vec3 east = normalized({out.z, 0, -out.x});
            const Vec3 along_u = normalized(east - n * dot(east, n)), along_v = cross(n, along_u);
            const float* lean =
                offsets.at(texel(at.corners[i][k].u * repeats, offsets.width),
                           texel((1 - at.corners[i][k].v) * repeats, offsets.height));
            normals[vertex] =
                normalized(n - along_u * (scale * lean[0]) - along_v * (scale * lean[1]));
        }
    return normals;
}

} // namespace taihu
