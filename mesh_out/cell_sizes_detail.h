#pragma once
#include <cstdint>
#include <optional>
#include <unordered_set>
#include <utility>
#include <vector>

#include "mesh_out/cell_blocks_detail.h"
#include "mesh_out/surface_points_detail.h"

namespace taihu {

struct CellSizeSettings {
    int most = 4;          ///< 1, 2 or 4 voxels
    double bound_vox = .1; ///< chords between the cells' vertices may be so far off the surface
};

/// Crossings that were found on the way, by block; sorted by key, which is that of
/// DualSurface::Edge.
using KnownCrossings = std::vector<std::vector<std::pair<std::uint16_t, Crossing>>>;

/// Cells that are not to be, whatever the surface in them: (block * 512 + first voxel cell) * 8 +
/// size.
using SmallCells = std::unordered_set<std::uint64_t>;

/// Joins voxel cells where the surface is one face in them, or one rim between two, that a cell of
/// that size can hold; then balances.
KnownCrossings choose_cell_sizes(CellBlocks& blocks, const SurfacePoints& points,
                                 const CellSizeSettings& settings, const SmallCells& small,
                                 Progress* progress);

/// The crossing on an edge of a block, looked up or found.
Crossing crossing_on(const CellBlocks& blocks, const SurfacePoints& points,
                     const KnownCrossings& known, std::uint32_t block, std::uint16_t key);

} // namespace taihu
