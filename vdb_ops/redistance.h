#pragma once
#include <openvdb/openvdb.h>

#include "stats/core/progress.h"

namespace taihu {

// What is not pointwise needs the grid. Both return a new level set on the same lattice with the
// half band asked for. The same bits on any number of threads. Time and memory O(leaves of the
// wider band); serial parts O(leaves).

inline constexpr float kWidestBand_vox = 1000; ///< half bands that both can make

/// Distances made true again, where operations left bounds (beyond the edges of intersections, in
/// blends). The surface stays in place: voxels within one of it take their value over its gradient,
/// at edges, where that fails, their distance to the linear surface through the crossings of the
/// grid. From there the eikonal equation is solved outwards, first order upwind: at 3 voxels from
/// a ball of radius r voxels within 1.8 / r voxels. Values differ by at most 1.06 voxels from
/// one voxel to the next.
/// \param half_width_vox  2..1000.
/// \throws Error bad_argument: as lattice_of(), a half width out of range, or a voxel beyond 2^30;
///   unsupported: a band of more than 2^22 leaves; cancelled: within one layer of leaves.
openvdb::FloatGrid::Ptr redistance(const openvdb::FloatGrid& solid, float half_width_vox = 3,
                                   Progress* progress = nullptr);

/// A wider band: active voxels keep their values, the eikonal equation gives those beyond, first
/// order: about 0.03 voxel off for each voxel farther.
/// \param half_width_vox  at least that of `solid`, at most 1000.
/// \throws Error as redistance().
openvdb::FloatGrid::Ptr widen_band(const openvdb::FloatGrid& solid, float half_width_vox,
                                   Progress* progress = nullptr);

} // namespace taihu
