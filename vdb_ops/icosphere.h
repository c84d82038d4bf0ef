#pragma once
#include "stats/core/tri_mesh.h"

namespace taihu {

/// The icosahedron about the origin, each face split into 4 `level` times: 20 * 4^level triangles
/// (level 0..8) with all positions on the sphere of radius 1. The same bytes on every platform.
TriMesh icosphere(int level);

} // namespace taihu
