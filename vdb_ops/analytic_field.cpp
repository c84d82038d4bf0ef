#include "vdb_ops/analytic_field.h"

#include <algorithm>
#include <cmath>

namespace taihu {
namespace {

using openvdb::Coord;

class AnalyticBlock final : public BlockSampler {
public:
    AnalyticBlock(const std::function<double(const Vec3&)>& distance, const Lattice& lattice)
        : distance_(distance), lattice_(lattice) {}

    Cover cover(const Coord& leaf) const override { return cover_of(leaf, kLeaf); }

    /// The distance in the middle of a cube bounds it everywhere in it.
    Cover cover_of(const Coord& cube, int size) const {
        const double half = 0.5 * (size - 1);
        const double d = at(cube.x() + half, cube.y() + half, cube.z() + half);
        const double reach = lattice_.half_width_vox + half * std::sqrt(3.0) + 1e-3;
        return d > reach ? Cover::outside : d < -reach ? Cover::inside : Cover::surface;
    }

    void values(const Coord& leaf, float* out) override {
        const double w = lattice_.half_width_vox;
        for (int i = 0; i < 512; ++i)
            out[i] = static_cast<float>(
                std::clamp(at(leaf.x() + i / 64, leaf.y() + i / 8 % 8, leaf.z() + i % 8), -w, w));
    }

private:
    double at(double x, double y, double z) const {
        return distance_(lattice_.origin + Vec3{x, y, z} * lattice_.voxel_m) / lattice_.voxel_m;
    }
    const std::function<double(const Vec3&)>& distance_;
    Lattice lattice_;
};

class LatticeAnalytic final : public LatticeField {
public:
    LatticeAnalytic(const Box& box, const std::function<double(const Vec3&)>& distance,
                    const Lattice& lattice)
        : distance_(distance), lattice_(lattice) {
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
        auto sampler = std::make_unique<AnalyticBlock>(distance_, lattice_);
        cover = sampler->cover_of(block, BlockSampler::kBlock);
        if (cover != Cover::surface)
            return nullptr;
        return sampler;
    }

private:
    const std::function<double(const Vec3&)>& distance_;
    Lattice lattice_;
    openvdb::CoordBBox box_;
};

} // namespace

AnalyticField::AnalyticField(const Box& box, std::function<double(const Vec3&)> distance)
    : box_(box), distance_(std::move(distance)) {}

std::unique_ptr<LatticeField> AnalyticField::on(const Lattice& lattice,
                                                const openvdb::CoordBBox&) const {
    return std::make_unique<LatticeAnalytic>(box_, distance_, lattice);
}

double box_distance(const Vec3& p, const Vec3& half_size) {
    const Vec3 q{std::fabs(p.x) - half_size.x, std::fabs(p.y) - half_size.y,
                 std::fabs(p.z) - half_size.z};
    return length(max(q, Vec3{})) + std::min(std::max({q.x, q.y, q.z}), 0.0);
}

double cylinder_distance(const Vec3& p, double radius_m, double half_height_m) {
    const double side = std::hypot(p.x, p.z) - radius_m, cap = std::fabs(p.y) - half_height_m;
    return std::hypot(std::max(side, 0.0), std::max(cap, 0.0)) + std::min(std::max(side, cap), 0.0);
}

double torus_distance(const Vec3& p, double ring_m, double tube_m) {
    return std::hypot(std::hypot(p.x, p.z) - ring_m, p.y) - tube_m;
}

double ellipsoid_distance(const Vec3& p, const Vec3& semi_axes) {
    // Nearest point y_i = a_i^2 p_i / (t + a_i^2) with sum (a_i p_i / (t + a_i^2))^2 = 1; the sum
    // falls as t grows from -min(a)^2, where the nearest point is on the surface's own side.
    const double shortest = std::min({semi_axes.x, semi_axes.y, semi_axes.z});
    Vec3 a = semi_axes / shortest,
         q{std::fabs(p.x) / shortest, std::fabs(p.y) / shortest, std::fabs(p.z) / shortest};
    // With s = t + 1 nothing cancels near the middle plane of the shortest axis, where a = 1.
    const auto denominator = [&a](int i, double shifted) {
        return shifted + (a[i] - 1) * (a[i] + 1);
    };
    const auto sum = [&](double shifted) {
        double total = 0;
        for (int i = 0; i < 3; ++i) {
            const double v = a[i] * q[i] / denominator(i, shifted);
            total += v * v;
        }
        return total;
    };
    double level = 0;
    for (int i = 0; i < 3; ++i)
        level += (q[i] / a[i]) * (q[i] / a[i]);
    const double side = level < 1 ? -1 : 1;
    double lo = 1e-300, hi = std::max({a.x, a.y, a.z}) * length(q) + 2;
    // In that middle plane the multiplier may reach its end: the nearest point leaves the plane,
    // and its height there follows from the surface equation.
    const bool degenerate = sum(lo) < 1;
    for (int i = 0; i < 1100 && !degenerate; ++i) {
        // By exponents while they differ, then by values.
        const double middle = hi > 4 * lo ? std::sqrt(lo) * std::sqrt(hi) : 0.5 * (lo + hi);
        if (middle <= lo || middle >= hi)
            break;
        (sum(middle) > 1 ? lo : hi) = middle;
    }
    const double shifted = degenerate ? 0 : 0.5 * (lo + hi);
    double d2 = 0, on_surface = 0;
    int flat = -1;
    for (int i = 0; i < 3; ++i) {
        if (degenerate && a[i] == 1 && flat < 0) {
            flat = i;
            continue;
        }
        const double over = denominator(i, shifted);
        const double y = over > 0 ? a[i] * a[i] * q[i] / over : 0;
        d2 += (y - q[i]) * (y - q[i]);
        on_surface += (y / a[i]) * (y / a[i]);
    }
    if (flat >= 0) {
        const double y = std::sqrt(std::max(0.0, 1 - on_surface));
        d2 += (y - q[flat]) * (y - q[flat]);
    }
    return side * std::sqrt(d2) * shortest;
}

} // namespace taihu
