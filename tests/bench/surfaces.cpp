// What surfaces are held to, in one table: triangles, errors against the exact field both ways
// [voxels], crossings, and processor time beside OpenVDB's mesher, OpenMesh and meshoptimizer.
// Without arguments all sections, otherwise those named: full adaptive many simplify chain.
// All of it takes some three minutes.
#include <algorithm>
#include <chrono>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "mesh_out/bounded_simplify.h"
#include "mesh_out/certificate.h"
#include "mesh_out/extract.h"
#include "mesh_out/face_error_detail.h"
#include "mesh_out/lod.h"
#include "tests/bench/bars.h"
#include "tests/bench/mesh_peers.h"
#include "tests/bench/noisy_ball.h"
#include "tests/bench/ratio.h"
#include "tests/support/surface_errors.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/level_set_box.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/solids_field.h"

namespace taihu {
namespace {

constexpr double kSize = 256, kPorosity = 0.3, kBound = 0.25;
constexpr double kReach = 16; ///< of the probe that errors are measured by
const ExtractSettings kFull{0.1, 1}, kAdaptive{0.5, 4}; // the second as levels do
const Lattice kLattice{1, {}, 3};

TriMesh plain(const LabelledMesh& mesh) {
    return {mesh.positions, mesh.triangles, {}};
}

using SharedField = std::shared_ptr<const Field>;

SharedField balls(std::vector<Sphere> all) {
    return std::make_shared<BallsField>(std::move(all));
}
SharedField holed_ball(std::uint64_t n) {
    return std::make_shared<DifferenceField>(std::make_shared<NoisyBall>(kSize),
                                             balls(exponential_holes(kSize, n, kPorosity, 1)));
}

/// A solid, its level set, and points of its exact surface.
struct Scene {
    SharedField field;
    openvdb::FloatGrid::Ptr grid;
    std::unique_ptr<const FieldProbe> probe;
    SurfacePoints points;

    explicit Scene(SharedField of) : field(std::move(of)), grid(rasterize(*field, kLattice)) {
        probe = field->probe(level_set_box(*grid).dilated(kReach), kReach);
        points = surface_points(*probe, plain(extract(*grid, field.get(), kFull)), 1, 300'000);
    }
    BoundedMesh simplified(const LabelledMesh& mesh) const {
        const double reach = 8 * (1 + kBound);
        const auto around = field->probe(level_set_box(*grid).dilated(reach), reach);
        return BoundedSimplifier(mesh, *around, {.spacing_m = 1}).within(kBound);
    }
};

void print_head() {
    fmt::print("\n{:<30} {:>8} {:>7} | mesh to surface, max p99.9 rms | faces to mesh, max p99.9 | "
               "rims to mesh, max p99 | thin p99 | normals p99 [degrees] | crossings, non-manifold "
               "edges, pieces\n",
               "", "faces", "cpu [s]");
}

struct Row {
    SurfaceErrors errors;
    Certificate certificate;
};

Row print_row(const Scene& scene, const std::string& name, const TriMesh& mesh, double cpu_s) {
    constexpr double kStep = 0.5;
    Row row{surface_errors(*scene.probe, scene.points, mesh, kStep, 1.001 * kBound), certify(mesh)};
    const auto& [e, c] = row;
    fmt::print("{:<30} {:>8} {:>7.2f} | {:.3f} {:.3f} {:.4f} | {:.3f} {:.3f} | {:.3f} {:.3f} | "
               "{:.2f} | {:4.1f} | {} {} {}\n",
               name, mesh.triangles.size(), cpu_s, e.mesh.most(), e.mesh.quantile(.999),
               e.mesh.rms(), e.face.most(), e.face.quantile(.999), e.rim.most(),
               e.rim.quantile(.99), e.thin.quantile(.99), e.turn_deg.quantile(.99),
               c.n_self_intersections, c.n_nonmanifold_edges, c.n_components);
    std::fflush(stdout);
    return row;
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
    return static_cast<std::size_t>(
        std::count_if(row.errors.places.begin(), row.errors.places.end(), [&](const Vec3& p) {
            const bool named =
                std::any_of(mesh.unresolved.begin(), mesh.unresolved.end(), [&](const auto& u) {
                    return length(p - u.center) <= u.radius_m + 1e-9;
                });
            return !named && is_beyond(*scene.probe, p, 1.001 * mesh.bound_m);
        }));
}

/// What was found, kept for the table at the end.
class Table {
public:
    void section(const std::string& name) { lines_.push_back(name); }
    void at_most(const std::string& what, double figure, double bar, int digits = 3) {
        add(what, bars_.at_most(figure, bar, digits));
    }
    void at_least(const std::string& what, double figure, double bar, int digits = 3) {
        add(what, bars_.at_least(figure, bar, digits));
    }
    void skipped(const std::string& what, const std::string& why) { add(what, "skipped: " + why); }
    void print() const {
        fmt::print("\n");
        for (const std::string& line : lines_)
            fmt::print("{}\n", line);
        bars_.print_sum();
    }

private:
    void add(const std::string& what, const std::string& figure) {
        lines_.push_back(fmt::format("  {:<68} {}", what, figure));
    }

