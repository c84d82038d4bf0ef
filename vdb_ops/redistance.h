#pragma once
#include <openvdb/openvdb.h>

#include "stats/core/progress.h"

namespace taihu {

// What is not pointwise needs the grid. Both return a new level set on the same lattice with the
// half band asked for, whose values grow by at most 1 voxel from one voxel to the next. The same
// bits on any number of threads. Time and memory O(leaves of the wider band); serial parts
// O(leaves).

/// Distances made true again, where operations left bounds (beyond the edges of intersections and
/// in blends). Voxels within one of the surface take their distance to the piecewise linear
/// surface through the crossings of the grid's edges and diagonals, so the surface stays in place
/// within voxel^2 / 8r at a radius of curvature r; from there the eikonal equation is solved
/// outwards (first order upwind; within 0.1 voxel at 3 voxels from the surface).
/// \param half_width_vox  2..1000.
/// \throws Error bad_argument: as lattice_of(), or a half width out of range; unsupported: a band
///   of more than 2^22 leaves; cancelled.
openvdb::FloatGrid::Ptr redistance(const openvdb::FloatGrid& solid, float half_width_vox = 3,
                                   Progress* progress = nullptr);

/// A wider band: active voxels keep their values, the eikonal equation gives those beyond.
/// \param half_width_vox  at least that of `solid`, at most 1000.
/// \throws Error as redistance().
openvdb::FloatGrid::Ptr widen_band(const openvdb::FloatGrid& solid, float half_width_vox,
                                   Progress* progress = nullptr);

} // namespace taihu
