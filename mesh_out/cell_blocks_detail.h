#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include <openvdb/openvdb.h>

#include "stats/core/progress.h"

namespace taihu {

/// A cube of 8^3 voxel cells that the surface passes. Cell (i, j, k) has its lower corner in voxel
/// origin + (i, j, k) and its upper one in the next. Cells may be joined to cubes of 2 or 4.
struct CellBlock {
    openvdb::Coord origin;
    std::array<std::uint64_t, 12> inside{}; ///< of the 9^3 corners, z fastest
    std::uint64_t twos = 0;                 ///< bit (i * 4 + j) * 4 + k: a cell of 2^3
    std::uint8_t fours = 0;                 ///< bit (i * 2 + j) * 2 + k: a cell of 4^3
    /// Blocks at origin - 8 * (i, j, k), number 4i + 2j + k, the first being itself; -1: none.
    std::array<std::int32_t, 8> below{};

    bool in(int x, int y, int z) const {
        const auto i = static_cast<unsigned>((x * 9 + y) * 9 + z);
        return (inside[i / 64] >> (i % 64) & 1) != 0;
    }
    bool in(const openvdb::Coord& c) const { return in(c.x(), c.y(), c.z()); }
    /// The 9 corners along z.
    unsigned row(int x, int y) const {
        const auto i = static_cast<unsigned>((x * 9 + y) * 9);
        std::uint64_t bits = inside[i / 64] >> (i % 64);
        if (i % 64 > 55)
            bits |= inside[i / 64 + 1] << (64 - i % 64);
        return static_cast<unsigned>(bits & 0x1ff);
    }
    /// The cell that voxel cell c of the block is part of: its first voxel cell, and its size.
    int size_at(const openvdb::Coord& c) const {
        if (fours >> ((c.x() / 4 * 2 + c.y() / 4) * 2 + c.z() / 4) & 1)
            return 4;
        return (twos >> ((c.x() / 2 * 4 + c.y() / 2) * 4 + c.z() / 2) & 1) != 0 ? 2 : 1;
    }
    /// Corners of the cell of that size that begins at c; bit 4x + 2y + z.
    unsigned corners(const openvdb::Coord& c, int size) const {
        unsigned bits = 0;
        for (int k = 0; k < 8; ++k)
            bits |= static_cast<unsigned>(in(c.x() + (k >> 2) * size, c.y() + (k >> 1 & 1) * size,
                                             c.z() + (k & 1) * size))
                    << k;
        return bits;
    }
};

/// A cell of an octree whose leaves are 1, 2 or 4 voxels large.
struct CellRef {
    std::uint32_t block = 0;
    std::uint16_t first = 0; ///< its first voxel cell in the block, z fastest
    std::uint8_t size = 1;
    friend bool operator==(const CellRef&, const CellRef&) = default;
};

/// The blocks that the zero surface of a level set passes, in the order of their origins.
class CellBlocks {
public:
    /// \param given  blocks with voxels outside of it are left out.
    CellBlocks(const openvdb::FloatGrid& solid, const openvdb::CoordBBox& given,
               Progress* progress);

    std::size_t size() const { return blocks_.size(); }
    CellBlock& operator[](std::size_t i) { return blocks_[i]; }
    const CellBlock& operator[](std::size_t i) const { return blocks_[i]; }
    /// The block that a voxel cell is in; nothing when the surface does not pass it.
    std::optional<std::uint32_t> find(const openvdb::Coord& cell) const;
    /// The cell that holds a voxel cell at c of a block, whose parts may be -1, in the next one.
    std::optional<CellRef> cell(std::size_t block, const openvdb::Coord& c) const;

    static openvdb::Coord local(int cell) { return {cell >> 6, cell >> 3 & 7, cell & 7}; }
    static std::uint16_t number(const openvdb::Coord& c) {
        return static_cast<std::uint16_t>((c.x() * 8 + c.y()) * 8 + c.z());
    }

private:
    std::vector<CellBlock> blocks_;
    std::unordered_map<openvdb::Coord, std::uint32_t> index_;
};

/// Whether a cube of voxel cells may be one cell: its edges are passed at most once each, the
/// surface is one disk in it, and no face of it, halved or not, is passed in an ambiguous way. For
/// a cell of 4 this looks at every other corner: its eighths must be such cells themselves, or not
/// be passed.
bool is_simple(const CellBlock& block, const openvdb::Coord& first, int size);

/// Whether the surface passes between any corners of the cube of voxel cells.
bool is_passed(const CellBlock& block, const openvdb::Coord& first, int size);

/// Makes cells of 2 of those of 4 that have a cell of 1 beside them.
void balance(CellBlocks& blocks);

} // namespace taihu
