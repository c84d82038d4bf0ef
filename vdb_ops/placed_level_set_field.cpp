#include "vdb_ops/placed_level_set_field.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/redistance.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;

/// Voxel (i, j, k) of a lattice lies at first + i step[0] + j step[1] + k step[2] of the grid.
struct Frame {
    Vec3 first;
    std::array<Vec3, 3> step;
    double voxel = 1;     ///< of the grid, in voxels of the lattice
    double inverse_m = 1; ///< 1 / (the grid's own voxel [m])

    Frame(const Lattice& grid, const Similarity& at, const Lattice& lattice) {
        const Similarity back = at.inverse();
        voxel = grid.voxel_m * at.scale() / lattice.voxel_m;
        inverse_m = 1 / grid.voxel_m;
        first = (back.point(lattice.origin) - grid.origin) / grid.voxel_m;
        for (int axis = 0; axis < 3; ++axis) {
            Vec3 one;
            one[axis] = 1;
            step[static_cast<std::size_t>(axis)] = back.direction(one) / voxel;
        }
    }
    Vec3 point(double i, double j, double k) const {
        return first + step[0] * i + step[1] * j + step[2] * k;
    }
    /// Half extents in the grid of a cube of `size` voxels of the lattice.
    Vec3 half_extent(double size) const {
        Vec3 half;
        for (int c = 0; c < 3; ++c)
            half[c] = 0.5 * (size - 1) *
                      (std::fabs(step[0][c]) + std::fabs(step[1][c]) + std::fabs(step[2][c]));
        return half;
    }
};

Coord below(const Vec3& p) { // rasterize() refuses what reaches beyond 2^30
    constexpr double kFar = 0x1p30 + 1;
    Coord c;
    for (int axis = 0; axis < 3; ++axis)
        c[axis] = static_cast<int>(std::floor(std::clamp(p[axis], -kFar, kFar)));
    return c;
}

class PlacedLevelSetBlock final : public BlockSampler {
public:
    PlacedLevelSetBlock(const openvdb::FloatGrid& grid, const Frame& frame, float half_width)
        : accessor_(grid.getConstAccessor()), frame_(frame), half_width_(half_width) {}

    /// Far when no leaf of the grid is near, or when the distance in the middle says so.
    Cover cover(const Coord& leaf) const override {
        constexpr double kHalf = 0.5 * (kLeaf - 1);
        const Vec3 middle = frame_.point(leaf.x() + kHalf, leaf.y() + kHalf, leaf.z() + kHalf);
        const double d = static_cast<double>(at(middle));
        const Cover side = d < 0 ? Cover::inside : Cover::outside;
        // Between voxels, a way over two of them is all that the values promise.
        if (std::fabs(d) > half_width_ + kHalf * std::sqrt(3.0) + 2 * frame_.voxel)
            return side;
        const Vec3 half = frame_.half_extent(kLeaf);
        return any_leaf(below(middle - half), below(middle + half).offsetBy(1)) ? Cover::surface
                                                                                : side;
    }

    void values(const Coord& leaf, float* out) override {
        for (int i = 0; i < 512; ++i) {
            const float d =
                at(frame_.point(leaf.x() + i / 64, leaf.y() + i / 8 % 8, leaf.z() + i % 8));
            // What was clamped in the grid may have been rounded to a little less.
            out[i] = std::fabs(d) < half_width_ - 1e-5f ? d : std::copysign(half_width_, d);
        }
    }

private:
    using Node = openvdb::FloatTree::RootNodeType::ChildNodeType::ChildNodeType;

    /// Does a box of the grid hold a leaf? Node by node: on a coarse lattice it may be large.
    bool any_leaf(const Coord& lo, const Coord& hi) const {
        constexpr int kNode = Node::DIM;
        for (int x = lo.x() & ~(kNode - 1); x <= hi.x(); x += kNode)
            for (int y = lo.y() & ~(kNode - 1); y <= hi.y(); y += kNode)
                for (int z = lo.z() & ~(kNode - 1); z <= hi.z(); z += kNode)
                    if (const Coord node(x, y, z); accessor_.probeConstNode<Node>(node)) {
                        const Coord from = Coord::maxComponent(lo, node) & ~(kLeaf - 1);
                        const Coord to = Coord::minComponent(hi, node.offsetBy(kNode - 1));
                        for (int i = from.x(); i <= to.x(); i += kLeaf)
                            for (int j = from.y(); j <= to.y(); j += kLeaf)
                                for (int k = from.z(); k <= to.z(); k += kLeaf)
                                    if (accessor_.probeConstLeaf({i, j, k}))
                                        return true;
                    }
        return false;
    }

