#pragma once
#include <span>
#include <vector>

#include "stats/core/sphere.h"
#include "stats/core/tri_mesh.h"
#include "vdb_ops/field_probe.h"

namespace taihu {

/// What a level on coarser voxels is held to of the surface that it stands for.
struct HeldSurface {
    TriMesh mesh; ///< the faces that the coarser solid left open, and points of those partly open
    std::vector<Vec3> shut; ///< points of the others, on ways into holes that are not in `closed`
};

/// Faces are dropped of which a corner lies deeper than `deep_m` in the coarser solid.
/// \param coarse  the surface of that solid, its field `grown`; `closed` are the holes that it
/// filled. Points of faces are taken half a bound apart. The same on any number of threads.
HeldSurface held_surface(const TriMesh& surface, const TriMesh& coarse, const FieldProbe& grown,
                         std::span<const Sphere> closed, double deep_m, double bound_m);

} // namespace taihu
