#pragma once
#include <span>

#include <openvdb/openvdb.h>

#include "stats/core/sphere.h"
#include "stats/core/tri_mesh.h"

namespace taihu {

/// OpenVDB's own way to do the same, with its defaults.
openvdb::FloatGrid::Ptr peer_voxelize(const TriMesh& mesh, double voxel_m);
/// All balls as one level set, taken away at once.
openvdb::FloatGrid::Ptr peer_carve(const openvdb::FloatGrid& base, std::span<const Sphere> holes);
/// One ball after the other. Balls below 1.5 voxels come out empty.
openvdb::FloatGrid::Ptr naive_carve(const openvdb::FloatGrid& base, std::span<const Sphere> holes);

} // namespace taihu
