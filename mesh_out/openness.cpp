#include "mesh_out/openness.h"

#include <cmath>
#include <numbers>
#include <string>

#include <tbb/parallel_for.h>

#include "mesh_out/io/mesh_formats_detail.h"
#include "mesh_out/ray_scene_detail.h"
#include "stats/core/error.h"

namespace taihu {
namespace {

// Where rays begin above the surface, as a share of its longest side (the scene is scaled to 1):
// what floats of that size still tell apart, and less than any voxel.
constexpr double kLift = 2e-5;

/// Directions about +Z with a density of their cosine, evenly along a spiral.
std::vector<Vec3> sky(int n) {
    std::vector<Vec3> out;
    for (int i = 0; i < n; ++i) {
        const double r2 = (i + 0.5) / n, angle = 2 * std::numbers::pi * i / std::numbers::phi;
        out.push_back(
            {std::sqrt(r2) * std::cos(angle), std::sqrt(r2) * std::sin(angle), std::sqrt(1 - r2)});
    }
    return out;
}

void require(const TriMesh& mesh, const OpennessSettings& settings) {
    const auto refuse = [](const std::string& what) {
        throw Error(Fault::bad_argument, "openness: " + what);
    };
    check_writable(mesh, "openness");
    if (mesh.normals.empty())
        refuse("the mesh has no normals; give one for each position");
    if (settings.n_rays < 1 || settings.n_rays > 4096)
        refuse("n_rays is " + std::to_string(settings.n_rays) + ", must be 1..4096");
    if (!(settings.reach_m >= 0) || !std::isfinite(settings.reach_m))
        refuse("reach_m is " + std::to_string(settings.reach_m) + ", must be finite and >= 0");
}

} // namespace

std::vector<float> openness(const TriMesh& mesh, const OpennessSettings& settings,
                            Progress* progress) {
    require(mesh, settings);
    const Box box = bounds(mesh);
    const double longest = box.longest();
    if (!(longest > 0))
        throw Error(Fault::bad_argument, "openness: the mesh has no extent; give another");
    const ScenePlacement place{.center = (box.lo + box.hi) / 2, .scale = 1 / longest};
    const RayScene scene(mesh, place);
    const double reach = settings.reach_m > 0 ? settings.reach_m / longest : 0.5;
    const std::vector<Vec3> pattern = sky(settings.n_rays);
    std::vector<float> out(mesh.positions.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, out.size(), 256), [&](const auto& range) {
        check_cancelled(progress);
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            const Vec3& n = mesh.normals[i];
            // The frame of Duff et al. is continuous but at one point.
            const double s = std::copysign(1.0, n.z), a = -1 / (s + n.z), b = n.x * n.y * a;
            const Vec3 u{1 + s * n.x * n.x * a, s * b, -s * n.x};
            const Vec3 v{b, s + n.y * n.y * a, -n.y};
            const Vec3 from = place(mesh.positions[i]) + n * kLift;
            int n_free = 0;
            for (const Vec3& d : pattern)
                n_free += !scene.blocked(from, u * d.x + v * d.y + n * d.z, reach);
            out[i] = static_cast<float>(n_free) / static_cast<float>(pattern.size());
        }
    });
    return out;
}

} // namespace taihu
