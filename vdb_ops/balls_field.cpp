#include "vdb_ops/balls_field.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <tbb/parallel_for.h>

#include "stats/core/box.h"
#include "stats/core/error.h"
#include "vdb_ops/cube_lists_detail.h"
#include "vdb_ops/kernels_detail.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
constexpr int kBlock = BlockSampler::kBlock;
constexpr int kLeaf = BlockSampler::kLeaf;
constexpr int kAcross = kBlock / kLeaf;

constexpr double kLarge = 2048; // voxels: floats would lose 1e-4 of one
constexpr double kMostCells = 0x1p21, kMostLooks = 0x1p24;
constexpr std::size_t kChunk = 1024; // balls

/// values = max(values, r - |x - c|) for the leaf that begins at `leaf`, in double.
void subtract_large(const VoxelBall& ball, const Coord& leaf, float* values) {
    for (int i = 0; i < 512; ++i) {
        const Vec3 p{leaf.x() + i / 64 - ball.center.x, leaf.y() + i / 8 % 8 - ball.center.y,
                     leaf.z() + i % 8 - ball.center.z};
        values[i] = std::max(values[i], static_cast<float>(ball.r - length(p)));
    }
}

class BallsBlock final : public BlockSampler {
public:
    /// \param near  those of `all` that come near the block, large ones first.
    BallsBlock(const Coord& block, const std::vector<VoxelBall>& all,
               std::span<const std::uint32_t> near, float half_width)
        : block_(block), half_width_(half_width), leaves_(kLeaf, Coord(kAcross), half_width) {
        const Vec3 origin{double(block.x()), double(block.y()), double(block.z())};
        CubeLists::Hits hits;
        balls_.reserve(near.size());
        for (std::size_t n = 0; n < near.size(); ++n) {
            __builtin_prefetch(&all[near[std::min(n + 8, near.size() - 1)]]);
            const VoxelBall ball{all[near[n]].center - origin, all[near[n]].r};
            leaves_.find(ball, static_cast<std::uint32_t>(n), hits);
            balls_.push_back({static_cast<float>(ball.center.x), static_cast<float>(ball.center.y),
                              static_cast<float>(ball.center.z), static_cast<float>(ball.r)});
            if (ball.r > kLarge) // large ones come first
                large_.push_back(ball);
        }
        leaves_.sort({&hits, 1});
    }

    Cover cover(const Coord& leaf) const override { return leaves_.cover(index(leaf)); }

    void values(const Coord& leaf, float* out) override {
        std::fill(out, out + 512, -half_width_);
        subtract_from(leaf, out);
        for (int i = 0; i < 512; ++i)
            out[i] = -out[i];
    }

    void subtract_from(const Coord& leaf, float* values) override {
        const Coord offset = leaf - block_;
        const std::span<const std::uint32_t> near = leaves_.balls(index(leaf));
        const std::uint32_t *ball = near.data(), *end = ball + near.size();
        for (; ball != end && *ball < large_.size(); ++ball)
            subtract_large(large_[*ball], offset, values);
        subtract_balls(balls_.data(), ball, end, offset.data(), -half_width_, values);
    }

private:
    std::size_t index(const Coord& leaf) const {
        return leaves_.index((leaf.x() - block_.x()) / kLeaf, (leaf.y() - block_.y()) / kLeaf,
                             (leaf.z() - block_.z()) / kLeaf);
    }

    Coord block_;
    float half_width_;
    std::vector<LeafBall> balls_;
    std::vector<VoxelBall> large_; ///< balls_[i] in double, for i below its size
    CubeLists leaves_;
};

/// All balls on a lattice, listed by cells: blocks, or larger cubes where a box has too many of
/// them.
class LatticeBalls final : public LatticeField {
public:
    LatticeBalls(const std::vector<Sphere>& balls, const Lattice& lattice, const CoordBBox& region)
        : half_width_(lattice.half_width_vox) {
        balls_.reserve(balls.size());
        Box box;
        for (const Sphere& s : balls) {
            const VoxelBall ball{(s.center - lattice.origin) / lattice.voxel_m,
                                 s.radius_m / lattice.voxel_m};
            if (misses(ball, region))
                continue;
            balls_.push_back(ball);
            const double reach = ball.r + half_width_ + 1;
            box.include(ball.center - Vec3{reach, reach, reach});
            box.include(ball.center + Vec3{reach, reach, reach});
        }
        if (balls_.empty())
            return;
        std::partition(balls_.begin(), balls_.end(),
                       [](const VoxelBall& ball) { return ball.r > kLarge; });
        box_ = CoordBBox(voxel(box.lo), voxel(box.hi));
        list_cells(region);
    }

