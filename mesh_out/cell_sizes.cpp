#include "mesh_out/cell_sizes_detail.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace taihu {
namespace {

using openvdb::Coord;

/// The edges of a cell as first corners, times its size, and axes.
struct CellEdge {
    int x, y, z, axis;
};
constexpr std::array<CellEdge, 12> kEdges = {{{0, 0, 0, 0},
                                              {0, 0, 1, 0},
                                              {0, 1, 0, 0},
                                              {0, 1, 1, 0},
                                              {0, 0, 0, 1},
                                              {0, 0, 1, 1},
                                              {1, 0, 0, 1},
                                              {1, 0, 1, 1},
                                              {0, 0, 0, 2},
                                              {0, 1, 0, 2},
                                              {1, 0, 0, 2},
                                              {1, 1, 0, 2}}};

/// One block, for one thread.
class BlockSizes {
public:
    BlockSizes(CellBlock& block, const SurfacePoints& points, const CellSizeSettings& settings)
        : block_(block), points_(points), settings_(settings) {
        place_.fill(-1);
    }

    void join(std::uint32_t number, const SmallCells& small) {
        std::uint64_t passed = 0;
        for (unsigned i = 0; i < 64; ++i) {
            const Coord c(int(i >> 4) * 2, int(i >> 2 & 3) * 2, int(i & 3) * 2);
            if (!is_passed(block_, c, 2))
                continue;
            passed |= std::uint64_t{1} << i;
            if (may_join(c, 2, number, small))
                block_.twos |= std::uint64_t{1} << i;
        }
        for (unsigned i = 0; i < 8 && settings_.most >= 4; ++i) {
            const Coord c(int(i >> 2) * 4, int(i >> 1 & 1) * 4, int(i & 1) * 4);
            std::uint64_t parts = 0;
            for (int k = 0; k < 8; ++k)
                parts |= std::uint64_t{1}
                         << (((c.x() / 2 + (k >> 2)) * 4 + c.y() / 2 + (k >> 1 & 1)) * 4 +
                             c.z() / 2 + (k & 1));
            if ((parts & passed) != 0 && (parts & passed & ~block_.twos) == 0 &&
                may_join(c, 4, number, small))
                block_.fours = static_cast<std::uint8_t>(block_.fours | 1u << i);
        }
    }

    /// What was found, by key.
    std::vector<std::pair<std::uint16_t, Crossing>> known() const {
        std::vector<std::pair<std::uint16_t, Crossing>> all;
        for (std::size_t key = 0; key < place_.size(); ++key)
            if (place_[key] >= 0)
                all.emplace_back(static_cast<std::uint16_t>(key),
                                 found_[static_cast<std::size_t>(place_[key])]);
        return all;
    }

private:
    bool may_join(const Coord& c, int size, std::uint32_t number, const SmallCells& small) {
        const std::uint64_t name = std::uint64_t{number} * 512 + CellBlocks::number(c);
        return is_simple(block_, c, size) && !small.contains(name * 8 + unsigned(size)) &&
               fits(c, size);
    }

    /// The one voxel edge of a cell's edge that the surface passes.
    Crossing crossing(Coord voxel, int axis) {
        const bool in = block_.in(voxel);
        Coord next = voxel;
        for (++next[axis]; block_.in(next) == in; ++next[axis])
            voxel = next;
        if (voxel.x() > 7 || voxel.y() > 7 || voxel.z() > 7) // the next block's
            return points_.on_edge(block_.origin + voxel, axis);
        std::int16_t& place =
            place_[static_cast<std::size_t>(axis * 512 + CellBlocks::number(voxel))];
        if (place < 0) {
            place = static_cast<std::int16_t>(found_.size());
            found_.push_back(points_.on_edge(block_.origin + voxel, axis));
        }
        return found_[static_cast<std::size_t>(place)];
    }

