#pragma once
#include <vector>

#include "vdb_ops/mesh_edges_detail.h"
#include "vdb_ops/mesh_repair.h"

namespace taihu {

/// Closes every boundary loop of a mesh whose shells are numbered, as repair_mesh() says, and lists
/// it in the diagnosis.
/// \param halves  of its triangles. \param flat_bases  as under CloseRule::plane.
void close_loops(RepairedMesh& mesh, const std::vector<HalfEdge>& halves, bool flat_bases);

} // namespace taihu
