#pragma once
#include <cstddef>
#include <span>

#include <openvdb/openvdb.h>

#include "stats/core/progress.h"
#include "stats/core/sphere.h"

namespace taihu {

struct CarveResult {
    openvdb::FloatGrid::Ptr rock; ///< narrow-band level set [m] on the lattice of the input
    std::size_t n_unresolved =
        0; ///< holes with a radius below 1.5 voxels: carved, but not in shape
};

/// Subtract the union of `holes` from `rock`: out(x) = max(rock(x), max_i(r_i - |x - c_i|)), leaf
/// by leaf, without a grid of the union. Holes that lie outside the rock, inside others or deep in
/// the air cost next to nothing; leaves that no hole comes near are taken over bit for bit. A
/// function of its arguments alone: neither the order of `holes` nor the thread count changes a
/// bit. Time O(leaves that the surface of the result passes), memory that of the result.
///
/// \param rock   level set: cubic voxels, values [m], negative inside, half band >= 2 voxels.
/// \param holes  balls in world space [m]; may overlap and may stick out of the rock.
///
/// \throws Error bad_argument: not a level set, or `holes[i]` with a radius not finite and > 0;
///   cancelled: as soon as `progress` says so; `rock` is untouched.
CarveResult carve(const openvdb::FloatGrid& rock, std::span<const Sphere> holes,
                  Progress* progress = nullptr);

/// How much carving took away.
struct CarvedVolume {
    double base_m3 = 0;    ///< volume of the base
    double removed_m3 = 0; ///< volume(base) - volume(rock)

    double porosity() const { return removed_m3 / base_m3; }
};

/// Time O(leaves of both), a small share of what carve() takes.
CarvedVolume carved_volume(const openvdb::FloatGrid& base, const openvdb::FloatGrid& rock);

} // namespace taihu