    bool fits(const Coord& c, int size) {
        std::array<Crossing, 12> all;
        std::size_t n = 0;
        PrimitiveSet labels;
        for (const CellEdge& e : kEdges) {
            const Coord from = c.offsetBy(e.x * size, e.y * size, e.z * size);
            Coord to = from;
            to[e.axis] += size;
            if (block_.in(from) == block_.in(to))
                continue;
            all[n] = crossing(from, e.axis);
            if (!all[n].known)
                return false;
            labels.add(all[n++].primitive);
            if (labels.size() > 2)
                return false;
        }
        const double bound = settings_.bound_vox * points_.voxel_m();
        for (std::size_t i = 0; i < n; ++i)
            for (std::size_t k = i + 1; k < n; ++k) {
                if (all[i].primitive != all[k].primitive)
                    continue;
                const double turn = length(all[i].normal - all[k].normal);
                // Of an arc, the height over its chord is chord * turn / 8.
                if (turn > 1 || turn * length(all[i].point - all[k].point) > 8 * bound)
                    return false;
            }
        return holds(std::span<const Crossing>(all.data(), n), labels, c, size, bound);
    }

    /// Whether there is a vertex in the cell, and the surface between it and its edges is near.
    bool holds(std::span<const Crossing> crossings, const PrimitiveSet& labels, const Coord& c,
               int size, double bound) {
        Box cell;
        cell.include(points_.voxel(block_.origin + c));
        cell.include(points_.voxel(block_.origin + c.offsetBy(size)));
        const LabelledPoint vertex = points_.place(crossings, cell, 0);
        if (!(vertex.labels == labels) || !points_.is_on(vertex.point))
            return false;
        if (labels.size() == 2 && !rim_is_straight(labels, vertex.point, size, bound))
            return false;
        return std::all_of(crossings.begin(), crossings.end(), [&](const Crossing& x) {
            const Vec3 middle = (x.point + vertex.point) * 0.5;
            return std::fabs(points_.field().at(middle).value_m) <= 0.5 * bound;
        });
    }

    /// Whether its tangent is near to it as far as the cell's faces.
    bool rim_is_straight(const PrimitiveSet& labels, const Vec3& p, int size, double bound) const {
        const FieldProbe& field = points_.field();
        const double half = 0.5 * size * points_.voxel_m();
        const Vec3 way =
            normalized(cross(field.of(labels[0], p).gradient, field.of(labels[1], p).gradient));
        for (const double by : {-half, half}) {
            const Vec3 on_tangent = p + way * by;
            const auto on_rim = onto(field, labels, on_tangent, half);
            if (!on_rim || length(*on_rim - on_tangent) > bound)
                return false;
        }
        return true;
    }

    CellBlock& block_;
    const SurfacePoints& points_;
    CellSizeSettings settings_;
    std::array<std::int16_t, 1536> place_; ///< in found_, by key
    std::vector<Crossing> found_;
};

} // namespace

KnownCrossings choose_cell_sizes(CellBlocks& blocks, const SurfacePoints& points,
                                 const CellSizeSettings& settings, const SmallCells& small,
                                 Progress* progress) {
    KnownCrossings known(blocks.size());
    if (settings.most < 2)
        return known;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.size(), 16), [&](const auto& r) {
        check_cancelled(progress);
        const SurfacePoints own = points; // for one thread each
        for (std::size_t b = r.begin(); b < r.end(); ++b) {
            blocks[b].twos = 0;
            blocks[b].fours = 0;
            BlockSizes sizes(blocks[b], own, settings);
            sizes.join(static_cast<std::uint32_t>(b), small);
            known[b] = sizes.known();
        }
    });
    balance(blocks);
    return known;
}

Crossing crossing_on(const CellBlocks& blocks, const SurfacePoints& points,
                     const KnownCrossings& known, std::uint32_t block, std::uint16_t key) {
    const auto& in = known[block];
    const auto it = std::lower_bound(in.begin(), in.end(), key,
                                     [](const auto& a, std::uint16_t k) { return a.first < k; });
    if (it != in.end() && it->first == key)
        return it->second;
    return points.on_edge(blocks[block].origin + CellBlocks::local(key % 512), key / 512);
}

} // namespace taihu
