#include "mesh_out/textured_mesh.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "stats/core/error.h"

namespace taihu {
namespace {

constexpr int kMostSide_px = 16384;

struct Point {
    double x = 0, y = 0; ///< [texels], y downwards
};

using Corners = std::array<Point, 3>;

Corners corners_of(const TexturedMesh& textured, std::uint32_t face, int side_px) {
    Corners out;
    for (std::size_t k = 0; k < 3; ++k) {
        const TexturePoint& t = textured.texture[textured.mesh.triangles[face][k]];
        out[k] = {t.u * side_px, (1 - t.v) * side_px};
    }
    return out;
}

/// Twice the area of a, b, c.
double area2(const Point& a, const Point& b, const Point& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

std::array<double, 3> weights(const Corners& c, const Point& p) {
    const double whole = area2(c[0], c[1], c[2]);
    if (whole == 0)
        return {1, 0, 0};
    const double a = area2(p, c[1], c[2]) / whole, b = area2(p, c[2], c[0]) / whole;
    return {a, b, 1 - a - b};
}

void check(const TexturedMesh& textured, int side_px) {
    const auto refuse = [](const std::string& what) {
        throw Error(Fault::bad_argument, "texel faces: " + what);
    };
    if (side_px < 1 || side_px > kMostSide_px)
        refuse("side_px is " + std::to_string(side_px) + ", must be 1..16384");
    if (textured.texture.size() != textured.mesh.positions.size())
        refuse(std::to_string(textured.texture.size()) + " texture points for " +
               std::to_string(textured.mesh.positions.size()) +
               " positions; give one for each position");
    for (std::size_t i = 0; i < textured.texture.size(); ++i)
        if (const auto [u, v] = textured.texture[i]; !(u >= 0 && u <= 1 && v >= 0 && v <= 1))
            refuse("texture[" + std::to_string(i) + "] is " + std::to_string(u) + ", " +
                   std::to_string(v) + ", must lie in 0..1");
}

} // namespace

std::vector<std::uint32_t> texel_faces(const TexturedMesh& textured, int side_px) {
    check(textured, side_px);
    const auto side = static_cast<std::size_t>(side_px);
    std::vector<std::uint32_t> owners(side * side, kNoFace);
    for (std::uint32_t f = 0; f < textured.mesh.triangles.size(); ++f) {
        const Corners c = corners_of(textured, f, side_px);
        const auto first = [](double lo) { return std::max(0, int(std::ceil(lo - 0.5))); };
        const auto last = [&](double hi) {
            return std::min(side_px - 1, int(std::floor(hi - 0.5)));
        };
        const auto [x_lo, x_hi] = std::minmax({c[0].x, c[1].x, c[2].x});
        const auto [y_lo, y_hi] = std::minmax({c[0].y, c[1].y, c[2].y});
        if (area2(c[0], c[1], c[2]) == 0)
            continue;
        for (int y = first(y_lo); y <= last(y_hi); ++y)
            for (int x = first(x_lo); x <= last(x_hi); ++x) {
                const auto [a, b, d] = weights(c, {x + 0.5, y + 0.5});
                std::uint32_t& owner =
                    owners[static_cast<std::size_t>(y) * side + static_cast<std::size_t>(x)];
                if (owner == kNoFace && a >= 0 && b >= 0 && d >= 0)
                    owner = f;
            }
    }
    return owners;
}

std::array<double, 3> texture_weights(const TexturedMesh& textured, std::uint32_t face, double x_px,
                                      double y_px, int side_px) {
    return weights(corners_of(textured, face, side_px), {x_px, y_px});
}

} // namespace taihu
