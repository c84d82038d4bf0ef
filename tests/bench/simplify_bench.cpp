// Simplification under a bound, beside OpenMesh's quadric decimater on the same sharp surface and
// OpenVDB's adaptive mesher on the same grid. Errors are measured against the exact field, in
// voxels.
#include <string>
#include <vector>

#include <fmt/format.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <OpenMesh/Core/Utils/vector_cast.hh> // ModQuadricT.hh needs it and does not include it

#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

#ifdef TAIHU_HAS_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif

#include "mesh_out/bounded_simplify.h"
#include "mesh_out/certificate.h"
#include "mesh_out/face_error_detail.h"
#include "mesh_out/half_edges_detail.h"
#include "tests/bench/bars.h"
#include "tests/bench/ratio.h"
#include "tests/support/holed_ball.h"
#include "tests/support/surface_errors.h"

namespace {

using namespace taihu;

constexpr double kDim = 256, kPorosity = 0.3, kBound = 0.25;
constexpr double kDense = 0.5; ///< distance of the samples of a face

TriMesh plain(const LabelledMesh& mesh) {
    return {mesh.positions, mesh.triangles, {}};
}

struct Scene {
    HoledBall solid;
    LabelledMesh dense;
    SurfacePoints points;

    explicit Scene(std::size_t n_holes)
        : solid(HoledBall::random(kDim, n_holes, kPorosity, 1)), dense(sharp_surface(solid, 1)),
          points(surface_points(solid, plain(dense), 1, 300000)) {}
};

struct Row {
    SurfaceErrors errors;
    Certificate certificate;
};

Row print_row(const Scene& scene, const std::string& name, const TriMesh& mesh, double bound) {
    Row row{surface_errors(scene.solid, scene.points, mesh, kDense, bound), certify(mesh)};
    const auto& [e, c] = row;
    fmt::print(
        "{:<26} {:>8} | {:.3f} {:.3f} {:.4f} | {:.3f} {:.3f} | {:.3f} {:.3f} {:.3f} | {:4.1f} "
        "| {} {} {} {}\n",
        name, mesh.triangles.size(), e.mesh.most(), e.mesh.quantile(.999), e.mesh.rms(),
        e.face.most(), e.face.quantile(.999), e.rim.most(), e.rim.quantile(.999),
        e.rim.quantile(.99), e.turn_deg.quantile(.99), c.n_self_intersections,
        c.n_nonmanifold_edges, c.n_components, c.euler);
    std::fflush(stdout);
    return row;
}

std::size_t n_adaptive_triangles(const openvdb::FloatGrid& grid, double adaptivity) {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    std::vector<openvdb::Vec4I> quads;
    openvdb::tools::volumeToMesh(grid, points, triangles, quads, 0.0, adaptivity);
    return triangles.size() + 2 * quads.size();
}

TriMesh by_openmesh(const LabelledMesh& dense, std::size_t n, double& seconds) {
    const TriMesh mesh = plain(dense);
    HalfEdgeMesh half_edges = to_half_edges(mesh, "bench");
    const double start = processor_s();
    OpenMesh::Decimater::DecimaterT<HalfEdgeMesh> decimater(half_edges);
    OpenMesh::Decimater::ModQuadricT<HalfEdgeMesh>::Handle quadric;
    decimater.add(quadric);
    decimater.initialize();
    decimater.decimate_to_faces(0, n);
    seconds = processor_s() - start;
    return from_half_edges(half_edges, mesh);
}

#ifdef TAIHU_HAS_MESHOPTIMIZER
TriMesh by_meshoptimizer(const LabelledMesh& dense, std::size_t n, double& seconds) {
    TriMesh mesh = plain(dense);
    std::vector<float> positions;
    std::vector<unsigned> indices, left(3 * mesh.triangles.size());
    for (const Vec3& p : mesh.positions)
        for (int a = 0; a < 3; ++a)
            positions.push_back(static_cast<float>(p[a]));
    for (const Triangle& t : mesh.triangles)
        indices.insert(indices.end(), t.begin(), t.end());
    const double start = processor_s();
    left.resize(meshopt_simplify(left.data(), indices.data(), indices.size(), positions.data(),
                                 mesh.positions.size(), 3 * sizeof(float), 3 * n, 1e9f, 0,
                                 nullptr));
    seconds = processor_s() - start;
    mesh.triangles.clear();
    for (std::size_t i = 0; i < left.size(); i += 3)
        mesh.triangles.push_back({left[i], left[i + 1], left[i + 2]});
    return mesh;
}
#endif

/// Whether the surface is farther than `bound` from a point: the way that a sample was measured by
/// is one to the surface, and not always the shortest.
bool is_beyond(const FieldProbe& field, const Vec3& p, double bound) {
    constexpr int kSteps = 4; // on either side
    for (int i = -kSteps; i <= kSteps; ++i)
        for (int j = -kSteps; j <= kSteps; ++j)
            for (int k = -kSteps; k <= kSteps; ++k) {
                const Vec3 from = p + Vec3{double(i), double(j), double(k)} * (bound / kSteps);
                const auto y = surface_point_near(field, from, 8 * bound);
                if (y && length(*y - p) <= bound)
                    return false;
            }
    return true;
}

/// Samples over the bound that no place names.
std::size_t n_unnamed(const Scene& scene, const Row& row, const BoundedMesh& mesh) {
    std::size_t n = 0;
    for (const Vec3& p : row.errors.places) {
        bool named = false;
        for (const UnresolvedPlace& place : mesh.unresolved)
            named = named || length(p - place.center) <= place.radius_m + 1e-9;
        n += !named && is_beyond(scene.solid, p, 1.001 * mesh.bound_m);
    }
    return n;
}

} // namespace

