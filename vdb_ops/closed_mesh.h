#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "stats/core/progress.h"
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

/// A set of faces connected over edges.
struct Shell {
    enum class Role {
        solid,  ///< adds its inside
        cavity, ///< opposite orientation inside a larger shell: removes its inside
        sheet   ///< has no inside; left out
    };
    Role role = Role::solid;
    std::size_t n_faces = 0; ///< caps included
    double volume_m3 = 0;    ///< signed as the faces are turned
    double area_m2 = 0;      ///< caps included
    double cap_area_m2 = 0;
    Box box;
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

/// A mesh whose signed edge count is balanced everywhere, so that its winding number is an integer.
struct ClosedMesh {
    std::vector<Vec3> positions;         ///< [m], welded
    std::vector<Triangle> triangles;     ///< sorted by shell, sheets left out
    std::vector<std::uint32_t> shell_of; ///< one per triangle
    std::vector<Shell> shells;           ///< from the largest volume to the smallest
    MeshDiagnosis diagnosis;
};

/// Make a solid of any triangle mesh, or refuse it by name: weld equal positions, drop duplicates,
/// turn neighbours to one side, split into shells, cap boundary loops, leave sheets out. When
/// nothing has an inside, cracks are welded at 1e-6, 1e-5 and 1e-4 of the diagonal. Serial but for
/// sorting; O(n log n), loops O(length^2) in the worst case. \param where  stands for the mesh in
/// messages. \throws Error bad_input: no face at all, open edges under CloseRule::none, or no shell
/// with an
///   inside (a sheet: caps above 45 % of its area, or no volume).
ClosedMesh close_mesh(const TriMesh& mesh, const std::string& where,
                      CloseRule rule = CloseRule::loops, Progress* progress = nullptr);

} // namespace taihu
