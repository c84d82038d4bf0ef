#include "vdb_ops/winding_survey_detail.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <tbb/parallel_for.h>

#include "stats/core/box.h"
#include "vdb_ops/winding_tree_detail.h"

namespace taihu {
namespace {

/// Faces together: their area, and their winding numbers weighted by it.
struct Side {
    double area = 0, winding = 0;
    void add(double a, double w) {
        area += a;
        winding += a * w;
    }
};

/// WindingSurvey::parting.
double parting_share(const WindingTree& tree, const RepairedMesh& mesh) {
    constexpr std::size_t kMost = 4096;
    constexpr double kLarge = 1.0 / 16; // share of the area: a shell that has a side of its own
    const std::size_t n = std::min(mesh.n_given, kMost);
    if (n == 0)
        return 0;
    const auto shell = [&](std::size_t i) { return mesh.shell_of[i * mesh.n_given / n]; };
    std::vector<double> area(n), winding(n);
    tbb::parallel_for(std::size_t{0}, n, [&](std::size_t i) {
        const Triangle& t = mesh.triangles[i * mesh.n_given / n];
        const Vec3 &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
        area[i] = length(cross(b - a, c - a));
        winding[i] = tree.at((a + b + c) / 3);
    });
    std::vector<Side> shells(1 + *std::max_element(mesh.shell_of.begin(), mesh.shell_of.end()));
    Side all;
    for (std::size_t i = 0; i < n; ++i) {
        shells[shell(i)].add(area[i], winding[i]);
        all.add(area[i], winding[i]);
    }
    double parting = 0;
    for (std::size_t i = 0; i < n; ++i) {
        const Side& own = shells[shell(i)];
        const bool inwards = (own.area > kLarge * all.area ? own : all).winding < 0;
        const double w = inwards ? -winding[i] : winding[i];
        if (w > 0 && std::fabs(w - std::floor(w) - 0.5) < 0.3)
            parting += area[i];
    }
    return all.area > 0 ? parting / all.area : 0;
}

} // namespace

WindingSurvey survey_winding(const RepairedMesh& mesh) {
    constexpr std::size_t kPlaces = 27; // along each axis: 19,683
    const std::vector<Triangle> faces = mesh.given();
    const Box box = bounds({mesh.positions, faces, {}});
    const WindingTree tree(mesh.positions, faces);
    std::array<WindingSurvey, kPlaces> layers;
    tbb::parallel_for(std::size_t{0}, kPlaces, [&](std::size_t i) {
        const Vec3 step = box.size() / double(kPlaces);
        for (std::size_t j = 0; j < kPlaces; ++j)
            for (std::size_t k = 0; k < kPlaces; ++k) {
                const double w =
                    tree.at(box.lo + Vec3{step.x * (double(i) + 0.5), step.y * (double(j) + 0.5),
                                          step.z * (double(k) + 0.5)});
                layers[i].n_inside += std::fabs(w) > 0.5;
                layers[i].n_undecided += std::fabs(w - std::round(w)) > 0.25;
                layers[i].mean += w;
            }
    });
    WindingSurvey all;
    for (const WindingSurvey& layer : layers) {
        all.n_inside += layer.n_inside;
        all.n_undecided += layer.n_undecided;
        all.mean += layer.mean / double(kPlaces * kPlaces * kPlaces);
    }
    all.parting = parting_share(tree, mesh);
    return all;
}

} // namespace taihu
