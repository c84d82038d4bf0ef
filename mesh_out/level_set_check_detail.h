#pragma once
#include <openvdb/openvdb.h>

namespace taihu {

/// \throws Error bad_argument: not a level set, or voxels that are no cubes.
void require_level_set(const openvdb::FloatGrid& solid);
/// \throws Error bad_argument: nothing is left of the solid.
[[noreturn]] void refuse_empty(const openvdb::FloatGrid& solid);
/// \throws Error numeric: the surface leaves the narrow band.
[[noreturn]] void refuse_clipped(const openvdb::FloatGrid& solid);

} // namespace taihu
