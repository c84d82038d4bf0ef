#include "vdb_ops/balls_field.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_sort.h>

#include "stats/core/box.h"
#include "stats/core/error.h"
#include "vdb_ops/kernels_detail.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
constexpr int kBlock = BlockSampler::kBlock;
constexpr int kLeaf = BlockSampler::kLeaf;

constexpr double kLarge = 2048; // voxels: floats would lose 1e-4 of one

/// A ball in voxel coordinates.
struct VoxelBall {
    Vec3 center;
    double r;
};

/// Squared distances from `p` to the nearest and the farthest voxel of a cube of `size` voxels.
struct Reach {
    double nearest2 = 0, farthest2 = 0;
    Reach(const Vec3& p, const Coord& cube, int size) {
        for (int axis = 0; axis < 3; ++axis) {
            const double below = cube[axis] - p[axis], above = p[axis] - (cube[axis] + size - 1);
            const double out = std::max({below, above, 0.0}), far = std::max(-below, -above);
            nearest2 += out * out;
            farthest2 += far * far;
        }
    }
};

/// Does the ball's band meet the cube (surface), is the cube deep inside (inside), or neither?
Cover classify(const VoxelBall& ball, const Coord& cube, int size, double half_width) {
    const Reach reach(ball.center, cube, size);
    const double outer = ball.r + half_width, inner = ball.r - half_width;
    if (reach.nearest2 >= outer * outer)
        return Cover::outside;
    return inner > 0 && reach.farthest2 <= inner * inner ? Cover::inside : Cover::surface;
}

class BallsBlock final : public BlockSampler {
public:
    BallsBlock(const Coord& block, const std::vector<VoxelBall>& balls, float half_width)
        : block_(block), half_width_(half_width), first_(kLeaves + 1, 0), inside_(kLeaves, 0) {
        for (const VoxelBall& ball : balls)
            if (ball.r > kLarge)
                large_.push_back(ball);
        each_leaf(balls, [&](const VoxelBall&, std::size_t leaf) { ++first_[leaf + 1]; });
        for (std::size_t i = 0; i < kLeaves; ++i)
            first_[i + 1] += first_[i];
        balls_.resize(first_[kLeaves]);
        std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
        each_leaf(balls, [&](const VoxelBall& ball, std::size_t leaf) {
            const Coord o = origin(leaf);
            if (ball.r > kLarge) { // nothing here: values() takes it in double
                balls_[next[leaf]++] = {0, 0, 0, -1e9f};
                return;
            }
            balls_[next[leaf]++] = {static_cast<float>(ball.center.x - o.x()),
                                    static_cast<float>(ball.center.y - o.y()),
                                    static_cast<float>(ball.center.z - o.z()),
                                    static_cast<float>(ball.r)};
        });
    }

    Cover cover(const Coord& leaf) const override {
        const std::size_t i = index(leaf);
        if (inside_[i])
            return Cover::inside;
        return first_[i] == first_[i + 1] ? Cover::outside : Cover::surface;
    }

    void values(const Coord& leaf, float* out) override {
        const std::size_t i = index(leaf);
        std::fill(out, out + 512, half_width_);
        for (const VoxelBall& ball : large_)
            min_large_ball(ball, leaf, out);
        min_balls(balls_.data() + first_[i], first_[i + 1] - first_[i], half_width_, out);
        for (int k = 0; k < 512; ++k)
            out[k] = std::max(out[k], -half_width_);
    }

private:
    static constexpr int kAcross = kBlock / kLeaf;
    static constexpr std::size_t kLeaves = std::size_t{kAcross} * kAcross * kAcross;

    static void min_large_ball(const VoxelBall& ball, const Coord& leaf, float* out) {
        for (int i = 0; i < 512; ++i) {
            const Vec3 p{leaf.x() + i / 64 - ball.center.x, leaf.y() + i / 8 % 8 - ball.center.y,
                         leaf.z() + i % 8 - ball.center.z};
            out[i] = std::min(out[i], static_cast<float>(length(p) - ball.r));
        }
    }
    std::size_t index(const Coord& leaf) const {
        return static_cast<std::size_t>(
            ((leaf.x() - block_.x()) / kLeaf * kAcross + (leaf.y() - block_.y()) / kLeaf) *
                kAcross +
            (leaf.z() - block_.z()) / kLeaf);
    }
    Coord origin(std::size_t leaf) const {
        const int i = static_cast<int>(leaf);
        return block_.offsetBy(i / (kAcross * kAcross) * kLeaf, i / kAcross % kAcross * kLeaf,
                               i % kAcross * kLeaf);
    }

