#pragma once
#include <cstddef>

#include "stats/core/progress.h"
#include "stats/core/tri_mesh.h"

namespace taihu {

struct SimplifySettings {
    double bound_m = 0; ///< no point may lie farther from the reference than this [m], > 0
    std::size_t min_triangles = 4;   ///< stop there
    double max_normal_turn_deg = 60; ///< a face may turn by less than this in one collapse, (0, 90]
};

/// Fewer triangles within a distance bound: half-edge collapses on OpenMesh's half-edge mesh in the
/// order of its quadrics, each accepted only if samples of every new face lie within the bound of
/// `reference` by closest point, the vertices and edge middles of the reference nearby lie within
/// the bound of the new faces, no face turns too far, and the surface stays a 2-manifold of the
/// same genus. Vertices stay where they are. Samples can miss a face's worst point by some per
/// cent: measure with two_sided_distance(). Blocks are worked on in parallel; the same mesh on any
/// number of threads. \param mesh  closed 2-manifold; \param reference  the surface that the bound
/// refers to. \throws Error bad_argument: a setting out of range, a mesh that is not a closed
/// 2-manifold; cancelled.
TriMesh simplify(const TriMesh& mesh, const TriMesh& reference, const SimplifySettings& settings,
                 Progress* progress = nullptr);

} // namespace taihu
