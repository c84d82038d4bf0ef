#pragma once
#include <cstddef>

#include <openvdb/openvdb.h>

#include "stats/core/tri_mesh.h"

namespace taihu {

/// OpenVDB's mesher as it is, its faces turned outwards.
TriMesh peer_mesh(const openvdb::FloatGrid& grid, double adaptivity);

/// OpenMesh's decimater by quadrics, to so many faces. \param seconds  of processor time, without
/// making the half-edge mesh.
TriMesh openmesh_simplified(const TriMesh& mesh, std::size_t n_faces, double& seconds);

#ifdef TAIHU_HAS_MESHOPTIMIZER
TriMesh meshoptimizer_simplified(const TriMesh& mesh, std::size_t n_faces, double& seconds);
#endif

} // namespace taihu
