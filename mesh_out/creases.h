#pragma once
#include <cstddef>

#include "stats/core/tri_mesh.h"

namespace taihu {

struct CreasedMesh {
    TriMesh mesh;                 ///< with unit normals; positions are repeated along creases
    std::size_t n_degenerate = 0; ///< triangles without area, left out
};

/// A mesh with normals for shading: those of the faces round each vertex, weighted by their angles
/// there, as far as edges of two faces turn by less than `crease_deg`. Equal positions are welded
/// first. The same on any number of threads; O(n log n).
/// \param crease_deg  0..180: 0 is flat, 180 smooth everywhere.
/// \throws Error bad_argument: an angle out of range, an index past the last position; bad_input:
/// no triangle with an area.
CreasedMesh with_creases(const TriMesh& mesh, double crease_deg);

} // namespace taihu
