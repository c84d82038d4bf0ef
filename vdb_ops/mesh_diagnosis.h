#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "stats/core/vec3.h"

namespace taihu {

/// What to do with the open edges of a mesh.
enum class CloseRule {
    loops,   ///< cap each boundary loop, and say so
    winding, ///< inside is where the winding number of the open surface is above 1/2
    plane,   ///< a wall from each loop out to a plane along it, and a flat base there
    none     ///< refuse
};

/// How shells, sets of faces connected over edges, make one solid.
enum class ShellRule {
    unite, ///< what any of them holds; one turned inward inside a larger one is a cavity
    parity ///< what an odd number of them holds: every shell inside another is a cavity
};

/// How a mesh becomes a solid.
struct CloseSettings {
    CloseRule rule = CloseRule::loops;
    ShellRule shells = ShellRule::unite; ///< not for CloseRule::winding, which counts all at once
};

/// Names of options and recipes: loops, winding, plane, none; union, parity.
/// \throws Error bad_argument: another name, or rules that exclude each other.
CloseSettings close_settings(std::string_view rule, std::string_view shells);
std::string close_rule_name(CloseRule rule);
std::string shell_rule_name(ShellRule rule);

/// A boundary loop that was closed.
struct CappedLoop {
    std::size_t n_edges = 0;
    Vec3 center; ///< mean of its edges, weighted by length [m]
    double perimeter_m = 0;
};

/// Everything that was found in a mesh on the way to a solid; nothing is repaired in silence.
struct MeshDiagnosis {
    CloseRule rule = CloseRule::loops;
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
    std::size_t n_inverted = 0;    ///< solids whose faces pointed inwards
    std::size_t n_overlapping = 0; ///< shells that cross themselves, as columns a 64th apart see
    double sheet_area_m2 = 0, area_m2 = 0, cap_area_m2 = 0;
    double weld_tolerance_m = 0; ///< of corners on open edges; 0: only equal positions were welded
    double weld_share = 0;       ///< the same over the diagonal of the mesh
    std::vector<CappedLoop> loops;
    std::vector<double> thickness_m; ///< one per solid shell: 2 volume / area, a wall's thickness
    double undecided = 0; ///< under `winding`: places between in and out, over those inside

    /// One line for each thing that a user should know; empty for a clean closed mesh.
    /// \param voxel_m  of the level set to be, to name shells that are thinner than two; 0:
    /// unknown.
    std::vector<std::string> lines(double voxel_m = 0) const;
};

} // namespace taihu