    Bars bars_;
    std::vector<std::string> lines_;
};

void full(Table& table) {
    const SharedField ball = balls({{{}, 40}});
    const std::pair<const char*, SharedField> solids[] = {
        {"sphere minus sphere", std::make_shared<DifferenceField>(ball, balls({{{36, 8, 4}, 24}}))},
        {"cube minus sphere",
         std::make_shared<DifferenceField>(
             std::make_shared<SolidsField>(std::vector<AnalyticSolid>{
                 {BoxSolid{{32, 32, 32}}, Similarity::rotation({1, 2, 0.5}, 0.5)}}),
             balls({{{32, 12, 4}, 22}}))},
        {"two crossing holes",
         std::make_shared<DifferenceField>(ball, balls({{{28, 4, 0}, 20}, {{20, 24, 4}, 18}}))}};
    for (const auto& [name, field] : solids) {
        const Scene scene(field);
        const Row row = print_row(scene, name, plain(extract(*scene.grid, field.get(), kFull)), 0);
        const SurfaceErrors& e = row.errors;
        table.section(fmt::format("{}, full extraction", name));
        table.at_most("mesh to surface, max", e.mesh.most(), 0.1);
        table.at_most("faces, rims and corners to mesh, max",
                      std::max({e.face.most(), e.rim.most(), e.corner.most()}), 0.1);
        table.at_most("normals of triangles, p99 [degrees]", e.turn_deg.quantile(.99), 4);
        table.at_most("crossings", double(row.certificate.n_self_intersections), 0, 0);
    }
}

void adaptive(Table& table) {
    const Scene scene(holed_ball(1000));
    print_row(scene, "full extraction", plain(extract(*scene.grid, scene.field.get(), kFull)), 0);
    const double grid_s = cpu_of([&] { rasterize(*scene.field, kLattice); });
    TriMesh theirs;
    const double theirs_s = cpu_of([&] { theirs = peer_mesh(*scene.grid, 0.1); });
    print_row(scene, "volumeToMesh 0.1", theirs, theirs_s);
    LabelledMesh sharp;
    const double extract_s =
        cpu_of([&] { sharp = extract(*scene.grid, scene.field.get(), kAdaptive); });
    print_row(scene, "cells of 1, 2 and 4", plain(sharp), extract_s);
    BoundedMesh ours;
    const double simplify_s = cpu_of([&] { ours = scene.simplified(sharp); });
    const Row row = print_row(scene, "simplified, bound 0.25", plain(ours.mesh), simplify_s);
    const double unnamed = double(n_unnamed(scene, row, ours));
    fmt::print("grid: {:.2f} s; {} places named\n", grid_s, ours.unresolved.size());
    table.section("256 voxels, 1000 holes, bound 0.25");
    table.at_most("triangles", double(ours.mesh.triangles.size()), 55'000, 0);
    table.at_most("triangles, stretch", double(ours.mesh.triangles.size()), 45'000, 0);
    table.at_most("mesh to surface, p99.9", row.errors.mesh.quantile(.999), .25);
    table.at_most("faces to mesh, p99.9", row.errors.face.quantile(.999), .25);
    table.at_most("rims to mesh, p99", row.errors.rim.quantile(.99), .2);
    table.at_most("crossings", double(row.certificate.n_self_intersections), 0, 0);
    table.at_most("stretch: samples over the bound in no named place", unnamed, 0, 0);
    table.at_most("processor time, over that of the grid and volumeToMesh 0.1",
                  (grid_s + extract_s + simplify_s) / (grid_s + theirs_s), 1);
}

void many(Table& table) {
    const Scene scene(holed_ball(10'000));
    const LabelledMesh sharp = extract(*scene.grid, scene.field.get(), kAdaptive);
    BoundedMesh ours;
    const double start = processor_s();
    ours = scene.simplified(sharp);
    const Row row =
        print_row(scene, "10000 holes, bound 0.25", plain(ours.mesh), processor_s() - start);
    table.section("256 voxels, 10000 holes, bound 0.25");
    table.at_most("triangles, over those of volumeToMesh 0.1",
                  double(ours.mesh.triangles.size()) /
                      double(peer_mesh(*scene.grid, 0.1).triangles.size()),
                  0.4);
    table.at_most("crossings", double(row.certificate.n_self_intersections), 0, 0);
    table.at_most("samples over the bound in no named place", double(n_unnamed(scene, row, ours)),
                  0, 0);
}

/// All simplify the same sharp surface of full extraction to the same count.
void simplify(Table& table) {
    const Scene scene(holed_ball(1000));
    const LabelledMesh sharp = extract(*scene.grid, scene.field.get(), kFull);
    const Certificate before = certify(plain(sharp), {.self_intersections = false});
    const double start = processor_s();
    const BoundedMesh ours = scene.simplified(sharp);
    const double ours_s = processor_s() - start;
    const std::size_t n = ours.mesh.triangles.size();
    const Row row = print_row(scene, "bound 0.25, from full", plain(ours.mesh), ours_s);
    double theirs_s = 0;
    const TriMesh theirs = openmesh_simplified(plain(sharp), n, theirs_s);
    const Row their_row = print_row(scene, "OpenMesh ModQuadric", theirs, theirs_s);
    table.section("simplification alone, 256 voxels, 1000 holes, to one count");
    table.at_least("times as fast as OpenMesh ModQuadric", theirs_s / ours_s, 15, 1);
    table.at_most("mesh to surface, p99.9, over its",
                  row.errors.mesh.quantile(.999) / their_row.errors.mesh.quantile(.999), 1);
    table.at_most("crossings", double(row.certificate.n_self_intersections), 0, 0);
    table.at_most("pieces lost", double(before.n_components) - double(row.certificate.n_components),
                  0, 0);
    table.at_most("non-manifold edges", double(row.certificate.n_nonmanifold_edges), 0, 0);
#ifdef TAIHU_HAS_MESHOPTIMIZER
    const TriMesh also = meshoptimizer_simplified(plain(sharp), n, theirs_s);
    const Row also_row = print_row(scene, "meshoptimizer", also, theirs_s);
    table.at_least("pieces that meshoptimizer loses",
                   double(before.n_components) - double(also_row.certificate.n_components), 1, 0);
    table.at_least("non-manifold edges of meshoptimizer",
                   double(also_row.certificate.n_nonmanifold_edges), 1, 0);
#else
    table.skipped("meshoptimizer", "apt-get install libmeshoptimizer-dev");
#endif
}

void chain(Table& table) {
    const SharedField field = holed_ball(1000);
    const double cpu_start = processor_s();
    const auto start = std::chrono::steady_clock::now();
    const auto grid = rasterize(*field, kLattice);
    const LodChain levels =
        make_lods(*grid, field.get(), {.levels = bounds_by_factor(4, kBound, 2)});
    const std::string glb = format_glb(levels);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    fmt::print("\nchain: {:.2f} s, {:.2f} s of processor time, {} bytes\n", took.count(),
               processor_s() - cpu_start, glb.size());
    double over = 0;
    std::size_t n_crossings = 0, n_failed = 0;
    for (const LodLevel& level : levels.levels) {
        fmt::print("  {} triangles, bound {}, error {:.4f}, {} places named\n",
                   level.certificate.n_triangles, level.bound_m, level.error_m,
                   level.unresolved.size());
        over = std::max(over, level.error_m / level.bound_m);
        n_crossings += level.certificate.n_self_intersections;
        n_failed += !level.certificate.holds();
    }
    table.section("chain of 4 levels from 0.25, 256 voxels, 1000 holes, as decoded");
    table.at_least("levels", double(levels.levels.size()), 4, 0);
    table.at_most("seconds, Draco and certificate included", took.count(), 10, 2);
    table.at_most("seconds, stretch", took.count(), 4, 2);
    table.at_most("errors over bounds, max", over, 1);
    table.at_most("crossings", double(n_crossings), 0, 0);
    table.at_most("levels whose certificate does not hold", double(n_failed), 0, 0);
}

} // namespace
} // namespace taihu

int main(int argc, char** argv) {
    using namespace taihu;
    openvdb::initialize();
    const std::pair<std::string, std::function<void(Table&)>> sections[] = {{"full", full},
                                                                            {"adaptive", adaptive},
                                                                            {"many", many},
                                                                            {"simplify", simplify},
                                                                            {"chain", chain}};
    const std::vector<std::string> asked(argv + 1, argv + argc);
    Table table;
    print_head();
    for (const auto& [name, run] : sections)
        if (asked.empty() || std::find(asked.begin(), asked.end(), name) != asked.end())
            run(table);
    table.print();
    return 0;
}