    CoordBBox bounds() const override { return box_; }

    std::unique_ptr<BlockSampler> open(const Coord& block, Cover& cover) const override {
        const Coord cell = block >> shift_;
        cover = Cover::outside;
        if (!cells_ || !cell_box_.isInside(cell))
            return nullptr;
        const Coord at = cell - cell_box_.min();
        const std::size_t i = cells_->index(at.x(), at.y(), at.z());
        cover = cells_->cover(i);
        if (cover != Cover::surface)
            return nullptr;
        return std::make_unique<BallsBlock>(block, balls_, cells_->balls(i), half_width_);
    }

private:
    bool misses(const VoxelBall& ball, const CoordBBox& region) const {
        for (int axis = 0; axis < 3; ++axis) // blocks that touch the region are opened whole
            if (ball.center[axis] + ball.r + half_width_ < region.min()[axis] - double(kBlock) ||
                ball.center[axis] - ball.r - half_width_ > region.max()[axis] + double(kBlock))
                return true;
        return false;
    }
    /// The voxel below `p`, kept within +-2^30 (rasterize() refuses what reaches that far).
    static Coord voxel(const Vec3& p) {
        Coord c;
        for (int axis = 0; axis < 3; ++axis)
            c[axis] = static_cast<int>(std::clamp(std::floor(p[axis]), -0x1p30 - 1, 0x1p30 + 1));
        return c;
    }
    void list_cells(const CoordBBox& region) {
        CoordBBox box = box_;
        for (int axis = 0; axis < 3; ++axis) { // whole blocks
            box.min()[axis] = std::max(box.min()[axis], region.min()[axis] & -kBlock);
            box.max()[axis] = std::min(box.max()[axis], region.max()[axis] | (kBlock - 1));
        }
        if (box.empty())
            return;
        while (!cells_fit(box))
            ++shift_;
        std::vector<CubeLists::Hits> hits((balls_.size() + kChunk - 1) / kChunk);
        tbb::parallel_for(std::size_t{0}, hits.size(), [&](std::size_t chunk) {
            const std::size_t end = std::min(balls_.size(), (chunk + 1) * kChunk);
            for (std::size_t i = chunk * kChunk; i < end; ++i)
                cells_->find({balls_[i].center - origin_, balls_[i].r},
                             static_cast<std::uint32_t>(i), hits[chunk]);
        });
        cells_->sort(hits);
    }
    /// Makes cells of 2^shift_ voxels; false when there would be too many of them, or too many
    /// balls in them.
    bool cells_fit(const CoordBBox& box) {
        cell_box_ = box >> shift_;
        const Coord n = cell_box_.dim(), first = cell_box_.min() << shift_;
        if (double(n.x()) * double(n.y()) * double(n.z()) > kMostCells)
            return false;
        origin_ = {double(first.x()), double(first.y()), double(first.z())};
        const int size = 1 << shift_;
        cells_.emplace(size, n, half_width_);
        double n_looked_at = 0; // by those that may look at more than 64
        for (const VoxelBall& ball : balls_)
            if (ball.r > size)
                n_looked_at += cells_->n_looked_at({ball.center - origin_, ball.r});
        return n_looked_at <= kMostLooks + 64 * static_cast<double>(balls_.size());
    }

    float half_width_;
    std::vector<VoxelBall> balls_; ///< large ones first
    CoordBBox box_;
    std::size_t shift_ = 6; ///< cells are cubes of 2^shift_ voxels
    CoordBBox cell_box_;    ///< their numbers
    Vec3 origin_;           ///< first voxel of the first cell
    std::optional<CubeLists> cells_;
};

} // namespace

BallsField::BallsField(std::span<const Sphere> balls) : balls_(balls.begin(), balls.end()) {
    for (std::size_t i = 0; i < balls_.size(); ++i) {
        const Sphere& s = balls_[i];
        const auto refuse = [i](const std::string& what) {
            throw Error(Fault::bad_argument,
                        "holes[" + std::to_string(i) + "]" + what + "; drop or fix the hole");
        };
        if (!std::isfinite(s.radius_m) || !(s.radius_m > 0))
            refuse(".radius_m is " + std::to_string(s.radius_m) + ", must be finite and > 0");
        if (!is_finite(s.center))
            refuse(".center is not finite");
    }
}

std::unique_ptr<LatticeField> BallsField::on(const Lattice& lattice,
                                             const openvdb::CoordBBox& region) const {
    return std::make_unique<LatticeBalls>(balls_, lattice, region);
}

} // namespace taihu
