#pragma once
#include <vector>

#include <openvdb/openvdb.h>

#include "mesh_out/surface_distance.h"
#include "stats/core/progress.h"
#include "vdb_ops/field_probe.h"

namespace taihu {

/// Points of the field's surface farther than `least_m` from the one extracted of its level set:
/// on fins, walls and slits thinner than a voxel, and on tips and edges too sharp for it. They are
/// sought round lattice points near the surface where values bend, half a voxel apart, on every
/// primitive and rim there. The same on any number of threads. O(band), field evaluations by rims.
/// \param solid  level set of true distances near its surface. \param field  a probe of all of it
/// with a reach of 2 voxels. \param extracted  what the voxels show of that surface.
std::vector<Vec3> lost_surface(const openvdb::FloatGrid& solid, const FieldProbe& field,
                               const SurfaceDistance& extracted, double least_m,
                               Progress* progress = nullptr);

} // namespace taihu
