#pragma once
#include <openvdb/openvdb.h>

#include "stats/core/progress.h"
#include "vdb_ops/field.h"
#include "vdb_ops/mesh_repair.h"

namespace taihu {

/// The level set [m] of where the winding number w of an open surface is beyond +-1/2.
///
/// Its surface is that part of the faces where they lead from in to out, and in openings the level
/// |w| = 1/2, which no face says: it is made of triangles between the places where it passes the
/// edges of the lattice, so it depends on the lattice. Distances are exact to both together, so
/// values change sign through 0 and are 1-Lipschitz everywhere.
///
/// Signs: w is the integer count of the capped surface less what the caps alone come to; the latter
/// stays below 1/2, and out of it all, but near caps. Where faces are far, w is smooth and sampled.
/// Faces inside end within a quarter of a voxel of where they should.
///
/// The same bits on any number of threads. Cost: leaves near faces as for a closed mesh, 2 to 10 us
/// for each voxel near the rim of an opening, and eight times for each face.
/// \param mesh  repaired under CloseRule::winding.
/// \throws Error cancelled; bad_argument: a mesh beyond 2^20 voxels from the lattice's origin.
openvdb::FloatGrid::Ptr winding_level_set(const RepairedMesh& mesh, const Lattice& lattice,
                                          Progress* progress = nullptr);

} // namespace taihu
