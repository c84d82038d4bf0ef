#pragma once
#include <openvdb/openvdb.h>

#include "stats/core/progress.h"
#include "stats/core/tri_mesh.h"

namespace taihu {

/// The zero surface of a level set as a uniform mesh: about two triangles per surface voxel,
/// closed, 2-manifold, outward, all positions different, no zero-area triangle. OpenVDB's dual
/// mesher (volumeToMesh, adaptivity 0); its quads wind inwards and are turned and split along the
/// diagonal whose middle is nearer to the surface. Not interruptible while OpenVDB works. \param
/// solid  level set: cubic voxels, negative inside, half band >= 2 voxels. \throws Error
/// bad_argument: not a level set, or nothing inside it; numeric: the surface leaves
///   the narrow band (a clipped grid), or the mesh did not come out closed.
TriMesh extract_uniform(const openvdb::FloatGrid& solid, Progress* progress = nullptr);

/// Unit normals at `points` from the gradient of the level set (trilinear, central differences).
std::vector<Vec3> surface_normals(const openvdb::FloatGrid& solid, const std::vector<Vec3>& points);

} // namespace taihu