    /// Distance at a point of the grid, in voxels of the lattice.
    float at(const Vec3& p) const {
        const Coord c = below(p);
        const std::array<double, 3> f = {p.x - c.x(), p.y - c.y(), p.z - c.z()};
        const auto scale = frame_.inverse_m * frame_.voxel;
        if (f[0] == 0 && f[1] == 0 && f[2] == 0)
            return static_cast<float>(static_cast<double>(accessor_.getValue(c)) * scale);
        std::array<double, 8> v;
        double lo = -1e30, hi = 1e30; // of a 1-Lipschitz function through the eight voxels
        for (int k = 0; k < 8; ++k) {
            const int x = k >> 2, y = k >> 1 & 1, z = k & 1;
            const double d =
                static_cast<double>(accessor_.getValue(c.offsetBy(x, y, z))) * frame_.inverse_m;
            const double away = length(Vec3{f[0] - x, f[1] - y, f[2] - z});
            v[static_cast<std::size_t>(k)] = d;
            lo = std::max(lo, d - away);
            hi = std::min(hi, d + away);
        }
        const auto mix = [](double a, double b, double t) { return a + (b - a) * t; };
        const double d = mix(mix(mix(v[0], v[1], f[2]), mix(v[2], v[3], f[2]), f[1]),
                             mix(mix(v[4], v[5], f[2]), mix(v[6], v[7], f[2]), f[1]), f[0]);
        return static_cast<float>((lo <= hi ? std::clamp(d, lo, hi) : d) * frame_.voxel);
    }

    openvdb::FloatGrid::ConstAccessor accessor_;
    const Frame& frame_;
    float half_width_;
};

class LatticePlacedLevelSet final : public LatticeField {
public:
    LatticePlacedLevelSet(openvdb::FloatGrid::ConstPtr grid, const Frame& frame,
                          const Lattice& lattice)
        : grid_(std::move(grid)), frame_(frame), half_width_(lattice.half_width_vox) {
        CoordBBox leaves;
        if (!grid_->tree().evalLeafBoundingBox(leaves))
            return;
        // Steps are orthogonal and of one length, so their transposes lead back.
        Vec3 lo, hi;
        for (int axis = 0; axis < 3; ++axis) {
            const Vec3 back =
                frame_.step[static_cast<std::size_t>(axis)] * (frame_.voxel * frame_.voxel);
            for (int c = 0; c < 3; ++c) {
                const double a = (leaves.min()[c] - 1 - frame_.first[c]) * back[c],
                             b = (leaves.max()[c] + 1 - frame_.first[c]) * back[c];
                lo[axis] += std::min(a, b);
                hi[axis] += std::max(a, b);
            }
        }
        box_ = CoordBBox(below(lo), below(hi).offsetBy(1));
    }

    CoordBBox bounds() const override { return box_; }
    std::unique_ptr<BlockSampler> open(const Coord& block, Cover& cover) const override {
        cover = Cover::outside;
        if (!box_.hasOverlap(CoordBBox::createCube(block, BlockSampler::kBlock)))
            return nullptr;
        cover = Cover::surface;
        return std::make_unique<PlacedLevelSetBlock>(*grid_, frame_, half_width_);
    }

private:
    openvdb::FloatGrid::ConstPtr grid_;
    Frame frame_;
    float half_width_;
    CoordBBox box_;
};

} // namespace

PlacedLevelSetField::PlacedLevelSetField(openvdb::FloatGrid::ConstPtr grid, const Similarity& at,
                                         Widen widen)
    : grid_(std::move(grid)), at_(at), widen_(std::move(widen)), widest_(grid_) {
    if (!grid_)
        throw Error(Fault::bad_argument, "placed level set: the grid is null; give a level set");
    lattice_of(*grid_);
    if (!widen_)
        widen_ = [grid = grid_](float half_width) { return widen_band(*grid, half_width); };
}

openvdb::FloatGrid::ConstPtr PlacedLevelSetField::as_wide_as(double half_width_vox) const {
    const std::lock_guard lock(mutex_);
    const double have_vox = static_cast<double>(widest_->background()) / widest_->voxelSize().x();
    if (half_width_vox > have_vox + 1e-3)
        widest_ = widen_(static_cast<float>(half_width_vox));
    return widest_;
}

std::unique_ptr<LatticeField> PlacedLevelSetField::on(const Lattice& lattice,
                                                      const CoordBBox&) const {
    const Lattice own = lattice_of(*grid_);
    Frame frame(own, at_, lattice);
    const auto near = [](double a, double b) { return std::fabs(a - b) <= 1e-9; };
    const bool same = at_.is_identity() && near(frame.voxel, 1) && near(length(frame.first), 0);
    if (same) {
        frame.first = {};
        frame.step = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
        frame.voxel = 1;
    }
    // Two voxels beyond the band, or every cell that it meets would hold clamped corners.
    const double half_width =
        static_cast<double>(lattice.half_width_vox) / frame.voxel + (same ? 0 : 2);
    if (half_width > kWidestBand_vox)
        throw Error(Fault::bad_argument,
                    "grid '" + grid_->getName() + "': a band of " + rounded(half_width) +
                        " of its voxels is asked for, at most 1000 are handled; use a smaller "
                        "voxel, or less offset and blend");
    return std::make_unique<LatticePlacedLevelSet>(as_wide_as(half_width), frame, lattice);
}

} // namespace taihu
