#pragma once
#include <vector>

#include "stats/core/tri_mesh.h"

namespace taihu {

/// Leaves out the pieces (connected over vertices) that are at most so long, but the largest. Of
/// those a level of that error cannot say on which side they are solid.
/// \return the positions that went.
std::vector<Vec3> drop_small_pieces(TriMesh& mesh, double longest_m);

} // namespace taihu
