#include "mesh_out/cell_blocks_detail.h"

#include <algorithm>
#include <bit>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "mesh_out/cell_loops_detail.h"

namespace taihu {
namespace {

using openvdb::Coord;
using Leaf = openvdb::FloatTree::LeafNodeType;
constexpr int kBlock = 8;

/// The inside of 9^3 voxels; true when some are and some are not.
bool load(const openvdb::FloatTree& tree, CellBlock& block) {
    std::array<unsigned, 81> rows{};
    for (int part = 0; part < 8; ++part) {
        const Coord shift((part >> 2) * kBlock, (part >> 1 & 1) * kBlock, (part & 1) * kBlock);
        const Coord origin = block.origin + shift;
        const Leaf* leaf = tree.probeConstLeaf(origin);
        const bool tile = !leaf && tree.getValue(origin) < 0;
        if (!leaf && !tile)
            continue;
        const int n_x = (part >> 2) ? 1 : kBlock, n_y = (part >> 1 & 1) ? 1 : kBlock,
                  n_z = (part & 1) ? 1 : kBlock;
        for (int x = 0; x < n_x; ++x)
            for (int y = 0; y < n_y; ++y) {
                unsigned bits = tile ? (1u << n_z) - 1 : 0;
                if (leaf) {
                    const float* values = leaf->buffer().data() + (x * 8 + y) * 8;
                    for (int z = 0; z < n_z; ++z)
                        bits |= static_cast<unsigned>(values[z] < 0) << z;
                }
                rows[static_cast<std::size_t>((x + shift.x()) * 9 + y + shift.y())] |= bits
                                                                                       << shift.z();
            }
    }
    unsigned any = 0, all = 0x1ff;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        any |= rows[i];
        all &= rows[i];
        const std::size_t at = 9 * i;
        block.inside[at / 64] |= std::uint64_t{rows[i]} << (at % 64);
        if (at % 64 > 55)
            block.inside[at / 64 + 1] |= std::uint64_t{rows[i]} >> (64 - at % 64);
    }
    return any != 0 && all != 0x1ff;
}

/// Patterns of 3 x 3 samples on a face that one arc or none passes.
class SimpleFaces {
public:
    SimpleFaces() {
        for (unsigned p = 0; p < 512; ++p)
            simple_[p] = is_simple(p);
    }
    bool operator[](unsigned pattern) const { return simple_[pattern]; }

private:
    static bool is_simple(unsigned p) {
        const auto at = [p](int x, int y) { return (p >> (3 * x + y) & 1) != 0; };
        const auto alternate = [&](int x, int y, int step) {
            return at(x, y) == at(x + step, y + step) && at(x + step, y) == at(x, y + step) &&
                   at(x, y) != at(x + step, y);
        };
        if (alternate(0, 0, 1) || alternate(1, 0, 1) || alternate(0, 1, 1) || alternate(1, 1, 1) ||
            alternate(0, 0, 2))
            return false;
        static constexpr int kRing[8][2] = {{0, 0}, {0, 1}, {0, 2}, {1, 2},
                                            {2, 2}, {2, 1}, {2, 0}, {1, 0}};
        int n_changes = 0;
        for (int k = 0; k < 8; ++k) {
            const bool one = at(kRing[k][0], kRing[k][1]),
                       next = at(kRing[(k + 1) % 8][0], kRing[(k + 1) % 8][1]);
            n_changes += one != next;
            const bool corner = k % 2 == 0; // an edge whose ends are alike and the middle is not
            const bool last = at(kRing[(k + 2) % 8][0], kRing[(k + 2) % 8][1]);
            if (corner && one == last && next != one)
                return false;
        }
        return n_changes == 2 || (n_changes == 0 && at(1, 1) == at(0, 0));
    }
    std::array<bool, 512> simple_;
};

} // namespace