    /// Calls fn for each ball and each leaf that its band meets and no ball covers.
    template <class Fn>
    void each_leaf(const std::vector<VoxelBall>& balls, Fn&& fn) {
        for (const VoxelBall& ball : balls) {
            int lo[3], hi[3];
            for (int axis = 0; axis < 3; ++axis) {
                const double c = ball.center[axis] - block_[axis], reach = ball.r + half_width_;
                lo[axis] = static_cast<int>(std::max(0.0, std::floor((c - reach) / kLeaf)));
                hi[axis] =
                    static_cast<int>(std::min(kAcross - 1.0, std::floor((c + reach) / kLeaf)));
            }
            for (int i = lo[0]; i <= hi[0]; ++i)
                for (int j = lo[1]; j <= hi[1]; ++j)
                    for (int k = lo[2]; k <= hi[2]; ++k) {
                        const auto leaf = static_cast<std::size_t>((i * kAcross + j) * kAcross + k);
                        if (inside_[leaf])
                            continue;
                        const Cover cover = classify(ball, origin(leaf), kLeaf, half_width_);
                        if (cover == Cover::inside)
                            inside_[leaf] = 1;
                        else if (cover == Cover::surface)
                            fn(ball, leaf);
                    }
        }
    }

    Coord block_;
    float half_width_;
    std::vector<std::uint32_t> first_; // balls of leaf i: balls_[first_[i] .. first_[i + 1])
    std::vector<char> inside_;
    std::vector<LeafBall> balls_;
    std::vector<VoxelBall> large_; // of the whole block
};

/// All balls on a lattice, listed by block.
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
            const double reach = ball.r + half_width_;
            box.include(ball.center - Vec3{reach, reach, reach});
            box.include(ball.center + Vec3{reach, reach, reach});
        }
        if (balls_.empty())
            return;
        box_ = CoordBBox(voxel(box.lo, 0), voxel(box.hi, 1));
        for (std::uint32_t i = 0; i < balls_.size(); ++i)
            list_blocks(i);
        tbb::parallel_sort(listed_.begin(), listed_.end());
    }

    CoordBBox bounds() const override { return box_; }

    std::unique_ptr<BlockSampler> open(const Coord& block, Cover& cover) const override {
        cover = Cover::outside;
        std::vector<VoxelBall> near;
        const auto take = [&](std::uint32_t i) {
            const Cover c = classify(balls_[i], block, kBlock, half_width_);
            if (c == Cover::inside)
                cover = c;
            else if (c == Cover::surface)
                near.push_back(balls_[i]);
        };
        const std::uint64_t key = block_key(block);
        for (auto it = std::lower_bound(listed_.begin(), listed_.end(), std::pair(key, 0u));
             it != listed_.end() && it->first == key; ++it)
            take(it->second);
        for (const std::uint32_t i : large_)
            take(i);
        if (cover == Cover::inside || near.empty())
            return nullptr;
        cover = Cover::surface;
        return std::make_unique<BallsBlock>(block, near, half_width_);
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
    static Coord voxel(const Vec3& p, int up) {
        Coord c;
        for (int axis = 0; axis < 3; ++axis)
            c[axis] = static_cast<int>(std::clamp(std::floor(p[axis]), -0x1p30, 0x1p30)) + up;
        return c;
    }
    /// Blocks 2^21 apart share a key; classify() tells their balls apart.
    static std::uint64_t block_key(const Coord& block) {
        std::uint64_t key = 0;
        for (int axis = 0; axis < 3; ++axis)
            key = key << 21 | (static_cast<std::uint64_t>(block[axis] >> 6) & 0x1fffff);
        return key;
    }
    void list_blocks(std::uint32_t i) {
        const VoxelBall& ball = balls_[i];
        const double reach = ball.r + half_width_;
        if (reach > kBlock * 8) { // would be in thousands of lists
            large_.push_back(i);
            return;
        }
        const Vec3 r{reach, reach, reach};
        const Coord lo = voxel(ball.center - r, 0), hi = voxel(ball.center + r, 1);
        for (int x = lo.x() >> 6; x <= hi.x() >> 6; ++x)
            for (int y = lo.y() >> 6; y <= hi.y() >> 6; ++y)
                for (int z = lo.z() >> 6; z <= hi.z() >> 6; ++z)
                    if (const Coord block(x * kBlock, y * kBlock, z * kBlock);
                        classify(ball, block, kBlock, half_width_) != Cover::outside)
                        listed_.emplace_back(block_key(block), i);
    }

    float half_width_;
    std::vector<VoxelBall> balls_;
    std::vector<std::pair<std::uint64_t, std::uint32_t>> listed_; // (block, ball), sorted
    std::vector<std::uint32_t> large_;                            // balls asked for every block
    CoordBBox box_;
};

} // namespace

BallsField::BallsField(std::span<const Sphere> balls) : balls_(balls.begin(), balls.end()) {
    for (std::size_t i = 0; i < balls_.size(); ++i) {
        const Sphere& s = balls_[i];
        const std::string where = "holes[" + std::to_string(i) + "]";
        if (!std::isfinite(s.radius_m) || !(s.radius_m > 0))
            throw Error(Fault::bad_argument, where + ".radius_m is " + std::to_string(s.radius_m) +
                                                 ", must be finite and > 0; drop or fix the hole");
        if (!is_finite(s.center))
            throw Error(Fault::bad_argument, where + ".center is not finite; drop or fix the hole");
    }
}

std::unique_ptr<LatticeField> BallsField::on(const Lattice& lattice,
                                             const openvdb::CoordBBox& region) const {
    return std::make_unique<LatticeBalls>(balls_, lattice, region);
}

} // namespace taihu
