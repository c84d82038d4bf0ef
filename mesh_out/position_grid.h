#pragma once
#include <optional>

#include "stats/core/tri_mesh.h"

namespace taihu {

/// The lattice that positions of a written level lie on: origin + q * step, 0 <= q < 2^bits.
/// Steps are powers of two and origins multiples of the step, so every point is exact in float,
/// levels nest (step x 2^j), and two files with one step share their points.
struct PositionGrid {
    Vec3 origin;       ///< [m], a multiple of the step on each axis
    double step_m = 0; ///< a power of two [m]
    int bits = 0;      ///< 1..18, the limit that decoders are known to read

    friend bool operator==(const PositionGrid&, const PositionGrid&) = default;
};

/// The grid for `box` whose rounding moves no point farther than `max_move_m`: the largest power of
/// two with step * sqrt(3) / 2 <= max_move_m. `origin_step_m` >= the step, a power of two, is what
/// the origin is a multiple of (the coarsest level's step, so that grids of a chain nest).
/// \throws Error numeric when that needs more than 18 bits, or points that float cannot hold
/// exactly
///         (too far from the origin); the message names the finest step that fits.
PositionGrid position_grid(const Box& box, double max_move_m, double origin_step_m = 0);

/// The grid of the finest step that 18 bits hold for `box`. \throws Error as position_grid().
PositionGrid finest_grid(const Box& box);

/// The coarsest grid that all positions of `mesh` are on, if it needs no more than 18 bits.
std::optional<PositionGrid> grid_of(const TriMesh& mesh);

struct SnapResult {
    TriMesh mesh;                ///< positions on the grid, all different, no zero-area triangle
    std::size_t n_collapsed = 0; ///< edges collapsed because their ends met
    std::size_t n_moved = 0;     ///< vertices moved one step so as not to meet another
    double max_move_m = 0;       ///< farthest that any vertex went [m]
};

/// Move each vertex of a closed 2-manifold to the nearest grid point. Where two meet, their edge is
/// collapsed if the surface stays a 2-manifold, else one moves to a free neighbouring point; the
/// same for triangles that would lose their area. Welding equal positions afterwards changes
/// nothing. \throws Error numeric when no arrangement was found (a grid far too coarse for the
/// mesh).
SnapResult snap_to_grid(const TriMesh& mesh, const PositionGrid& grid);

} // namespace taihu
