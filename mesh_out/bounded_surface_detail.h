#pragma once
#include <cstdint>
#include <vector>

#include "mesh_out/bounded_simplify.h"
#include "mesh_out/corner_table_detail.h"
#include "mesh_out/face_error_detail.h"

namespace taihu {

/// A simplified surface while it is balanced, checked and repaired.
struct BoundedSurface {
    CornerTable table;
    std::vector<Vec3> exact;     ///< where each vertex lies on the solid's surface
    std::vector<Vec3> positions; ///< where it was moved to
    std::vector<std::uint32_t> labels;
    FaceErrors& errors;
    double bound_m = 0, spacing_m = 0;
    std::vector<std::uint8_t> kept;  ///< per vertex of the start: not moved, its faces not split
    std::vector<double> face_errors; ///< as far as repair() went by them; empty before
    std::vector<std::uint8_t> dirty; ///< faces that it looks at first; empty for all

    FaceErrors::Corners corners(std::size_t face) const {
        const Triangle t = table.triangle(face);
        return {positions[t[0]], positions[t[1]], positions[t[2]]};
    }
    FaceErrors::Labels labels_of(std::size_t face) const {
        const Triangle t = table.triangle(face);
        return {labels[t[0]], labels[t[1]], labels[t[2]]};
    }
    /// An upper bound of the distance of a face, infinite or above the bound when it is not held.
    double error_of(std::size_t face) const;
};

/// Moves vertices along the normals of their primitives so that the values over the faces round
/// them are centred on 0, and back where that would break the bound.
void balance(BoundedSurface& surface);

/// More vertices that stay, where they are exact; false when they all did already.
bool keep(BoundedSurface& surface, const std::vector<std::uint8_t>& more);

/// Makes the bound hold and crossings vanish: moved vertices go back, faces are split by new
/// vertices on the solid's surface. What neither mends is named. The surface itself stays and
/// learns what its faces are like, so that after keep() only few are looked at again.
struct Repaired {
    BoundedMesh result;
    std::vector<Sphere> crossings; ///< round faces that still meet others
};
/// \param most_crossings  where more faces still meet there is no result.
Repaired repair(BoundedSurface& surface, std::size_t most_crossings, Progress* progress);

} // namespace taihu
