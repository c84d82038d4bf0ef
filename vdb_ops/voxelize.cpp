#include "vdb_ops/voxelize.h"

#include <cmath>
#include <cstdio>
#include <fstream>

#include "stats/core/error.h"
#include "vdb_ops/mesh_field.h"
#include "vdb_ops/mesh_solid.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

// A half band of 3 voxels measured 0.033 leaves per voxel^2 of a rough rock; 2.3 KiB a leaf with
// its tree, twice over for a base beside its result.
constexpr int kLeastDim = 4, kMostDim = 65536; // voxels along the longest axis
constexpr double kLeavesPerVoxel2 = 0.035, kBytesPerLeaf = 2 * 2350;

/// Memory that the machine can give now [bytes]; a large number where it does not say.
double available_bytes() {
    std::ifstream info("/proc/meminfo");
    for (std::string line; std::getline(info, line);) {
        double kib = 0;
        if (std::sscanf(line.c_str(), "MemAvailable: %lf kB", &kib) == 1)
            return kib * 1024;
    }
    return 64e9;
}

std::string human_bytes(double bytes) {
    static constexpr const char* kUnits[] = {"B", "kB", "MB", "GB", "TB", "PB", "EB"};
    int unit = 0;
    for (; bytes >= 1000 && unit < 6; ++unit)
        bytes /= 1000;
    char text[32];
    std::snprintf(text, sizeof text, "%.3g %s", bytes, kUnits[unit]);
    return text;
}

/// At the peak, roughly: within a factor of two above 100 MB.
double estimated_bytes(double area_m2, double voxel_m) {
    return area_m2 / (voxel_m * voxel_m) * kLeavesPerVoxel2 * kBytesPerLeaf;
}

bool any_inside(const openvdb::FloatGrid& solid) {
    for (auto leaf = solid.tree().cbeginLeaf(); leaf; ++leaf)
        for (openvdb::Index v = 0; v < 512; ++v)
            if (leaf->getValue(v) < 0)
                return true;
    return false;
}

} // namespace

double voxel_for(const Box& box, int dim) {
    if (dim < kLeastDim || dim > kMostDim)
        throw Error(Fault::bad_argument,
                    "dim: " + std::to_string(dim) +
                        " voxels along the longest axis, must be 4..65536; 256 "
                        "is usual");
    const double longest = box.longest();
    if (!(longest > 0) || !std::isfinite(longest))
        throw Error(Fault::bad_argument, "dim: the solid has no extent; give one that has");
    return longest / dim;
}

void refuse_if_too_large(double area_m2, const Box& box, double voxel_m) {
    const double limit = 0.7 * available_bytes(), needed = estimated_bytes(area_m2, voxel_m);
    if (box.longest() < kLeastDim * voxel_m)
        throw Error(Fault::bad_argument,
                    "voxel: the solid is " + std::to_string(box.longest() / voxel_m) +
                        " voxels long, must be at least 4; use a smaller voxel");
    const double fits = std::max(voxel_m * std::sqrt(needed / limit), box.longest() / kMostDim);
    if (needed <= limit && box.longest() / voxel_m <= kMostDim * 1.001)
        return;
    char text[192];
    std::snprintf(
        text, sizeof text,
        "refused: voxel size %.3g m would need about %s (limit %s); smallest that fits: %.3g m",
        voxel_m, human_bytes(needed).c_str(), human_bytes(limit).c_str(), 1.01 * fits);
    throw Error(Fault::unsupported, text);
}

VoxelizeResult voxelize(const TriMesh& mesh, const std::string& where,
                        const VoxelizeSettings& settings, Progress* progress) {
    Lattice lattice;
    lattice.voxel_m = settings.voxel_m;
    lattice.half_width_vox = settings.half_width_vox;
    if (!(lattice.voxel_m > 0) || !std::isfinite(lattice.voxel_m))
        throw Error(Fault::bad_argument, "voxelize: a voxel of " + std::to_string(lattice.voxel_m) +
                                             " m, must be finite and > 0");
    const MeshSolid solid = mesh_solid(mesh, where, settings.close, lattice, progress);
    refuse_if_too_large(solid.diagnosis.area_m2, solid.box, lattice.voxel_m);
    VoxelizeResult result;
    result.diagnosis = solid.diagnosis;
    result.solid = rasterize(*solid.field, lattice, progress);
    result.field = surface_field(solid.field, result.solid);
    if (!any_inside(*result.solid))
        throw Error(Fault::bad_input, where + ": smaller than a voxel of " +
                                          std::to_string(settings.voxel_m) +
                                          " m; use a smaller voxel");
    return result;
}

} // namespace taihu
