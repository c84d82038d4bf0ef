// Surfaces straight from a field beside OpenVDB's mesher: processor seconds, and errors in voxels
// against the exact field. `surfaces [voxels across] [holes]`, 256 and 1000 unless said otherwise.
#include <cstdlib>
#include <string>

#include <openvdb/tools/VolumeToMesh.h>

#include "mesh_out/certificate.h"
#include "mesh_out/extract.h"
#include "tests/bench/bars.h"
#include "tests/bench/noisy_ball.h"
#include "tests/bench/ratio.h"
#include "tests/support/surface_error.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/rasterize.h"

using namespace taihu;

namespace {

TriMesh openvdb_mesh(const openvdb::FloatGrid& grid, double adaptivity) {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    std::vector<openvdb::Vec4I> quads;
    openvdb::tools::volumeToMesh(grid, points, triangles, quads, 0, adaptivity);
    TriMesh mesh;
    for (const auto& p : points)
        mesh.positions.push_back({p.x(), p.y(), p.z()});
    for (const auto& t : triangles)
        mesh.triangles.push_back({t[2], t[1], t[0]});
    for (const auto& q : quads) {
        mesh.triangles.push_back({q[2], q[1], q[0]});
        mesh.triangles.push_back({q[3], q[2], q[0]});
    }
    return mesh;
}

struct Scene {
    DifferenceField field;
    Lattice lattice{1, {}, 3};
    openvdb::FloatGrid::Ptr grid;
    std::unique_ptr<FieldProbe> probe;
    ReferencePoints points;

    Scene(double size, std::uint64_t n)
        : field(std::make_shared<NoisyBall>(size),
                std::make_shared<BallsField>(exponential_holes(size, n, 0.3, 1))),
          grid(rasterize(field, lattice)) {
        const double h = 0.62 * size;
        probe = field.probe({{-h, -h, -h}, {h, h, h}}, 6);
        const TriMesh start = openvdb_mesh(*grid, 0);
        std::vector<Vec3> seeds;
        const std::size_t step = std::max<std::size_t>(1, start.positions.size() / 200'000);
        for (std::size_t i = 0; i < start.positions.size(); i += step)
            seeds.push_back(start.positions[i]);
        points = reference_points(*probe, seeds);
        fmt::print("{} points of faces, {} of rims, {} where it is thin\n\n", points.faces.size(),
                   points.rims.size(), points.thin.size());
    }
};

Errors to_mesh(const std::vector<Vec3>& points, const SurfaceDistance& mesh) {
    Errors errors;
    errors.all.resize(points.size());
    tbb::parallel_for(std::size_t{0}, points.size(),
                      [&](std::size_t i) { errors.all[i] = static_cast<float>(mesh(points[i])); });
    return errors;
}

void print_head() {
    fmt::print("{:<24}{:>10}{:>8} | {:^24} | {:^16} | {:^16} | {:>5} | {:>11} | {}\n", "", "",
               "cpu", "mesh to surface", "faces to mesh", "rims to mesh", "thin", "normals deg",
               "crossings");
    fmt::print(
        "{:<24}{:>10}{:>8} | {:>8}{:>8}{:>8} | {:>8}{:>8} | {:>8}{:>8} | {:>5} | {:>5}{:>6} |\n",
        "", "triangles", "s", "max", "p99.9", "rms", "max", "p99.9", "p99.9", "p99", "p99", "p50",
        "p99");
}

struct Row {
    double cpu_s, mesh_p999, faces_p999, rims_p99;
    std::size_t n_crossings;
};

Row print_row(const std::string& name, const Scene& scene, const TriMesh& mesh, double cpu_s) {
    const MeshErrors there = mesh_errors(*scene.probe, mesh);
    const SurfaceDistance distance(mesh);
    const Errors faces = to_mesh(scene.points.faces, distance),
                 rims = to_mesh(scene.points.rims, distance),
                 thin = to_mesh(scene.points.thin, distance);
    const Certificate c = certify(mesh);
    fmt::print("{:<24}{:>10}{:>8.3f} | {:>8.3f}{:>8.3f}{:>8.4f} | {:>8.3f}{:>8.3f} | "
               "{:>8.3f}{:>8.3f} | {:>5.2f} | {:>5.2f}{:>6.1f} | {}{}\n",
               name, mesh.triangles.size(), cpu_s, there.distance.max(),
               there.distance.at_share(0.999), there.distance.rms(), faces.max(),
               faces.at_share(0.999), rims.at_share(0.999), rims.at_share(0.99),
               thin.at_share(0.99), there.angle_deg.at_share(0.5), there.angle_deg.at_share(0.99),
               c.n_self_intersections, c.holds() ? "" : " does not hold");
    return {cpu_s, there.distance.at_share(0.999), faces.at_share(0.999), rims.at_share(0.99),
            c.n_self_intersections};
}

template <class Fn>
double cpu_of(Fn&& fn) {
    std::vector<double> times;
    for (int i = 0; i < 3; ++i) {
        const double from = processor_s();
        fn();
        times.push_back(processor_s() - from);
    }
    return median(times);
}

} // namespace

int main(int argc, char** argv) {
    openvdb::initialize();
    const double size = argc > 1 ? std::atof(argv[1]) : 256;
    const auto n = static_cast<std::uint64_t>(argc > 2 ? std::atoll(argv[2]) : 1000);
    const Scene scene(size, n);
    const double grid_s = cpu_of([&] { rasterize(scene.field, scene.lattice); });
    fmt::print("grid: {:.3f} s\n", grid_s);
    print_head();
    std::vector<Row> peers, ours;
    for (const double adaptivity : {0.0, 0.1}) {
        TriMesh mesh;
        const double s = cpu_of([&] { mesh = openvdb_mesh(*scene.grid, adaptivity); });
        peers.push_back(print_row(fmt::format("volumeToMesh {}", adaptivity), scene, mesh, s));
    }
    for (const ExtractSettings& settings : {ExtractSettings{0.1, 1}, ExtractSettings{0.1, 2},
                                            ExtractSettings{0.1, 4}, ExtractSettings{0.25, 4}}) {
        LabelledMesh mesh;
        const double s = cpu_of([&] { mesh = extract(*scene.grid, &scene.field, settings); });
        ours.push_back(print_row(
            fmt::format("cells of 1..{}, bound {}", settings.most_spacing, settings.bound_vox),
            scene, {mesh.positions, mesh.triangles, {}}, s));
    }
    Bars bars;
    fmt::print("\nfull extraction\n  mesh to surface, p99.9: {}\n  faces to mesh, p99.9: {}\n"
               "  rims to mesh, p99: {}\n",
               bars.at_most(ours[0].mesh_p999, 0.1), bars.at_most(ours[0].faces_p999, 0.1),
               bars.at_most(ours[0].rims_p99, 0.2));
    std::size_t n_crossings = 0;
    for (const Row& row : ours)
        n_crossings += row.n_crossings;
    fmt::print("all extractions\n  pairs of triangles that cross: {}\n",
               bars.at_most(static_cast<double>(n_crossings), 0, 0));
    fmt::print("cells of 1..4, bound 0.25, with the grid\n  processor time over that of the grid "
               "and volumeToMesh 0.1: {}\n",
               bars.at_most((grid_s + ours[3].cpu_s) / (grid_s + peers[1].cpu_s), 1));
    bars.print_sum();
    return 0;
}