CellBlocks::CellBlocks(const openvdb::FloatGrid& solid, const openvdb::CoordBBox& given,
                       Progress* progress) {
    const openvdb::FloatTree& tree = solid.tree();
    std::vector<Coord> origins;
    // Cells that reach into a leaf from below begin in other blocks.
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf)
        for (int k = 0; k < 8; ++k)
            origins.push_back(leaf->origin().offsetBy(-(k >> 2) * kBlock, -(k >> 1 & 1) * kBlock,
                                                      -(k & 1) * kBlock));
    tbb::parallel_sort(origins.begin(), origins.end());
    origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
    std::erase_if(origins, [&](const Coord& c) {
        return !given.isInside(c) || !given.isInside(c.offsetBy(kBlock));
    });
    check_cancelled(progress);
    std::vector<CellBlock> all(origins.size());
    std::vector<char> passed(origins.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, origins.size(), 64), [&](const auto& r) {
        for (std::size_t i = r.begin(); i < r.end(); ++i) {
            all[i].origin = origins[i];
            passed[i] = load(tree, all[i]);
        }
    });
    for (std::size_t i = 0; i < all.size(); ++i)
        if (passed[i])
            blocks_.push_back(all[i]);
    index_.reserve(blocks_.size());
    for (std::uint32_t i = 0; i < blocks_.size(); ++i)
        index_.emplace(blocks_[i].origin, i);
    for (CellBlock& b : blocks_)
        for (int k = 0; k < 8; ++k) {
            const auto found = find(
                b.origin.offsetBy(-(k >> 2) * kBlock, -(k >> 1 & 1) * kBlock, -(k & 1) * kBlock));
            b.below[static_cast<std::size_t>(k)] = found ? static_cast<std::int32_t>(*found) : -1;
        }
}

std::optional<std::uint32_t> CellBlocks::find(const Coord& cell) const {
    const auto it = index_.find(Coord(cell.x() & -kBlock, cell.y() & -kBlock, cell.z() & -kBlock));
    if (it == index_.end())
        return std::nullopt;
    return it->second;
}

std::optional<CellRef> CellBlocks::cell(std::size_t block, const Coord& c) const {
    const int part = (c.x() < 0) << 2 | (c.y() < 0) << 1 | (c.z() < 0);
    const std::int32_t in = blocks_[block].below[static_cast<std::size_t>(part)];
    if (in < 0)
        return std::nullopt;
    const Coord own(c.x() & 7, c.y() & 7, c.z() & 7);
    const int size = blocks_[static_cast<std::size_t>(in)].size_at(own);
    return CellRef{static_cast<std::uint32_t>(in),
                   number({own.x() & -size, own.y() & -size, own.z() & -size}),
                   static_cast<std::uint8_t>(size)};
}

bool is_passed(const CellBlock& block, const Coord& first, int size) {
    const unsigned along_z = (2u << size) - 1;
    unsigned any = 0, all = along_z;
    for (int x = 0; x <= size; ++x)
        for (int y = 0; y <= size; ++y) {
            const unsigned row = block.row(first.x() + x, first.y() + y) >> first.z();
            any |= row & along_z;
            all &= row;
        }
    return any != 0 && all != along_z;
}

bool is_simple(const CellBlock& block, const Coord& first, int size) {
    static const SimpleFaces simple_faces;
    const int step = size / 2;
    const auto at = [&](int x, int y, int z) {
        return block.in(first.x() + x * step, first.y() + y * step, first.z() + z * step);
    };
    bool middle_joined = false;
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side <= 2; side += 2) {
            unsigned pattern = 0;
            for (int u = 0; u < 3; ++u)
                for (int v = 0; v < 3; ++v) {
                    const bool in = axis == 0   ? at(side, u, v)
                                    : axis == 1 ? at(v, side, u)
                                                : at(u, v, side);
                    pattern |= static_cast<unsigned>(in) << (3 * u + v);
                }
            if (!simple_faces[pattern])
                return false;
            middle_joined = middle_joined || ((pattern >> 4 & 1) != 0) == at(1, 1, 1);
        }
    return middle_joined && cell_loops(block.corners(first, size), 0).n == 1;
}

void balance(CellBlocks& blocks) {
    std::vector<std::uint8_t> kept(blocks.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.size(), 64), [&](const auto& r) {
        for (std::size_t b = r.begin(); b < r.end(); ++b) {
            kept[b] = blocks[b].fours;
            for (int four = 0; four < 8; ++four) {
                if (!(kept[b] >> four & 1))
                    continue;
                const Coord first =
                    blocks[b].origin.offsetBy((four >> 2) * 4, (four >> 1 & 1) * 4, (four & 1) * 4);
                bool even = true; // nothing around it is finer than 2
                for (int k = 0; k < 64 && even; ++k) {
                    const Coord at =
                        first.offsetBy((k >> 4) * 2 - 2, (k >> 2 & 3) * 2 - 2, (k & 3) * 2 - 2);
                    const auto in = blocks.find(at);
                    if (!in)
                        continue;
                    const CellBlock& other = blocks[*in];
                    const Coord local = at - other.origin;
                    even = other.size_at(local) > 1 || !is_passed(other, local, 2);
                }
                if (!even)
                    kept[b] = static_cast<std::uint8_t>(kept[b] & ~(1u << four));
            }
        }
    });
    for (std::size_t b = 0; b < blocks.size(); ++b)
        blocks[b].fours = kept[b];
}

} // namespace taihu
