#pragma once
#include <vector>

#include "stats/core/tri_mesh.h"
#include "vdb_ops/field_probe.h"

namespace taihu {

/// A mesh of a solid whose vertices know what they lie on: one primitive of the field on a face,
/// two on a rim, three in a corner.
struct LabelledMesh {
    std::vector<Vec3> positions; ///< [m]
    std::vector<Triangle> triangles;
    std::vector<PrimitiveSet> labels; ///< one per position; empty where only the grid knows it
};

} // namespace taihu
