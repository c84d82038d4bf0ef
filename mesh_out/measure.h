#pragma once
#include "stats/core/tri_mesh.h"

namespace taihu {

/// Volume of the convex hull of the positions [m^3] (Qhull); 0 when they lie in a plane.
/// \throws Error bad_argument: no triangle, or a non-finite position.
double hull_volume_m3(const TriMesh& mesh);

} // namespace taihu
