#include "vdb_ops/estimate.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include <sys/resource.h>
#include <tbb/parallel_for.h>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;

constexpr int kBlock = BlockSampler::kBlock;
constexpr double kMostOpened = 0x1p14, kMostSampled = 256; // blocks
// Measured at the peak of runs at 512 voxels: what a leaf and its place in the tree take, what
// writing takes beside it, names of parts and copies in cleaning, triangles and their certificate
// (at 128 and 256 voxels: 44 kB of a smooth boulder to 160 kB of pumice of small holes).
constexpr double kProgram_bytes = 45e6, kLeaf_bytes = 2400, kWritten_bytes = 4000,
                 kCleaned_bytes = 8000, kMeshed_bytes = 70000;
constexpr double kUsable = 0.9; // of what is left, for what is not counted

double read_bytes(const char* path) {
    std::ifstream file(path);
    double value = 0;
    return file >> value ? value : HUGE_VAL; // `max` is no number
}

/// The number behind a word that begins a line.
double value_of(const char* path, const std::string& word) {
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);)
        if (line.starts_with(word))
            return std::strtod(line.c_str() + word.size(), nullptr);
    return HUGE_VAL;
}

/// What limits, less what is taken of it already [bytes].
double left_bytes() {
    double left = 1024 * value_of("/proc/meminfo", "MemAvailable:");
    struct Group {
        const char *most, *now, *stat, *cache; ///< the cache gives way, and is no use that counts
    };
    for (const Group& g : {Group{"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current",
                                 "/sys/fs/cgroup/memory.stat", "inactive_file "},
                           Group{"/sys/fs/cgroup/memory/memory.limit_in_bytes",
                                 "/sys/fs/cgroup/memory/memory.usage_in_bytes",
                                 "/sys/fs/cgroup/memory/memory.stat", "total_inactive_file "}})
        if (const double limit = read_bytes(g.most), used = read_bytes(g.now);
            std::isfinite(limit) && std::isfinite(used)) {
            const double cache = value_of(g.stat, g.cache);
            left = std::min(left, limit - used + (std::isfinite(cache) ? cache : 0));
        }
    return std::isfinite(left) ? std::max(left, 0.0) : 64e9;
}

/// What a limit of this process leaves of a resource [bytes].
double left_of(int resource, const char* now) {
    rlimit most{};
    if (::getrlimit(static_cast<__rlimit_resource>(resource), &most) != 0 ||
        most.rlim_cur == RLIM_INFINITY)
        return HUGE_VAL;
    return std::max(0.0,
                    static_cast<double>(most.rlim_cur) - 1024 * value_of("/proc/self/status", now));
}

/// The blocks that the surface comes near, of some that are spread evenly over the box.
struct Opened {
    std::vector<Coord> near;
    double share = 1; ///< of all blocks that were opened
};

Opened open_some(const LatticeField& field) {
    const CoordBBox box = field.bounds();
    Opened opened;
    if (box.empty())
        return opened;
    Coord lo, n;
    for (int axis = 0; axis < 3; ++axis) {
        lo[axis] = box.min()[axis] >> 6;
        n[axis] = (box.max()[axis] >> 6) - lo[axis] + 1;
    }
    const double all = double(n.x()) * n.y() * n.z();
    const double step = std::max(1.0, all / kMostOpened);
    const auto count = static_cast<std::size_t>(all / step);
    std::vector<char> near(count);
    // An odd share of the way into each step: rows of blocks are not sampled in columns.
    const auto block = [&](std::size_t i) {
        const double spread = std::fmod(0.6180339887498949 * static_cast<double>(i), 1.0);
        const double number = std::min(
            all - 1, std::floor((static_cast<double>(i) + (step > 1 ? spread : 0)) * step));
        const double yz = double(n.y()) * n.z(), x = std::floor(number / yz);
        const double y = std::floor((number - x * yz) / n.z());
        return (lo + Coord(static_cast<int>(x), static_cast<int>(y),
                           static_cast<int>(number - x * yz - y * n.z())))
               << 6;
    };
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
        Cover cover{};
        near[i] = field.open(block(i), cover) != nullptr;
    });
    for (std::size_t i = 0; i < count; ++i)
        if (near[i])
            opened.near.push_back(block(i));
    opened.share = static_cast<double>(count) / all;
    return opened;
}

} // namespace

