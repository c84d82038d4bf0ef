#pragma once
#include <vector>

#include <openvdb/openvdb.h>

#include "stats/core/progress.h"
#include "vdb_ops/field_probe.h"

namespace taihu {

/// Points of the field's surface that its level set does not see: on fins, walls and slits thinner
/// than a voxel, between whose sides no lattice point lies. Every such surface has a lattice point
/// within half the diagonal of a voxel, whose value is small though no neighbour towards the
/// surface has the other sign; from there it is looked for. About one point a voxel; what is partly
/// seen may be given, too, and has to be measured. The same on any number of threads. O(band).
/// \param solid  level set of true distances near its surface. \param field  a probe of all of it
/// with a reach of 2 voxels.
std::vector<Vec3> lost_surface(const openvdb::FloatGrid& solid, const FieldProbe& field,
                               Progress* progress = nullptr);

} // namespace taihu
