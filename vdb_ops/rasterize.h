#pragma once
#include <openvdb/openvdb.h>

#include "stats/core/progress.h"
#include "vdb_ops/field.h"

namespace taihu {

/// The narrow-band level set of a field [m]: active where |distance| is below the half width.
/// Leaves that the surface does not come near are never evaluated. The same bits on any number of
/// threads, and any block computed alone equals the same block of the whole.
/// Time O(leaves near the surface), memory that of the result.
/// \throws Error bad_argument: a lattice out of range (voxels from 1.5e-5 m), or voxel indices
/// beyond 2^30;
///   cancelled: within one block of 64^3 voxels.
openvdb::FloatGrid::Ptr rasterize(const Field& field, const Lattice& lattice,
                                  Progress* progress = nullptr);

/// The part of that level set in `region` [voxels], whole leaves of 8^3: these leaves and inside
/// tiles, the same bit for bit, and outside everywhere else.
/// \param field  on `lattice`, prepared for a region that holds this one.
openvdb::FloatGrid::Ptr rasterize(const LatticeField& field, const Lattice& lattice,
                                  const openvdb::CoordBBox& region, Progress* progress = nullptr);

/// A level set with nothing inside.
openvdb::FloatGrid::Ptr empty_level_set(const Lattice& lattice);

/// The lattice that `grid` lies on.
/// \throws Error bad_argument, naming the grid: not a level set, voxels that are not cubes, a
/// rotated
///   or sheared transform, or a half width outside 2..16 voxels.
Lattice lattice_of(const openvdb::FloatGrid& grid);

} // namespace taihu
