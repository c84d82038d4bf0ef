#pragma once
#include <openvdb/openvdb.h>

namespace taihu {

/// Volume of a level set [m^3]: voxels by the share of them that lies inside, from two tent kernels
/// combined so that curvature cancels to second order and axis-aligned planes are exact.
/// A ball of radius r: relative error below 0.05 (voxel / r)^2. Summed in a fixed order.
/// \param solid  level set, half band >= 2 voxels.
/// \param region  whole leaves: only what lies in it counts.
double volume_m3(const openvdb::FloatGrid& solid,
                 const openvdb::CoordBBox& region = openvdb::CoordBBox::inf());

} // namespace taihu
