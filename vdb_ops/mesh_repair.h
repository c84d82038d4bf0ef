#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "stats/core/tri_mesh.h"

namespace taihu {

/// What to do with the open edges of a mesh.
enum class CloseRule {
    loops, ///< cap each boundary loop with a fan, and say so
    none   ///< refuse
};

/// A boundary loop that was capped.
struct CappedLoop {
    std::size_t n_edges = 0;
    Vec3 center; ///< mean of its edges, weighted by length [m]
    double perimeter_m = 0;
};

/// Everything that was found in a mesh on the way to a solid; nothing is repaired in silence.
struct MeshDiagnosis {
    std::size_t n_faces = 0;             ///< given
    std::size_t n_bad = 0;               ///< dropped: non-finite position or index out of range
    std::size_t n_repeated = 0;          ///< dropped: a corner twice, after welding
    std::size_t n_duplicate = 0;         ///< dropped: the same face again
    std::size_t n_opposite_pairs = 0;    ///< the same face from both sides
    bool two_sided = false;              ///< nearly all faces are given from both sides: one kept
    std::size_t n_open_edges = 0;        ///< edges of one face
    std::size_t n_nonmanifold_edges = 0; ///< edges of three faces or more
    std::size_t n_flipped_edges = 0;     ///< neighbours that disagreed on the side: made consistent
    std::size_t n_one_sided = 0;         ///< edges where that cannot be done (Moebius)
    std::size_t n_solids = 0, n_cavities = 0, n_sheets = 0;
    std::size_t n_inverted = 0; ///< solids whose faces pointed inwards
    double sheet_area_m2 = 0, area_m2 = 0, cap_area_m2 = 0;
    double weld_tolerance_m = 0; ///< 0: only equal positions were welded
    std::vector<CappedLoop> loops;

    /// One line for each thing that a user should know; empty for a clean closed mesh.
    std::vector<std::string> lines() const;
};

/// A mesh welded, turned to one side and capped: its signed edge count is balanced everywhere.
/// Shells are sets of faces connected over edges, numbered by their first face.
struct RepairedMesh {
    std::vector<Vec3> positions;         ///< [m], welded, with the middles of caps
    std::vector<Triangle> triangles;     ///< in the order given, then caps
    std::vector<std::uint32_t> shell_of; ///< one per triangle
    std::vector<double> cap_area_m2;     ///< one per shell
    MeshDiagnosis diagnosis;             ///< all but what is said of shells and areas
};

/// Weld positions, drop faces that are bad or given again, turn neighbours to one side, and cap
/// boundary loops with fans. Serial but for sorting; O(n log n), loops O(length^2) in the worst
/// case.
///
/// \param weld_tolerance_m  0 welds equal positions only.
/// \param rule  under `none` open edges stay; diagnosis.n_open_edges counts them.
RepairedMesh repair_mesh(const TriMesh& mesh, double weld_tolerance_m, CloseRule rule);

} // namespace taihu