int main(int argc, char** argv) {
    // All of it takes about two minutes; with `quick` the peers are left out.
    const bool peers = argc < 2 || std::string(argv[1]) != "quick";
    const bool more_holes = argc < 2;
    Bars bars;
    const Scene scene(1000);
    fmt::print("{:<26} {:>8} | to the surface: max p99.9 rms | faces: max p99.9 | rims: max p99.9 "
               "p99 | normals p99 | crossings, non-manifold edges, pieces, Euler number\n",
               "1000 holes, 256 voxels", "faces");
    print_row(scene, "sharp surface", plain(scene.dense), kBound);
    BoundedMesh ours;
    Row row;
    double ours_s = 0;
    for (const bool balance : {false, true})
        for (const double bound : {0.1, 0.5, kBound}) {
            const double start = processor_s();
            BoundedSimplifier simplifier(scene.dense, scene.solid,
                                         {.spacing_m = 1, .balance = balance});
            ours = simplifier.within(bound);
            ours_s = processor_s() - start;
            row =
                print_row(scene, fmt::format("{}, bound {}", balance ? "balanced" : "on it", bound),
                          plain(ours.mesh), 1.001 * bound);
            double radius = 0, error = 0;
            for (const UnresolvedPlace& p : ours.unresolved) {
                radius = std::max(radius, p.radius_m);
                error = std::max(error, p.error_m);
            }
            fmt::print(
                "    {:.2f} s, certified {:.4f}, {} places named (radius up to {:.2f}, error "
                "up to {:.3f}), {} of {} samples over the bound not named, {} crossings\n",
                ours_s, ours.error_m, ours.unresolved.size(), radius, error,
                n_unnamed(scene, row, ours), row.errors.places.size(), ours.n_crossings);
        }
    const std::size_t n = ours.mesh.triangles.size();
    fmt::print(
        "\nbound 0.25, balanced:\n  triangles {}\n  to the surface p99.9 {}\n  faces p99.9 {}\n"
        "  rims p99 {}\n  crossings {}\n  samples over the bound, not named {}\n",
        bars.at_most(double(n), 45000, 0), bars.at_most(row.errors.mesh.quantile(.999), .25),
        bars.at_most(row.errors.face.quantile(.999), .25),
        bars.at_most(row.errors.rim.quantile(.99), .2),
        bars.at_most(double(row.certificate.n_self_intersections), 0, 0),
        bars.at_most(double(n_unnamed(scene, row, ours)), 0, 0));
    {
        // Levels one from another, and from a surface that was sampled twice as coarsely.
        BoundedSimplifier levels(scene.dense, scene.solid, {.spacing_m = 1});
        fmt::print("levels of bounds 0.25, 0.5 and 1:");
        for (const double bound : {kBound, 0.5, 1.}) {
            const double start = processor_s();
            const BoundedMesh level = levels.within(bound);
            fmt::print(" {:.2f} s for {} triangles;", processor_s() - start,
                       level.mesh.triangles.size());
        }
        const LabelledMesh coarse = sharp_surface(scene.solid, 2);
        const double start = processor_s();
        BoundedSimplifier simplifier(coarse, scene.solid, {.spacing_m = 2});
        const BoundedMesh mesh = simplifier.within(kBound);
        const double seconds = processor_s() - start;
        fmt::print(" of {} triangles {} in {:.2f} s\n  s for 300000 triangles {}\n",
                   coarse.triangles.size(), mesh.mesh.triangles.size(), seconds,
                   bars.at_most(seconds * 300000 / double(coarse.triangles.size()), 0.5, 2));
    }
    if (peers) {
        double theirs_s = 0;
        const TriMesh theirs = by_openmesh(scene.dense, n, theirs_s);
        const Row their_row = print_row(scene, "OpenMesh ModQuadric", theirs, kBound);
        fmt::print(
            "\nbeside OpenMesh to the same count: {:.2f} s and {:.2f} s\n  faster {}\n"
            "  p99.9 of ours over its {}\n",
            ours_s, theirs_s, bars.at_least(theirs_s / ours_s, 15, 1),
            bars.at_most(row.errors.mesh.quantile(.999) / their_row.errors.mesh.quantile(.999), 1));
    }
#ifdef TAIHU_HAS_MESHOPTIMIZER
    if (peers) {
        double theirs_s = 0;
        const TriMesh theirs = by_meshoptimizer(scene.dense, n, theirs_s);
        const Certificate before = certify(plain(scene.dense), {.self_intersections = false});
        const Row their_row = print_row(scene, "meshoptimizer", theirs, kBound);
        fmt::print(
            "\nbeside meshoptimizer to the same count: {:.2f} s and {:.2f} s\n  pieces that "
            "we lost {}, it {}\n  non-manifold edges of ours {}, of it {}\n",
            ours_s, theirs_s,
            bars.at_most(double(before.n_components) - double(row.certificate.n_components), 0, 0),
            before.n_components - their_row.certificate.n_components,
            bars.at_most(double(row.certificate.n_nonmanifold_edges), 0, 0),
            their_row.certificate.n_nonmanifold_edges);
    }
#endif
    if (more_holes) {
        const Scene many(10000);
        const std::size_t theirs = n_adaptive_triangles(*level_set_of(many.solid, 1), 0.1);
        const double start = processor_s();
        BoundedSimplifier simplifier(many.dense, many.solid, {.spacing_m = 1});
        const BoundedMesh mesh = simplifier.within(kBound);
        const double seconds = processor_s() - start;
        const Row many_row =
            print_row(many, "10000 holes, balanced 0.25", plain(mesh.mesh), 1.001 * kBound);
        fmt::print("10000 holes: {:.2f} s for {} triangles, {} places named, samples not named {}; "
                   "triangles of volumeToMesh 0.1: {}, ours over these {}\n",
                   seconds, many.dense.triangles.size(), mesh.unresolved.size(),
                   bars.at_most(double(n_unnamed(many, many_row, mesh)), 0, 0), theirs,
                   bars.at_most(double(mesh.mesh.triangles.size()) / double(theirs), 0.4));
    }
    bars.print_sum();
}
