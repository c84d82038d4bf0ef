#pragma once
#include <openvdb/openvdb.h>

#include "stats/core/flat.h"

namespace taihu {

/// A grid of floats with its linear transform, its class and its metadata that are text.
/// \throws Error unsupported: a transform that is not linear.
void put_grid(FlatWriter& out, const openvdb::FloatGrid& grid);

/// What put_grid() wrote, node for node. \throws Error bad_input: it did not write that, or a value
/// is not finite.
openvdb::FloatGrid::Ptr get_grid(FlatReader& in);

} // namespace taihu
