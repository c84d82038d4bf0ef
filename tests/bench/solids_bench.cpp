// Mesh to level set and carving, beside OpenVDB's own route. Processor seconds, medians of five.
#include "stats/sampler.h"
#include "tests/bench/peers.h"
#include "tests/bench/ratio.h"
#include "vdb_ops/carve.h"
#include "vdb_ops/shapes.h"
#include "vdb_ops/voxelize.h"

#include <cmath>

using namespace taihu;

int main() {
    openvdb::initialize();
    constexpr int kRuns = 5;
    const TriMesh mesh = shape_mesh({}); // 20,480 triangles, longest axis 1
    fmt::print("{:<34} {:>9} {:>9} {:>8}\n", "processor seconds", "taihu", "OpenVDB", "ratio");
    for (const int dim : {256, 512}) {
        const double voxel = 1.0 / dim;
        openvdb::FloatGrid::Ptr base;
        compare(
            fmt::format("mesh to level set, {}", dim), 10, kRuns,
            [&] { base = voxelize(mesh, "boulder", {.voxel_m = voxel}).solid; },
            [&] { peer_voxelize(mesh, voxel); });
        for (const int n : {1000, 10'000, 100'000}) {
            // Boolean model of porosity 0.3 in the box: -ln(0.7) = n / V * pi * mean^3.
            const Box box = bounds(mesh);
            const double mean = std::cbrt(-std::log(0.7) * box.volume() / (M_PI * n));
            const HoleStream stream(Law::exponential(1), box, mean, 1);
            std::vector<Sphere> holes;
            for (int i = 0; i < n; ++i)
                holes.push_back(stream.hole(static_cast<std::uint64_t>(i)));
            compare(
                fmt::format("carve {} holes, {}", n, dim), 8, kRuns, [&] { carve(*base, holes); },
                [&] { peer_carve(*base, holes); });
        }
    }
}
