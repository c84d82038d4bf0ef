#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "mesh_out/labelled_mesh.h"
#include "stats/core/progress.h"
#include "stats/core/sphere.h"

namespace taihu {

/// Distances between a mesh and the surface of a field, both ways.
struct FieldDistance {
    double max_m = 0; ///< the greater of the two maxima
    double max_to_field_m = 0, max_from_field_m = 0;
    double rms_m = 0;       ///< the greater of the two root mean squares
    double max_apart_m = 0; ///< the greatest beyond the limit, within the balls kept apart
    Vec3 worst;             ///< where max_m was found
    std::size_t n_samples = 0;
    std::vector<Vec3> beyond; ///< samples farther than the limit that are not kept apart
};

/// To the field: from vertices and regular patterns on edges and faces, so that no point of a face
/// is farther than about `spacing_m` from one, to the nearest point of the primitives that are
/// active there (never |value|, which is less than the distance beyond rims); where that leads
/// nowhere, to the one beside the nearest point of `surface`. From the field: from the vertices of
/// `surface`. Deterministic on any number of threads. \param surface  a fine mesh of the field
/// whose vertices lie on it, as extract() makes. \param limit_m  see `beyond`. \param apart samples
/// within these balls count for max_apart_m alone. \throws Error bad_argument: an empty mesh, a
/// spacing below 1e-5 of it; cancelled.
FieldDistance field_distance(const TriMesh& mesh, const FieldProbe& field, const TriMesh& surface,
                             double spacing_m, double limit_m, std::span<const Sphere> apart = {},
                             Progress* progress = nullptr);

} // namespace taihu
