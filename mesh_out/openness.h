#pragma once
#include <vector>

#include "stats/core/progress.h"
#include "stats/core/tri_mesh.h"

namespace taihu {

struct OpennessSettings {
    int n_rays = 64;    ///< per vertex, 1..4096; 64 leave steps of about 0.02
    double reach_m = 0; ///< what is farther away hides nothing; 0: half the mesh's longest side
};

/// Ambient occlusion: the share of the light of a uniform sky, weighted by its cosine, that reaches
/// each vertex past the mesh itself; 1 on a convex solid, small inside holes. Every vertex sends
/// the same pattern of rays about its normal, so neighbours differ without noise. The same values
/// on any number of threads. Rays by Embree, time O(vertices * n_rays). \param mesh  with unit
/// normals, faces outward. \throws Error bad_argument: no triangle, an index out of range, normals
/// that do not match, a setting out of range; cancelled.
std::vector<float> openness(const TriMesh& mesh, const OpennessSettings& settings = {},
                            Progress* progress = nullptr);

} // namespace taihu
