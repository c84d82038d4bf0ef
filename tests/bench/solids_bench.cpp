// Mesh to level set and carving, beside OpenVDB's own route: processor seconds, medians of five
// (fewer where no bar is set), both sides in turn and compiled with the same flags.
// Without arguments all tables, otherwise those named.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/core.h>
#include <spawn.h>
#include <sys/wait.h>

#include "mesh_out/extract.h"
#include "stats/sampler.h"
#include "tests/bench/peers.h"
#include "tests/bench/ratio.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/carve.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/shapes.h"
#include "vdb_ops/voxelize.h"

extern char** environ;

namespace taihu {
namespace {

constexpr int kRuns = 5;

openvdb::FloatGrid::Ptr base_at(int dim) { // the boulder, 20,480 triangles, longest axis 1
    return voxelize(shape_mesh({}), "boulder", {.voxel_m = 1.0 / dim}).solid;
}

/// A Boolean model of porosity 0.3 in the box: -ln(0.7) = n / V * pi * mean^3.
std::vector<Sphere> some_holes(const Box& box, int n) {
    std::vector<Sphere> holes;
    if (n == 0)
        return holes;
    const double mean = std::cbrt(-std::log(0.7) * box.volume() / (M_PI * n));
    const HoleStream stream(Law::exponential(1), box, mean, 1);
    for (int i = 0; i < n; ++i)
        holes.push_back(stream.hole(static_cast<std::uint64_t>(i)));
    return holes;
}

std::vector<Sphere> some_holes(int n) {
    return some_holes(bounds(shape_mesh({})), n);
}

std::string verdict(bool met) {
    return met ? "met" : "NOT MET";
}

void print_row(const std::string& what, const Pair& t, std::optional<double> bar) {
    fmt::print("{:<34} {:>9.4f} {:>9.4f} {:>7.1f}x", what, t.ours, t.peer, t.ratio());
    if (bar)
        fmt::print("  {:>3.0f}x {}", *bar, verdict(t.ratio() >= *bar));
    fmt::print("\n");
    std::fflush(stdout);
}

void print_head(const char* peer) {
    fmt::print("\n{:<34} {:>9} {:>9} {:>8}  {:>4}\n", "processor seconds", "taihu", peer, "ratio",
               "bar");
}

void voxelize_table() {
    print_head("OpenVDB");
    const TriMesh mesh = shape_mesh({});
    for (const auto& [dim, bar] : {std::pair(128, 6), std::pair(256, 10), std::pair(512, 10)}) {
        const double voxel = 1.0 / dim;
        print_row(fmt::format("mesh to level set, {}", dim),
                  compare(
                      kRuns, [&] { voxelize(mesh, "boulder", {.voxel_m = voxel}); },
                      [&] { peer_voxelize(mesh, voxel); }),
                  bar);
    }
}

void carve_table(std::span<const int> dims, bool barred) {
    print_head("OpenVDB");
    double log_sum = 0;
    int n_cells = 0;
    for (const int dim : dims) {
        const auto base = base_at(dim);
        for (const int n : {100, 1000, 10'000, 100'000, 1'000'000}) {
            const bool has_bar = barred && n >= 1000 && n <= 100'000;
            const bool long_run = dim > 512 || n > 100'000;
            const std::vector<Sphere> holes = some_holes(n);
            const Pair t = compare(
                long_run ? 1 : kRuns, [&] { carve(*base, holes); },
                [&] { peer_carve(*base, holes); });
            print_row(fmt::format("carve {} holes, {}", n, dim), t,
                      has_bar ? std::optional(6.0) : std::nullopt);
            if (has_bar) {
                log_sum += std::log(t.ratio());
                ++n_cells;
            }
        }
    }
    if (barred) {
        const double mean = std::exp(log_sum / n_cells);
        fmt::print("geometric mean of the {} barred cells: {:.1f}x, bar 8x {}, 12x {}\n", n_cells,
                   mean, verdict(mean >= 8), verdict(mean >= 12));
    }
}

void naive_table() {
    print_head("one by one");
    for (const int dim : {256, 512}) {
        const auto base = base_at(dim);
        const std::vector<Sphere> holes = some_holes(1000);
        print_row(fmt::format("carve 1000 holes, {}", dim),
                  compare(
                      3, [&] { carve(*base, holes); }, [&] { naive_carve(*base, holes); }),
                  50);
    }
}

/// Processor time per leaf of the result, so of the surface that survives.
void leaf_table(int dim) {
    fmt::print("\nmicroseconds per leaf of the result (bar: within 2x of 1000 holes)\n");
    const auto base = base_at(dim);
    double first = 0;
    for (const int n : {1000, 10'000, 100'000, 1'000'000}) {
        const std::vector<Sphere> holes = some_holes(n);
        std::size_t n_leaves = 0;
        std::vector<double> times;
        for (int run = 0; run < 3; ++run) {
            const double start = processor_s();
            n_leaves = carve(*base, holes).rock->tree().leafCount();
            times.push_back(processor_s() - start);
        }
        const double each = 1e6 * median(times) / static_cast<double>(n_leaves);
        first = n == 1000 ? each : first;
        fmt::print("{:>5} {:>8} holes {:>8} leaves {:>6.2f} us {:>5.2f}x {}\n", dim, n, n_leaves,
                   each, each / first, verdict(each <= 2 * first));
        std::fflush(stdout);
    }
}

/// One side of the memory comparison, in a process of its own.
int run_side(const char* side) {
    const auto base = base_at(512);
    const std::vector<Sphere> holes = some_holes(100'000);
    if (std::strcmp(side, "taihu") == 0)
        carve(*base, holes);
    else if (std::strcmp(side, "OpenVDB") == 0)
        peer_carve(*base, holes);
    return 0;
}

/// Greatest resident size of a child [MB]. Measured before this process grows: a child starts from
/// its parent's.
double peak_mb(const char* side) {
    char self[] = "/proc/self/exe", option[] = "--side";
    std::string name = side;
    char* argv[] = {self, option, name.data(), nullptr};
    pid_t child = 0;
    int status = 0;
    rusage usage{};
    if (posix_spawn(&child, self, nullptr, nullptr, argv, environ) != 0 ||
        wait4(child, &status, 0, &usage) != child || status != 0)
        throw std::runtime_error("the child process for peak memory failed");
    return static_cast<double>(usage.ru_maxrss) * 1024e-6;
}

void memory_table() {
    const double base = peak_mb("base"), ours = peak_mb("taihu"), peer = peak_mb("OpenVDB");
    fmt::print(
        "peak memory, carve 100000 holes, 512 [MB]: base alone {:.0f}, taihu {:.0f}, OpenVDB "
        "{:.0f}: {:.2f}x, bar 0.6x {}\n",
        base, ours, peer, ours / peer, verdict(ours <= 0.6 * peer));
}

/// A closed mesh round the origin with exactly `n` faces, n even and >= 8: a globe, and faces split
/// in their middle until there are enough.
TriMesh globe(std::size_t n) {
    const auto around = static_cast<std::uint32_t>(std::sqrt(static_cast<double>(n) / 2) + 1);
    const auto rings = static_cast<std::uint32_t>(n / 2 / around);
    TriMesh mesh;
    for (std::uint32_t r = 0; r < rings; ++r)
        for (std::uint32_t a = 0; a < around; ++a) {
            const double theta = M_PI * (r + 1) / (rings + 1), phi = 2 * M_PI * a / around;
            mesh.positions.push_back(Vec3{std::sin(theta) * std::sin(phi), std::cos(theta),
                                          std::sin(theta) * std::cos(phi)} *
                                     0.5);
        }
    const std::uint32_t top = rings * around, bottom = top + 1;
    mesh.positions.push_back({0, 0.5, 0});
    mesh.positions.push_back({0, -0.5, 0});
    for (std::uint32_t a = 0; a < around; ++a) {
        const std::uint32_t b = (a + 1) % around, last = (rings - 1) * around;
        mesh.triangles.push_back({top, a, b});
        mesh.triangles.push_back({bottom, last + b, last + a});
        for (std::uint32_t r = 0; r < last; r += around) {
            mesh.triangles.push_back({r + a, r + around + a, r + b});
            mesh.triangles.push_back({r + b, r + around + a, r + around + b});
        }
    }
    for (std::size_t f = 0; mesh.triangles.size() < n; ++f) {
        const Triangle t = mesh.triangles[f];
        const auto middle = static_cast<std::uint32_t>(mesh.positions.size());
        mesh.positions.push_back(
            (mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3);
        mesh.triangles[f] = {t[0], t[1], middle};
        mesh.triangles.push_back({t[1], t[2], middle});
        mesh.triangles.push_back({t[2], t[0], middle});
    }
    return mesh;
}

/// From base surfaces and holes to triangles, as the thesis timed it. One surface is a ball.
double thesis_s(int dim, int n_surfaces, const std::vector<Sphere>& holes, const TriMesh& mesh) {
    const Lattice lattice{1.0 / dim, {}, 3};
    constexpr int kRepeats = 20;
    const double start = processor_s();
    for (int i = 0; i < kRepeats; ++i) {
        const auto base = n_surfaces == 1
                              ? rasterize(BallsField(std::vector<Sphere>{{{}, 0.5}}), lattice)
                              : voxelize(mesh, "globe", {.voxel_m = lattice.voxel_m}).solid;
        extract_uniform(*carve(*base, holes).rock);
    }
    return (processor_s() - start) / kRepeats;
}

/// Tables 5.2 to 5.4 of the thesis; its seconds are those of an SGI Indigo2 (200 MHz R4400).
void thesis_table() {
    struct Row {
        int table, dim, n_surfaces, n_holes;
        double thesis_s;
    };
    constexpr Row kRows[] = {{2, 20, 1, 0, 1},       {2, 20, 1, 100, 10},     {2, 20, 1, 250, 22},
                             {2, 20, 1, 500, 47},    {2, 20, 1, 1000, 93},    {2, 20, 1, 2000, 182},
                             {3, 20, 1, 0, 1},       {3, 20, 36, 0, 7},       {3, 20, 224, 0, 46},
                             {3, 20, 2588, 0, 597},  {3, 20, 1, 250, 22},     {3, 20, 36, 250, 27},
                             {3, 20, 224, 250, 59},  {3, 20, 2588, 250, 616}, {4, 20, 1, 0, 1},
                             {4, 30, 1, 0, 3},       {4, 40, 1, 0, 21},       {4, 20, 1, 250, 22},
                             {4, 30, 1, 250, 85},    {4, 40, 1, 250, 216},    {4, 20, 224, 0, 46},
                             {4, 30, 224, 0, 162},   {4, 40, 224, 0, 362},    {4, 20, 224, 250, 59},
                             {4, 30, 224, 250, 205}, {4, 40, 224, 250, 490}};
    fmt::print("\n{:<6} {:>6} {:>14} {:>6} {:>12} {:>10}\n", "table", "voxels", "base surfaces",
               "holes", "thesis [s]", "taihu [s]");
    double total = 0;
    for (const Row& row : kRows) {
        const TriMesh mesh =
            row.n_surfaces == 1 ? TriMesh{} : globe(static_cast<std::size_t>(row.n_surfaces));
        const double s =
            thesis_s(row.dim, row.n_surfaces,
                     some_holes({{-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}}, row.n_holes), mesh);
        total += s;
        fmt::print("5.{:<4} {:>4}^3 {:>14} {:>6} {:>12.0f} {:>10.5f}\n", row.table, row.dim,
                   row.n_surfaces, row.n_holes, row.thesis_s, s);
    }
    fmt::print("all of them: {:.3f} s, bar 1 s {}\n", total, verdict(total <= 1));
}

} // namespace
} // namespace taihu

int main(int argc, char** argv) {
    using namespace taihu;
    openvdb::initialize();
    if (argc == 3 && std::strcmp(argv[1], "--side") == 0)
        return run_side(argv[2]);
    try {
        static constexpr int kBarred[] = {256, 512}, kOthers[] = {128, 1024};
        const std::pair<std::string, std::function<void()>> tables[] = {
            {"memory", memory_table},
            {"voxelize", voxelize_table},
            {"carve", [] { carve_table(kBarred, true); }},
            {"naive", naive_table},
            {"leaves_512", [] { leaf_table(512); }},
            {"leaves_1024", [] { leaf_table(1024); }},
            {"thesis", thesis_table},
            {"others", [] { carve_table(kOthers, false); }}};
        const std::vector<std::string> asked(argv + 1, argv + argc);
        for (const auto& [name, table] : tables)
            if (asked.empty() || std::find(asked.begin(), asked.end(), name) != asked.end())
                table();
        return 0;
    } catch (const std::exception& e) {
        fmt::print(stderr, "solids_bench: {}\n", e.what());
        return 1;
    }
}
