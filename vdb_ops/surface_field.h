#pragma once
#include <memory>

#include <openvdb/openvdb.h>

#include "vdb_ops/field.h"

namespace taihu {

/// Whether points of a field cost much: meshes and superquadrics.
bool is_slow(const Field& field);

/// What a surface is best made of: of a slow field its level set, which is as near to it and
/// sampled many times faster, unless it is a mesh of sharp edges and faces many voxels wide. Any
/// other field itself.
/// \param grid  the field rasterized.
std::shared_ptr<const Field> surface_field(std::shared_ptr<const Field> field,
                                           openvdb::FloatGrid::ConstPtr grid);

} // namespace taihu
