#include "vdb_ops/solids_field.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_sort.h>

#include "vdb_ops/solid_kernels_detail.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
constexpr int kBlock = BlockSampler::kBlock;
constexpr int kLeaf = BlockSampler::kLeaf;
constexpr int kAcross = kBlock / kLeaf;
constexpr std::size_t kLeaves = std::size_t{kAcross} * kAcross * kAcross;
constexpr double kFar = 0x1p30; // voxels; rasterize() refuses what reaches that far

/// From the middle of a cube of `size` voxels to its corner voxels.
double half_diagonal(double size) {
    return 0.5 * (size - 1) * std::sqrt(3.0);
}

/// What the distance in the middle of a cube says of all of it.
Cover cover_of(double middle, double size, double half_width) {
    const double reach = half_width + half_diagonal(size) + 1e-3;
    return middle > reach ? Cover::outside : middle < -reach ? Cover::inside : Cover::surface;
}

Cover cover_of(const VoxelSolid& solid, const Coord& cube, double size, double half_width) {
    const double half = 0.5 * (size - 1);
    const double middle[3] = {cube.x() + half, cube.y() + half, cube.z() + half};
    return cover_of(solid_distance(solid, middle), size, half_width);
}

class SolidsBlock final : public BlockSampler {
public:
    SolidsBlock(const std::vector<VoxelSolid>& solids, const std::vector<std::uint32_t>& near,
                const Coord& block, float half_width)
        : solids_(solids), block_(block), half_width_(half_width), first_(kLeaves + 1, 0),
          inside_(kLeaves, 0) {
        std::vector<std::pair<std::uint32_t, std::uint32_t>> touched; // (leaf, solid)
        for (const std::uint32_t i : near)
            each_leaf(i, [&](std::size_t leaf) {
                touched.emplace_back(static_cast<std::uint32_t>(leaf), i);
            });
        for (const auto& [leaf, i] : touched)
            ++first_[leaf + 1];
        for (std::size_t i = 0; i < kLeaves; ++i)
            first_[i + 1] += first_[i];
        listed_.resize(touched.size());
        std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
        for (const auto& [leaf, i] : touched)
            listed_[next[leaf]++] = i;
    }

    Cover cover(const Coord& leaf) const override {
        const std::size_t i = index(leaf);
        if (inside_[i])
            return Cover::inside;
        return first_[i] == first_[i + 1] ? Cover::outside : Cover::surface;
    }

    void values(const Coord& leaf, float* out) override {
        const std::size_t l = index(leaf);
        const float w = half_width_;
        std::fill(out, out + 512, w);
        for (std::uint32_t k = first_[l]; k < first_[l + 1]; ++k)
            min_solid(solids_[listed_[k]], leaf.data(), half_width_, out);
        for (int i = 0; i < 512; ++i)
            out[i] = std::max(out[i], -w) + 0.f; // -0 or +0 must not depend on the order
    }

private:
    std::size_t index(const Coord& leaf) const {
        return static_cast<std::size_t>(
            ((leaf.x() - block_.x()) / kLeaf * kAcross + (leaf.y() - block_.y()) / kLeaf) *
                kAcross +
            (leaf.z() - block_.z()) / kLeaf);
    }

    /// Calls fn for each leaf that the band of a solid may meet and no solid covers.
    template <class Fn>
    void each_leaf(std::uint32_t i, Fn&& fn) {
        const VoxelSolid& solid = solids_[i];
        int lo[3], hi[3];
        for (int c = 0; c < 3; ++c) {
            const double from = solid.lo[c] - half_width_ - block_[c],
                         to = solid.hi[c] + half_width_ - block_[c];
            lo[c] = static_cast<int>(std::clamp(std::floor(from / kLeaf), 0.0, double(kAcross)));
            hi[c] = static_cast<int>(std::clamp(std::floor(to / kLeaf), -1.0, kAcross - 1.0));
        }
        constexpr double kHalf = 0.5 * (kLeaf - 1);
        double middles[kAcross];
        for (int x = lo[0]; x <= hi[0]; ++x)
            for (int y = lo[1]; y <= hi[1]; ++y) {
                const double first[3] = {block_.x() + x * kLeaf + kHalf,
                                         block_.y() + y * kLeaf + kHalf, block_.z() + kHalf};
                solid_row(solid, first, kLeaf, middles);
                for (int z = lo[2]; z <= hi[2]; ++z) {
                    const auto leaf = static_cast<std::size_t>((x * kAcross + y) * kAcross + z);
                    if (inside_[leaf])
                        continue;
                    const Cover cover = cover_of(middles[z], kLeaf, half_width_);
                    if (cover == Cover::inside)
                        inside_[leaf] = 1;
                    else if (cover == Cover::surface)
                        fn(leaf);
                }
            }
    }

    const std::vector<VoxelSolid>& solids_;
    Coord block_;
    float half_width_;
    std::vector<std::uint32_t> first_; // solids of leaf i: listed_[first_[i] .. first_[i + 1])
    std::vector<char> inside_;
    std::vector<std::uint32_t> listed_;
};

