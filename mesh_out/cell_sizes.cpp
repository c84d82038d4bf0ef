#include "mesh_out/cell_sizes_detail.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace taihu {
namespace {

using openvdb::Coord;

/// The values of a grid at the 9^3 corners of a block's cells and one voxel around them.
class BlockValues {
public:
    BlockValues(const openvdb::FloatTree& tree, const Coord& origin) {
        static constexpr std::array<int, 3> kFrom = {7, 0, 0}, kN = {1, 8, 2}, kTo = {0, 1, 9};
        for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t j = 0; j < 3; ++j)
                for (std::size_t k = 0; k < 3; ++k) {
                    const Coord at =
                        origin.offsetBy(int(i) * 8 - 8, int(j) * 8 - 8, int(k) * 8 - 8);
                    const auto* leaf = tree.probeConstLeaf(at);
                    const float* values = leaf ? leaf->buffer().data() : nullptr;
                    const float tile = leaf ? 0 : tree.getValue(at);
                    for (int x = 0; x < kN[i]; ++x)
                        for (int y = 0; y < kN[j]; ++y) {
                            float* to = &all_[index(kTo[i] + x, kTo[j] + y, kTo[k])];
                            if (values)
                                std::copy_n(values + ((kFrom[i] + x) * 8 + kFrom[j] + y) * 8 +
                                                kFrom[k],
                                            kN[k], to);
                            else
                                std::fill_n(to, kN[k], tile);
                        }
                }
    }

    /// How much the surface bends at a corner, over its slope [1 / voxel]: all second differences
    /// together, so that no two of them cancel.
    float bend(int x, int y, int z) const {
        const float* at = &all_[index(x + 1, y + 1, z + 1)];
        const float twice = 2 * at[0];
        std::array<float, 3> pure, slope;
        float sum = 0;
        for (std::size_t a = 0; a < 3; ++a) {
            const float ahead = at[kStep[a]], back = at[-kStep[a]];
            pure[a] = ahead + back - twice;
            slope[a] = (ahead - back) / 2;
            sum += pure[a] * pure[a];
        }
        for (std::size_t a = 0; a < 3; ++a) {
            const std::size_t b = (a + 1) % 3;
            const std::ptrdiff_t step = kStep[a] + kStep[b];
            const float mixed = (at[step] + at[-step] - twice - pure[a] - pure[b]) / 2;
            sum += 2 * mixed * mixed;
        }
        const float slope2 = slope[0] * slope[0] + slope[1] * slope[1] + slope[2] * slope[2];
        return slope2 > 0 ? std::sqrt(sum / slope2) : std::numeric_limits<float>::infinity();
    }

private:
    static constexpr std::array<std::ptrdiff_t, 3> kStep = {121, 11, 1};
    static std::size_t index(int x, int y, int z) {
        return static_cast<std::size_t>((x * 11 + y) * 11 + z);
    }
    std::array<float, 11 * 11 * 11> all_;
};

/// The most bend beside the surface in the cubes of 2^3 voxel cells of a block.
using Bends = std::array<float, 64>;

Bends bends_of(const CellBlock& block, const BlockValues& values) {
    Bends bends{};
    const auto row = [&](int x, int y) {
        return block.row(std::clamp(x, 0, 8), std::clamp(y, 0, 8));
    };
    for (int x = 0; x <= 8; ++x)
        for (int y = 0; y <= 8; ++y) {
            const unsigned own = row(x, y);
            unsigned beside = (own ^ row(x - 1, y)) | (own ^ row(x + 1, y)) |
                              (own ^ row(x, y - 1)) | (own ^ row(x, y + 1));
            const unsigned along = (own ^ own >> 1) & 0xff;
            beside |= along | along << 1;
            for (; beside != 0; beside &= beside - 1) {
                const int z = std::countr_zero(beside);
                const float bend = values.bend(x, y, z);
                for (int i = std::max(x - 1, 0) / 2; i <= std::min(x / 2, 3); ++i)
                    for (int j = std::max(y - 1, 0) / 2; j <= std::min(y / 2, 3); ++j)
                        for (int k = std::max(z - 1, 0) / 2; k <= std::min(z / 2, 3); ++k) {
                            float& most = bends[static_cast<std::size_t>((i * 4 + j) * 4 + k)];
                            most = std::max(most, bend);
                        }
            }
        }
    return bends;
}

void join(CellBlock& block, std::uint32_t number, const Bends& bends,
          const CellSizeSettings& settings, const SmallCells& small) {
    // The chord of an arc is chord^2 / 8 times its bend off it; half of the bound for where the
    // cells' vertices are farther apart than their size.
    const auto may_join = [&](const Coord& c, int size, float bend) {
        return static_cast<double>(bend) * size * size / 8 <= settings.bound_vox / 2 &&
               is_simple(block, c, size) &&
               !small.contains(small_cell({number, CellBlocks::number(c), 1}, size));
    };
    std::uint64_t passed = 0;
    for (unsigned i = 0; i < 64; ++i) {
        const Coord c(int(i >> 4) * 2, int(i >> 2 & 3) * 2, int(i & 3) * 2);
        if (!is_passed(block, c, 2))
            continue;
        passed |= std::uint64_t{1} << i;
        if (may_join(c, 2, bends[i]))
            block.twos |= std::uint64_t{1} << i;
    }
    for (unsigned i = 0; i < 8 && settings.most >= 4; ++i) {
        const Coord c(int(i >> 2) * 4, int(i >> 1 & 1) * 4, int(i & 1) * 4);
        std::uint64_t parts = 0;
        float bend = 0;
        for (int k = 0; k < 8; ++k) {
            const int part =
                ((c.x() / 2 + (k >> 2)) * 4 + c.y() / 2 + (k >> 1 & 1)) * 4 + c.z() / 2 + (k & 1);
            parts |= std::uint64_t{1} << part;
            bend = std::max(bend, bends[static_cast<std::size_t>(part)]);
        }
        if ((parts & passed) != 0 && (parts & passed & ~block.twos) == 0 && may_join(c, 4, bend))
            block.fours = static_cast<std::uint8_t>(block.fours | 1u << i);
    }
}

} // namespace

void choose_cell_sizes(CellBlocks& blocks, const openvdb::FloatGrid& solid,
                       const CellSizeSettings& settings, const SmallCells& small,
                       Progress* progress) {
    if (settings.most < 2)
        return;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.size(), 16), [&](const auto& r) {
        check_cancelled(progress);
        for (std::size_t b = r.begin(); b < r.end(); ++b) {
            blocks[b].twos = 0;
            blocks[b].fours = 0;
            const BlockValues values(solid.tree(), blocks[b].origin);
            join(blocks[b], static_cast<std::uint32_t>(b), bends_of(blocks[b], values), settings,
                 small);
        }
    });
    balance(blocks);
}

} // namespace taihu
