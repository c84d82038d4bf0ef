#include "vdb_ops/tradition.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/distance_map_detail.h"
#include "vdb_ops/passages_detail.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/thickness_detail.h"
#include "vdb_ops/views_detail.h"
#include "vdb_ops/volume.h"
#include "vdb_ops/wrinkles_detail.h"

namespace taihu {
namespace {

constexpr double kLeastWindow = 0.01; // diameter / size
constexpr double kFlat = 0.1;         // curvature * size

/// Horizontal sections of the solid, by row of samples, and its box.
struct Layers {
    std::vector<double> area_m2;
    Box box; ///< [m], to where lines between samples cross the surface

    double volume_m3(double voxel_m) const {
        double sum = 0;
        for (const double area : area_m2)
            sum += area * voxel_m;
        return sum;
    }
};

Layers layers_of(const DenseLattice& lattice, std::span<const float> distances) {
    Layers layers;
    layers.area_m2.assign(static_cast<std::size_t>(lattice.n[1]), 0);
    const double pixel_m2 = lattice.voxel_m * lattice.voxel_m;
    for (int x = 1; x + 1 < lattice.n[0]; ++x)
        for (int y = 1; y + 1 < lattice.n[1]; ++y)
            for (int z = 1; z + 1 < lattice.n[2]; ++z) {
                const std::size_t i = lattice.at(x, y, z);
                const auto d = static_cast<double>(distances[i]);
                layers.area_m2[static_cast<std::size_t>(y)] +=
                    std::clamp(0.5 - d, 0.0, 1.0) * pixel_m2;
                if (d >= 0)
                    continue;
                for (int a = 0; a < 3; ++a)
                    for (const int side : {-1, 1}) {
                        const auto beside =
                            static_cast<double>(side < 0 ? distances[i - lattice.stride(a)]
                                                         : distances[i + lattice.stride(a)]);
                        if (beside < 0)
                            continue;
                        Vec3 p = lattice.place(x, y, z);
                        p[a] += side * lattice.voxel_m * d / (d - beside);
                        layers.box.include(p);
                    }
            }
    return layers;
}

void measure_body(const DenseLattice& lattice, std::span<const float> distances, double hull_m3,
                  TraditionMeasures& m) {
    const Layers layers = layers_of(lattice, distances);
    m.volume_m3 = layers.volume_m3(lattice.voxel_m);
    m.size_m = std::cbrt(6 / std::numbers::pi * m.volume_m3);
    m.height_m = layers.box.size().y;
    m.body_in_hull = m.volume_m3 / hull_m3;
    m.body_in_box = m.volume_m3 / layers.box.volume();
    m.slenderness = m.height_m / std::sqrt(m.volume_m3 / m.height_m);
    std::vector<double> middle;
    for (int y = 0; y < lattice.n[1]; ++y) {
        const double share = (lattice.place(0, y, 0).y - layers.box.lo.y) / m.height_m;
        if (share >= 0.2 && share <= 0.8)
            middle.push_back(layers.area_m2[static_cast<std::size_t>(y)]);
    }
    std::sort(middle.begin(), middle.end());
    if (!middle.empty() && middle[middle.size() / 2] > 0)
        m.waist = middle.front() / middle[middle.size() / 2];
}

void measure_passages(const DenseLattice& lattice, std::span<const float> distances, double size_m,
                      TraditionMeasures& m, Progress* progress) {
    report_stage(progress, "passages");
    const double outline_radius = 0.5 * kOutlineBallShare * size_m / lattice.voxel_m;
    const Passages passages(lattice, distances, static_cast<float>(outline_radius), progress);
    for (std::size_t k = 0; k < kBallShares.size(); ++k) {
        const double radius = 0.5 * kBallShares[k] * size_m / lattice.voxel_m;
        const Passages::Opened opened = passages.opened(static_cast<float>(radius), progress);
        m.ways[k] = static_cast<double>(opened.n_ways);
        m.open_porosity[k] = opened.open_share;
        report_fraction(progress, static_cast<double>(k + 1) / (kBallShares.size() + 1));
    }
    const Passages::Sealed sealed = passages.sealed();
    m.sealed_voids = static_cast<double>(sealed.n);
    m.sealed_porosity = sealed.share;
    m.channel_m = passages.channel(progress) * lattice.voxel_m;
}

/// \param size_m  the lengths that measures refer to; the same at both resolutions
TraditionMeasures measure_on(const openvdb::FloatGrid& solid, const DenseLattice& lattice,
                             double hull_m3, double size_m, Progress* progress) {
    report_stage(progress, "sampling");
    const Lattice own = lattice_of(solid);
    const auto band = static_cast<float>(0.99 * own.half_width_vox * own.voxel_m / lattice.voxel_m);
    const std::vector<float> distances =
        signed_distances(lattice, dense_values(solid, lattice, progress), band, progress);
    TraditionMeasures m;
    measure_body(lattice, distances, hull_m3, m);
    if (!(m.volume_m3 > 0 && m.height_m > 0))
        throw Error(Fault::bad_input, "tradition: the solid is thinner than two voxels "
                                      "everywhere; use smaller ones");

    report_stage(progress, "views");
    const ViewMeasures views =
        measure_views(lattice, distances, kViews, kLeastWindow * size_m, progress);
    m.see_through = views.open_share;
    m.views_with_window = views.share_with_window;
    m.windows_per_view = views.windows_per_view;
    m.widest_window_m = views.widest_m;

    measure_passages(lattice, distances, size_m, m, progress);

    report_stage(progress, "walls");
    double n = 0, sum = 0;
    for (const auto& [diameter, count] : local_thickness(lattice, distances, progress)) {
        n += static_cast<double>(count);
        sum += static_cast<double>(count) * static_cast<double>(diameter);
    }
    m.wall = sum / n * lattice.voxel_m / size_m;

    report_stage(progress, "wrinkles");
    const double size = size_m / lattice.voxel_m;
    const WrinkleMeasures wrinkles =
        measure_wrinkles(lattice, distances, kSmoothingShare * size, kFlat / size, progress);
    m.area_ratio = wrinkles.area_ratio;
    m.roughness = wrinkles.rms_samples / size;
    m.curvature = wrinkles.mean_curvature * size;
    m.concave_share = wrinkles.concave_share;
    return m;
}

} // namespace

bool agree(double fine, double coarse) {
    return std::abs(fine - coarse) <= 0.05 * std::max(std::abs(fine), std::abs(coarse));
}

Tradition measure_tradition(const openvdb::FloatGrid& solid, double hull_m3, Progress* progress) {
    if (!(hull_m3 > 0 && std::isfinite(hull_m3)))
        throw Error(Fault::bad_argument,
                    "tradition: hull_m3 is " + shortest(hull_m3) + "; must be finite and > 0");
    const openvdb::CoordBBox box = inside_voxels(solid, "tradition");
    const double size_m = std::cbrt(6 / std::numbers::pi * volume_m3(solid));
    // Air for the kernel of the smoothing and for the ball that rolls round the solid.
    const double margin =
        std::max(3 * kSmoothingShare, 0.5 * kOutlineBallShare) * size_m / lattice_of(solid).voxel_m;
    Tradition result;
    const DenseLattice fine = dense_lattice(solid, box, margin, 1, "tradition");
    const DenseLattice coarse = dense_lattice(solid, box, margin, 2 * fine.coarser, "tradition");
    result.voxel_m = fine.voxel_m;
    result.coarser = fine.coarser;
    result.fine = measure_on(solid, fine, hull_m3, size_m, progress);
    result.coarse = measure_on(solid, coarse, hull_m3, size_m, progress);
    return result;
}

} // namespace taihu