SizeEstimate estimate_size(const Field& field, const Lattice& lattice) {
    empty_level_set(lattice); // refuses what is none
    const auto sampled = field.on(lattice, CoordBBox::inf());
    const auto start = std::chrono::steady_clock::now();
    const auto seconds = [&start] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    const Opened opened = open_some(*sampled);
    if (opened.near.empty())
        return {};
    const double opening = seconds() / opened.share;
    const auto n =
        static_cast<std::size_t>(std::min(kMostSampled, static_cast<double>(opened.near.size())));
    std::vector<double> leaves(n);
    const double before = seconds();
    tbb::parallel_for(std::size_t{0}, n, [&](std::size_t i) {
        const Coord block = opened.near[i * opened.near.size() / n];
        const auto grid =
            rasterize(*sampled, lattice, CoordBBox::createCube(block, kBlock), nullptr);
        leaves[i] = static_cast<double>(grid->tree().leafCount());
    });
    const double times =
        static_cast<double>(opened.near.size()) / static_cast<double>(n) / opened.share;
    SizeEstimate estimate;
    for (const double l : leaves)
        estimate.n_leaves += l * times;
    estimate.seconds = opening + (seconds() - before) * times;
    return estimate;
}

double MemoryUse::bytes() const {
    const double each = meshed ? kMeshed_bytes : cleaned ? kCleaned_bytes : kWritten_bytes;
    return kProgram_bytes + kLeaf_bytes * base_leaves + each * leaves;
}

double memory_limit_bytes(std::optional<double> asked) {
    const double left = kUsable * std::min(left_bytes(), left_of(RLIMIT_AS, "VmSize:"));
    // The second is set by the program itself, to what was asked for and a little more.
    return std::min(left, asked ? *asked : left_of(RLIMIT_DATA, "VmData:"));
}

bool may_exceed(const Box& box, double voxel_m, const MemoryUse& use, double limit_bytes) {
    MemoryUse all = use;
    const Vec3 n = box.size() / voxel_m + Vec3{16, 16, 16};
    all.leaves = n.x / 8 * (n.y / 8) * (n.z / 8);
    return all.bytes() > limit_bytes;
}

void refuse_if_over(const MemoryUse& use, double voxel_m, double limit_bytes) {
    const double needed = use.bytes();
    if (needed <= limit_bytes)
        return;
    if (limit_bytes < kProgram_bytes)
        throw Error(Fault::unsupported, "refused: the program alone needs about " +
                                            human_bytes(kProgram_bytes) + " (limit " +
                                            human_bytes(limit_bytes) + "); allow more memory");
    // Leaves go with the area in voxels; what is below a voxel goes faster.
    const double fixed = std::min(kProgram_bytes, 0.5 * limit_bytes);
    const double fits = 1.02 * voxel_m * std::sqrt((needed - fixed) / (limit_bytes - fixed));
    throw Error(Fault::unsupported, "refused: voxel size " + rounded(voxel_m) +
                                        " m would need about " + human_bytes(needed) + " (limit " +
                                        human_bytes(limit_bytes) +
                                        "); smallest that fits: " + rounded(fits) + " m");
}

std::string human_bytes(double bytes) {
    static constexpr const char* kUnits[] = {"B", "kB", "MB", "GB", "TB", "PB", "EB"};
    int unit = 0;
    for (; bytes >= 1000 && unit < 6; ++unit)
        bytes /= 1000;
    return rounded(bytes) + " " + kUnits[unit];
}

} // namespace taihu
