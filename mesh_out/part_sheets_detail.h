#pragma once
#include "mesh_out/position_grid.h"
#include "stats/core/tri_mesh.h"

namespace taihu {

/// Where faces cross because rounding put both sides of a thin wall or slit into one place, their
/// vertices go to other points of the grid, as near as there are, up to `most_m` away: the first
/// that leaves no crossing round them, or the fewest. What still crosses then is left. Vertices
/// keep their numbers. Cost: a pass over all faces for each such vertex.
/// \param mesh  snapped to `grid`.
void part_sheets(TriMesh& mesh, const PositionGrid& grid, double most_m);

} // namespace taihu
