#pragma once
#include <span>

#include <openvdb/openvdb.h>

#include "stats/core/sphere.h"
#include "stats/core/tri_mesh.h"

namespace taihu {

/// OpenVDB's own way to do the same, with its defaults.
openvdb::FloatGrid::Ptr peer_voxelize(const TriMesh& mesh, double voxel_m);
openvdb::FloatGrid::Ptr peer_carve(const openvdb::FloatGrid& base, std::span<const Sphere> holes);

} // namespace taihu
