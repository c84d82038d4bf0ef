#include "vdb_ops/analytic_field.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "vdb_ops/probe_detail.h"

namespace taihu {
namespace {

using openvdb::Coord;
constexpr int kLeaf = BlockSampler::kLeaf;
constexpr int kAcross = BlockSampler::kBlock / kLeaf;

/// The distance in the middle of a cube of so many voxels bounds it everywhere in it.
Cover cover_of(double middle, int size, const Lattice& lattice) {
    const double reach = lattice.half_width_vox + 0.5 * (size - 1) * std::sqrt(3.0) + 1e-3;
    middle /= lattice.voxel_m;
    return middle > reach ? Cover::outside : middle < -reach ? Cover::inside : Cover::surface;
}

/// 8^3 points from `first` on, `step` voxels apart, z fastest.
std::array<Vec3, 512> points(const Vec3& first, double step, const Lattice& lattice) {
    std::array<Vec3, 512> all;
    for (std::size_t i = 0; i < 512; ++i) {
        const Vec3 at{static_cast<double>(i / 64), static_cast<double>(i / 8 % 8),
                      static_cast<double>(i % 8)};
        all[i] = lattice.origin + (first + at * step) * lattice.voxel_m;
    }
    return all;
}

Vec3 corner(const Coord& c) {
    return {static_cast<double>(c.x()), static_cast<double>(c.y()), static_cast<double>(c.z())};
}

class AnalyticBlock final : public BlockSampler {
public:
    AnalyticBlock(const AnalyticField::Distances& distances, const Lattice& lattice,
                  const Coord& block)
        : distances_(distances), lattice_(lattice), block_(block) {
        constexpr double kHalf = 0.5 * (kLeaf - 1);
        const auto middles = points(corner(block) + Vec3{kHalf, kHalf, kHalf}, kLeaf, lattice);
        distances_(middles, middles_.data());
    }

    Cover cover(const Coord& leaf) const override {
        const Coord at = leaf - block_;
        const int i = (at.x() / kLeaf * kAcross + at.y() / kLeaf) * kAcross + at.z() / kLeaf;
        return cover_of(middles_[static_cast<std::size_t>(i)], kLeaf, lattice_);
    }

    void values(const Coord& leaf, float* out) override {
        std::array<double, 512> d;
        distances_(points(corner(leaf), 1, lattice_), d.data());
        const double w = lattice_.half_width_vox;
        for (std::size_t i = 0; i < 512; ++i)
            out[i] = static_cast<float>(std::clamp(d[i] / lattice_.voxel_m, -w, w));
    }

private:
    const AnalyticField::Distances& distances_;
    Lattice lattice_;
    Coord block_;
    std::array<double, 512> middles_; // of the leaves
};

class LatticeAnalytic final : public LatticeField {
public:
    LatticeAnalytic(const Box& box, const AnalyticField::Distances& distances,
                    const Lattice& lattice)
        : distances_(distances), lattice_(lattice) {
        const double reach = lattice.half_width_vox + 1;
        for (int axis = 0; axis < 3; ++axis) {
            const double lo = (box.lo[axis] - lattice.origin[axis]) / lattice.voxel_m - reach;
            const double hi = (box.hi[axis] - lattice.origin[axis]) / lattice.voxel_m + reach;
            box_.min()[axis] = static_cast<int>(std::floor(std::clamp(lo, -0x1p30 - 1, 0x1p30)));
            box_.max()[axis] = static_cast<int>(std::ceil(std::clamp(hi, -0x1p30, 0x1p30 + 1)));
        }
    }
    openvdb::CoordBBox bounds() const override { return box_; }
    std::unique_ptr<BlockSampler> open(const Coord& block, Cover& cover) const override {
        constexpr double kHalf = 0.5 * (BlockSampler::kBlock - 1);
        const Vec3 middle =
            lattice_.origin + (corner(block) + Vec3{kHalf, kHalf, kHalf}) * lattice_.voxel_m;
        double d = 0;
        distances_({&middle, 1}, &d);
        cover = cover_of(d, BlockSampler::kBlock, lattice_);
        if (cover != Cover::surface)
            return nullptr;
        return std::make_unique<AnalyticBlock>(distances_, lattice_, block);
    }

private:
    const AnalyticField::Distances& distances_;
    Lattice lattice_;
    openvdb::CoordBBox box_;
};

/// The function itself, as one primitive.
class AnalyticProbe final : public FieldProbe {
public:
    AnalyticProbe(const AnalyticField::Distances& distances, double reach_m)
        : distances_(distances), step_m_(gradient_step(reach_m)) {}

    Nearest at(const Vec3& p) const override { return {value(p), 0}; }
    Value of(Primitive, const Vec3& p) const override {
        return {value(p), gradient_of([this](const Vec3& q) { return value(q); }, p, step_m_)};
    }
    void near(const Vec3& p, double reach_m, std::vector<Primitive>& out) const override {
        if (std::fabs(value(p)) <= reach_m)
            out.push_back(0);
    }
    std::optional<Sphere> ball(Primitive) const override { return std::nullopt; }

private:
    double value(const Vec3& p) const {
        double d = 0;
        distances_({&p, 1}, &d);
        return d;
    }

    const AnalyticField::Distances& distances_;
    double step_m_;
};

} // namespace

AnalyticField::AnalyticField(const Box& box, Distances distances)
    : box_(box), distances_(std::move(distances)) {}

std::unique_ptr<LatticeField> AnalyticField::on(const Lattice& lattice,
                                                const openvdb::CoordBBox&) const {
    return std::make_unique<LatticeAnalytic>(box_, distances_, lattice);
}

std::unique_ptr<FieldProbe> AnalyticField::probe(const Box&, double reach_m) const {
    return std::make_unique<AnalyticProbe>(distances_, reach_m);
}

double box_distance(const Vec3& p, const Vec3& half_size) {
    const Vec3 q{std::fabs(p.x) - half_size.x, std::fabs(p.y) - half_size.y,
                 std::fabs(p.z) - half_size.z};
    return length(max(q, Vec3{})) + std::min(std::max({q.x, q.y, q.z}), 0.0);
}

} // namespace taihu
