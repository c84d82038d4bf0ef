#pragma once
#include <memory>

#include <openvdb/openvdb.h>

#include "vdb_ops/field_probe.h"

namespace taihu {

/// A level set as its own field: trilinear, one primitive. As far as its band reaches.
/// \throws Error bad_argument as lattice_of().
std::unique_ptr<FieldProbe> level_set_probe(openvdb::FloatGrid::ConstPtr grid);

} // namespace taihu
