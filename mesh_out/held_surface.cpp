#include "mesh_out/held_surface_detail.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <tbb/parallel_for.h>

#include "mesh_out/surface_distance.h"

namespace taihu {

HeldSurface held_surface(const TriMesh& surface, const TriMesh& coarse, const FieldProbe& grown,
                         std::span<const Sphere> closed, double deep_m, double bound_m) {
    constexpr double kMostParts = 64; // of an edge
    const SurfaceDistance to_coarse(coarse);
    const auto is_shut = [&](const Vec3& p) {
        return grown.at(p).value_m < 0 && to_coarse(p) > deep_m;
    };
    const auto is_filled = [&](const Vec3& p) {
        return std::any_of(closed.begin(), closed.end(), [&](const Sphere& s) {
            return length(p - s.center) <= s.radius_m + bound_m;
        });
    };
    const std::vector<Vec3>& points = surface.positions;
    std::vector<std::uint8_t> shut(points.size());
    tbb::parallel_for(std::size_t{0}, shut.size(),
                      [&](std::size_t v) { shut[v] = is_shut(points[v]); });
    HeldSurface out;
    std::vector<std::uint32_t> renamed(shut.size());
    for (std::size_t v = 0; v < shut.size(); ++v) {
        renamed[v] = static_cast<std::uint32_t>(out.mesh.positions.size());
        if (!shut[v])
            out.mesh.positions.push_back(points[v]);
    }
    std::vector<Triangle> dropped;
    for (const Triangle& t : surface.triangles)
        if (!shut[t[0]] && !shut[t[1]] && !shut[t[2]])
            out.mesh.triangles.push_back({renamed[t[0]], renamed[t[1]], renamed[t[2]]});
        else
            dropped.push_back(t);
    std::vector<std::vector<Vec3>> ways(dropped.size()), open(dropped.size());
    tbb::parallel_for(std::size_t{0}, dropped.size(), [&](std::size_t f) {
        const Triangle& t = dropped[f];
        const Vec3 a = points[t[0]], b = points[t[1]], c = points[t[2]];
        const double edge_m = std::max({length(b - a), length(c - b), length(a - c)});
        const int n = static_cast<int>(std::clamp(std::ceil(2 * edge_m / bound_m), 1., kMostParts));
        for (int u = 0; u <= n; ++u)
            for (int v = 0; u + v <= n; ++v) {
                const Vec3 p = a + (b - a) * (double(u) / n) + (c - a) * (double(v) / n);
                if (!is_filled(p))
                    (is_shut(p) ? ways : open)[f].push_back(p);
            }
    });
    for (std::size_t f = 0; f < dropped.size(); ++f) {
        out.shut.insert(out.shut.end(), ways[f].begin(), ways[f].end());
        out.mesh.positions.insert(out.mesh.positions.end(), open[f].begin(), open[f].end());
    }
    return out;
}

} // namespace taihu
