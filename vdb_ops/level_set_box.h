#pragma once
#include <openvdb/openvdb.h>

#include "stats/core/box.h"

namespace taihu {

/// The box of a level set's surface [m]: an inside voxel's own distance leads on to it, so the
/// voxel size does not show. Empty when nothing is inside.
Box level_set_box(const openvdb::FloatGrid& grid);

} // namespace taihu
