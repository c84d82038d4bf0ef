#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <openvdb/openvdb.h>

#include "stats/core/box.h"
#include "stats/core/progress.h"

namespace taihu {

/// A box of samples, all of them there: sample (x, y, z) lies at origin + voxel_m * (x, y, z) and
/// is number at(x, y, z) of an array.
struct DenseLattice {
    int n[3] = {0, 0, 0};
    double voxel_m = 0; ///< between samples
    int coarser = 1;    ///< voxels of the solid per sample, along an axis
    Vec3 origin;        ///< [m]

    std::size_t size() const { return stride(0) * static_cast<std::size_t>(n[0]); }
    std::size_t stride(int axis) const {
        const auto ny = static_cast<std::size_t>(n[1]), nz = static_cast<std::size_t>(n[2]);
        return axis == 0 ? ny * nz : axis == 1 ? nz : 1;
    }
    std::size_t at(int x, int y, int z) const {
        return static_cast<std::size_t>(x) * stride(0) + static_cast<std::size_t>(y) * stride(1) +
               static_cast<std::size_t>(z);
    }
    Vec3 place(int x, int y, int z) const {
        return origin + Vec3{1. * x, 1. * y, 1. * z} * voxel_m;
    }
    /// In samples, not rounded.
    Vec3 index(const Vec3& p) const { return (p - origin) / voxel_m; }
};

/// The box of the voxels inside a level set.
/// \throws Error bad_argument as lattice_of(); bad_input: nothing is inside. \param who  for
/// messages
openvdb::CoordBBox inside_voxels(const openvdb::FloatGrid& solid, const char* who);

/// A lattice over `box` of voxels of `solid`, on every `coarser`th of them; on fewer where it would
/// have more than 2^25 samples, a cube of 322. On every side it has `margin` voxels and three
/// samples more.
/// \throws Error bad_input: it would take every 17th. \param who  for messages
DenseLattice dense_lattice(const openvdb::FloatGrid& solid, const openvdb::CoordBBox& box,
                           double margin, int coarser, const char* who);

/// A level set at the samples, in units of the lattice's voxel; of its own lattice or another.
std::vector<float> dense_values(const openvdb::FloatGrid& grid, const DenseLattice& lattice,
                                const Progress* progress);

/// Voids that a plane along the lattice shows enclosed by solid, in one of the three directions at
/// least: 1 for those samples. `values` are negative inside the solid.
std::vector<std::uint8_t> enclosed_voids(const DenseLattice& lattice, std::span<const float> values,
                                         const Progress* progress);

/// Between samples, linear along each axis; the nearest inside the lattice for points outside.
inline float trilinear(const DenseLattice& lattice, const float* values, const Vec3& index) {
    std::size_t first = 0, step[3];
    float share[3];
    for (int a = 0; a < 3; ++a) {
        const double i = std::clamp(index[a], 0.0, lattice.n[a] - 1.0);
        const int low = std::min(static_cast<int>(i), std::max(lattice.n[a] - 2, 0));
        share[a] = static_cast<float>(i - low);
        first += static_cast<std::size_t>(low) * lattice.stride(a);
        step[a] = lattice.n[a] > 1 ? lattice.stride(a) : 0;
    }
    const auto along_z = [&](std::size_t i) {
        return values[i] + share[2] * (values[i + step[2]] - values[i]);
    };
    const auto in_plane = [&](std::size_t i) {
        const float a = along_z(i);
        return a + share[1] * (along_z(i + step[1]) - a);
    };
    const float a = in_plane(first);
    return a + share[0] * (in_plane(first + step[0]) - a);
}

} // namespace taihu