/// Solids by the cells that they come near: cells of 64 * 2^level voxels, at the level where few
/// of them hold a solid.
class LatticeSolids final : public LatticeField {
public:
    LatticeSolids(const std::vector<AnalyticSolid>& solids, const Lattice& lattice,
                  const CoordBBox& region)
        : half_width_(lattice.half_width_vox) {
        Box box;
        for (const AnalyticSolid& s : solids) {
            const VoxelSolid solid(s, lattice);
            if (misses(solid, region))
                continue;
            for (int axis = 0; axis < 3; ++axis) {
                box.lo[axis] = std::min(box.lo[axis], solid.lo[axis]);
                box.hi[axis] = std::max(box.hi[axis], solid.hi[axis]);
            }
            solids_.push_back(solid);
        }
        if (solids_.empty())
            return;
        for (int axis = 0; axis < 3; ++axis) {
            box_.min()[axis] = below(box.lo[axis] - half_width_);
            box_.max()[axis] = below(box.hi[axis] + half_width_) + 1;
        }
        for (std::uint32_t i = 0; i < solids_.size(); ++i)
            list(i);
        tbb::parallel_sort(listed_.begin(), listed_.end());
    }

    CoordBBox bounds() const override { return box_; }

    std::unique_ptr<BlockSampler> open(const Coord& block, Cover& cover) const override {
        std::vector<std::uint32_t> near;
        const auto take = [&](std::uint32_t i) { // false when it covers the block
            cover = cover_of(solids_[i], block, kBlock, half_width_);
            if (cover == Cover::surface)
                near.push_back(i);
            return cover != Cover::inside;
        };
        for (int level = 0; level < kLevels; ++level) {
            if (!(levels_ >> level & 1))
                continue;
            const int shift = 6 + level;
            const std::uint64_t key =
                cell_key(level, block.x() >> shift, block.y() >> shift, block.z() >> shift);
            for (auto it = std::lower_bound(listed_.begin(), listed_.end(), std::pair(key, 0u));
                 it != listed_.end() && it->first == key; ++it)
                if (!take(it->second))
                    return nullptr;
        }
        for (const std::uint32_t i : everywhere_)
            if (!take(i))
                return nullptr;
        cover = near.empty() ? Cover::outside : Cover::surface;
        if (near.empty())
            return nullptr;
        return std::make_unique<SolidsBlock>(solids_, near, block, half_width_);
    }

private:
    static constexpr int kLevels = 24;

    static int below(double p) {
        return static_cast<int>(std::floor(std::clamp(p, -kFar - 1, kFar + 1)));
    }
    /// Cells 2^19 apart share a key; their solids are told apart by distance.
    static std::uint64_t cell_key(int level, int x, int y, int z) {
        const auto part = [](int v) { return static_cast<std::uint64_t>(v) & 0x7ffff; };
        return static_cast<std::uint64_t>(level) << 57 | part(x) << 38 | part(y) << 19 | part(z);
    }
    bool misses(const VoxelSolid& solid, const CoordBBox& region) const {
        for (int axis = 0; axis < 3; ++axis) { // blocks that touch the region are opened whole
            // An unbounded region misses nothing, however far: rasterize() is to refuse it.
            const double lo = std::min(solid.lo[axis] - half_width_, kFar + 1),
                         hi = std::max(solid.hi[axis] + half_width_, -kFar - 1);
            if (hi < region.min()[axis] - double(kBlock) ||
                lo > region.max()[axis] + double(kBlock))
                return true;
        }
        return false;
    }

    /// List a solid in the cells of the level where it spans two at most each way, or rather in
    /// those of their children of the second generation that it comes near: long thin solids would
    /// be asked for by all blocks of their boxes otherwise.
    void list(std::uint32_t i) {
        const VoxelSolid& s = solids_[i];
        Coord lo, hi;
        for (int axis = 0; axis < 3; ++axis) {
            lo[axis] = below(s.lo[axis] - half_width_);
            hi[axis] = below(s.hi[axis] + half_width_) + 1;
        }
        const auto spans = [&](int axis, int level) {
            return (hi[axis] >> (6 + level)) - (lo[axis] >> (6 + level));
        };
        int level = 0;
        while (level < kLevels && std::max({spans(0, level), spans(1, level), spans(2, level)}) > 1)
            ++level;
        if (level == kLevels) {
            everywhere_.push_back(i);
            return;
        }
        const int finest = std::max(0, level - 2);
        const auto descend = [&](auto&& self, int at, int x, int y, int z) -> void {
            const double size = std::ldexp(kBlock, at);
            const Coord cell(x * (kBlock << at), y * (kBlock << at), z * (kBlock << at));
            const Cover cover = cover_of(s, cell, size, half_width_);
            if (cover == Cover::outside)
                return;
            if (at == finest || cover == Cover::inside) {
                listed_.emplace_back(cell_key(at, x, y, z), i);
                levels_ |= 1u << at;
                return;
            }
            for (int k = 0; k < 8; ++k)
                self(self, at - 1, 2 * x + (k >> 2), 2 * y + (k >> 1 & 1), 2 * z + (k & 1));
        };
        for (int x = lo.x() >> (6 + level); x <= hi.x() >> (6 + level); ++x)
            for (int y = lo.y() >> (6 + level); y <= hi.y() >> (6 + level); ++y)
                for (int z = lo.z() >> (6 + level); z <= hi.z() >> (6 + level); ++z)
                    descend(descend, level, x, y, z);
    }

    float half_width_;
    std::vector<VoxelSolid> solids_;
    std::vector<std::pair<std::uint64_t, std::uint32_t>> listed_; // (cell, solid), sorted
    std::uint32_t levels_ = 0;                                    // bit l: some cell is of level l
    std::vector<std::uint32_t> everywhere_;                       // solids asked for every block
    CoordBBox box_;
};

} // namespace

std::unique_ptr<LatticeField> SolidsField::on(const Lattice& lattice,
                                              const CoordBBox& region) const {
    return std::make_unique<LatticeSolids>(solids_, lattice, region);
}

} // namespace taihu
