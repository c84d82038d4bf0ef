#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "stats/core/tri_mesh.h"
#include "vdb_ops/mesh_diagnosis.h"

namespace taihu {

/// A mesh welded, turned to one side and capped: its signed edge count is balanced everywhere.
/// Shells are sets of faces connected over edges, numbered by their first face.
struct RepairedMesh {
    std::vector<Vec3> positions;         ///< [m], welded, with those of caps
    std::vector<Triangle> triangles;     ///< in the order given, then caps
    std::size_t n_given = 0;             ///< triangles that are no caps
    std::vector<std::uint32_t> shell_of; ///< one per triangle
    std::vector<double> cap_area_m2;     ///< one per shell
    MeshDiagnosis diagnosis;             ///< all but what is said of shells and areas

    /// Those that are no caps.
    std::vector<Triangle> given() const {
        return {triangles.begin(), triangles.begin() + static_cast<std::ptrdiff_t>(n_given)};
    }
};

/// Weld positions, drop faces that are bad or given again, turn neighbours to one side, and close
/// boundary loops.
///
/// Under `loops` and `winding` a loop that is seen whole from its middle, along its area vector,
/// gets a fan, another one ears in that projection. Under `plane` a wall runs along the area vector
/// to the plane through the farthest corner of the loop, and the base lies there: what is ragged
/// becomes flat and nothing is cut away. Where this would more than double the shell, it is a sheet
/// (terrain): its longest loop gets the wall and the base, a twentieth of the shell's diagonal
/// beyond its box.
///
/// Serial but for sorting; O(n log n), ears O(corners^2) up to 4096 corners.
///
/// \param weld_share  corners on open edges are welded within so much of the diagonal; 0 welds
/// equal
///   positions only; nothing: the first of weld_shares() that closes more than half of the open
///   edges, which then were cracks, or 0.
/// \param rule  under `none` open edges stay; diagnosis.n_open_edges counts them.
RepairedMesh repair_mesh(const TriMesh& mesh, std::optional<double> weld_share, CloseRule rule);

/// Tolerances at which cracks are welded, over the diagonal of the mesh: 1e-6, 1e-5, 1e-4.
std::vector<double> weld_shares();

} // namespace taihu
