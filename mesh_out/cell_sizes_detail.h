#pragma once
#include <cstdint>
#include <unordered_set>

#include "mesh_out/cell_blocks_detail.h"

namespace taihu {

struct CellSizeSettings {
    int most = 4;          ///< 1, 2 or 4 voxels
    double bound_vox = .1; ///< chords between the cells' vertices may be so far off the surface
};

/// Cells that are not to be, whatever the surface in them: (block * 512 + first voxel cell) * 8 +
/// size.
using SmallCells = std::unordered_set<std::uint64_t>;

/// The cube of `size` that a cell is in.
inline std::uint64_t small_cell(const CellRef& cell, int size) {
    const auto c = CellBlocks::local(cell.first);
    const auto first = CellBlocks::number({c.x() & -size, c.y() & -size, c.z() & -size});
    return (std::uint64_t{cell.block} * 512 + first) * 8 + static_cast<unsigned>(size);
}

/// Joins voxel cells where the surface is one face in them that bends so little that a cell of that
/// size can hold it; then balances. The values of the grid tell: between voxels beside the surface
/// their second differences are its curvature, and jump where it has a rim or another one is near.
void choose_cell_sizes(CellBlocks& blocks, const openvdb::FloatGrid& solid,
                       const CellSizeSettings& settings, const SmallCells& small,
                       Progress* progress);

} // namespace taihu
