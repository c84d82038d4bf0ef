#include "tests/bench/fractal_rows.h"

#include <algorithm>
#include <cmath>

#include <malloc.h>

#include "mesh_out/texture_coordinates.h"
#include "stats/core/image.h"
#include "tests/bench/ratio.h"
#include "vdb_ops/fractal_rock.h"

namespace taihu {
namespace {

volatile double sink = 0; // so that no work is left out

template <class Work>
double least_ms(int runs, Work&& work) {
    double least = 1e300;
    for (int run = 0; run < runs; ++run) {
        int n = 0;
        const double begin = processor_s();
        double took = 0;
        do {
            sink = sink + work();
            ++n;
            took = processor_s() - begin;
        } while (took < 0.005);
        least = std::min(least, 1e3 * took / n);
    }
    return least;
}

/// The normals of a model, each where its vertex lies in the texture.
double write_normal_map(const TriMesh& model) {
    constexpr int kSide = 256;
    Image map(kSide, kSide, 3);
    const std::vector<Vec3> normals = averaged_normals(model);
    const auto at = texture_coordinates(model, TextureMap::spherical, bounds(model));
    for (std::size_t i = 0; i < model.triangles.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            const TexturePoint& t = at.corners[i][k];
            const int x = static_cast<int>((t.u - std::floor(t.u)) * kSide),
                      y = std::min(static_cast<int>((1 - t.v) * kSide), kSide - 1);
            const Vec3& n = normals[model.triangles[i][k]];
            for (int axis = 0; axis < 3; ++axis)
                map.at(x, y)[axis] = static_cast<float>(n[axis]);
        }
    return map.pixels[0];
}

} // namespace

std::array<FractalRow, 9> time_fractal_rows(int runs) {
    // Memory once got is kept, or its pages being handed out again would be most of the time.
    mallopt(M_MMAP_THRESHOLD, 1 << 28);
    mallopt(M_TRIM_THRESHOLD, 1 << 28);
    std::array<FractalRow, 9> rows{{{"Midpoint", 20, 64.25, 0.9338},
                                    {"Midpoint", 320, 391.25, 2.4536},
                                    {"Midpoint", 5120, 4477.75, 3.4302},
                                    {"Subdivision", 20, 41, 1.4634},
                                    {"Subdivision", 320, 146.25, 6.5641},
                                    {"Subdivision", 5120, 632.25, 24.2941},
                                    {"Dyn.Bump.", 20, 209, 0.287},
                                    {"Dyn.Bump.", 320, 581, 1.6523},
                                    {"Dyn.Bump.", 5120, 4589, 3.3471}}};
    const FractalSettings settings{.base = 0};
    TriMesh model = fractal_base(settings, 1);
    const FractalRefiner refiner(model, settings, 1);
    for (std::size_t i = 0; i < 3; ++i) {
        const MidpointMesh displaced = refiner.displace(model);
        rows[i].ms =
            least_ms(runs, [&] { return refiner.displace(model).mesh.positions.back().x; });
        rows[i + 3].ms = least_ms(runs, [&] { return refiner.damp(displaced).positions.back().x; });
        rows[i + 6].ms = least_ms(runs, [&] { return write_normal_map(model); });
        model = refiner.damp(displaced);
    }
    return rows;
}

bool same_order(const std::array<FractalRow, 9>& rows) {
    bool same = true;
    for (std::size_t i = 0; i < 3; ++i)
        same = same && rows[i + 3].ms < rows[i].ms; // damping below displacement
    for (std::size_t i = 0; i < 9; i += 3)
        same = same && rows[i].ms < rows[i + 1].ms && rows[i + 1].ms < rows[i + 2].ms;
    return same && rows[5].per_ms() / rows[3].per_ms() > rows[2].per_ms() / rows[0].per_ms();
}

} // namespace taihu
