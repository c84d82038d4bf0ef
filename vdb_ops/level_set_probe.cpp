#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "vdb_ops/level_set_field.h"
#include "vdb_ops/level_set_probe_detail.h"
#include "vdb_ops/placed_level_set_field.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

using openvdb::Coord;
// Without a place in the tree's list of accessors, which costs more than a look-up saves.
using Leaf = openvdb::FloatTree::LeafNodeType;
using Accessor = openvdb::tree::ValueAccessor<const openvdb::FloatTree, false>;

double mix(double a, double b, double t) {
    return a + (b - a) * t;
}

/// Trilinear between voxels, as one primitive.
class LevelSetProbe final : public FieldProbe {
public:
    LevelSetProbe(openvdb::FloatGrid::ConstPtr grid, const Similarity& at)
        : grid_(std::move(grid)), at_(at), back_(at.inverse()), is_placed_(!at.is_identity()),
          own_(lattice_of(*grid_)), per_m_(1 / own_.voxel_m) {
        list_places();
    }

    Nearest at(const Vec3& p) const override { return {sample(p).value_m, 0}; }
    Value of(Primitive, const Vec3& p) const override { return sample(p); }
    Value slope(const Vec3& p, double) const override { return sample(p); }
    void near(const Vec3&, double, std::vector<Primitive>& out) const override { out.push_back(0); }
    std::optional<Sphere> ball(Primitive) const override { return std::nullopt; }

private:
    Value sample(const Vec3& p) const {
        const Vec3 q = ((is_placed_ ? back_.point(p) : p) - own_.origin) * per_m_;
        Coord c;
        for (int axis = 0; axis < 3; ++axis)
            c[axis] = static_cast<int>(std::floor(std::clamp(q[axis], -0x1p30, 0x1p30)));
        const double x = q.x - c.x(), y = q.y - c.y(), z = q.z - c.z();
        const std::array<double, 8> v = corners(c);
        const double v00 = mix(v[0], v[4], x), v01 = mix(v[1], v[5], x), v10 = mix(v[2], v[6], x),
                     v11 = mix(v[3], v[7], x);
        const double near = mix(v00, v10, y), far = mix(v01, v11, y);
        const Vec3 gradient =
            Vec3{mix(mix(v[4] - v[0], v[6] - v[2], y), mix(v[5] - v[1], v[7] - v[3], y), z),
                 mix(v10 - v00, v11 - v01, z), far - near} *
            per_m_;
        const double value_m = mix(near, far, z);
        if (is_placed_)
            return {value_m * at_.scale(), at_.direction(gradient)};
        return {value_m, gradient};
    }

    /// The values of the eight voxels from `c` on, z fastest.
    std::array<double, 8> corners(const Coord& c) const {
        constexpr int kLast = Leaf::DIM - 1;
        std::array<double, 8> v;
        if (!leaves_box_.isInside(c) || !leaves_box_.isInside(c.offsetBy(1))) {
            const Accessor accessor(grid_->tree());
            for (int k = 0; k < 8; ++k)
                v[static_cast<std::size_t>(k)] =
                    static_cast<double>(accessor.getValue(c.offsetBy(k >> 2, k >> 1 & 1, k & 1)));
            return v;
        }
        if ((c.x() & kLast) < kLast && (c.y() & kLast) < kLast && (c.z() & kLast) < kLast) {
            const Place& place = places_[number(c)]; // all in one leaf, as two in three are
            if (!place.values) {
                v.fill(static_cast<double>(place.tile));
                return v;
            }
            const float* at = place.values + Leaf::coordToOffset(c);
            for (std::size_t k = 0; k < 8; ++k)
                v[k] = static_cast<double>(at[(k >> 2) * 64 + (k >> 1 & 1) * 8 + (k & 1)]);
            return v;
        }
        for (int k = 0; k < 8; ++k) {
            const Coord corner = c.offsetBy(k >> 2, k >> 1 & 1, k & 1);
            const Place& place = places_[number(corner)];
            v[static_cast<std::size_t>(k)] = static_cast<double>(
                place.values ? place.values[Leaf::coordToOffset(corner)] : place.tile);
        }
        return v;
    }
    std::size_t number(const Coord& c) const {
        const Coord at = (c - leaves_box_.min());
        return (static_cast<std::size_t>(at.x() >> 3) * n_places_[1] +
                static_cast<std::size_t>(at.y() >> 3)) *
                   n_places_[2] +
               static_cast<std::size_t>(at.z() >> 3);
    }
    void list_places() {
        constexpr std::size_t kMostPlaces = std::size_t{1} << 24;
        openvdb::CoordBBox box;
        // Not evalLeafBoundingBox(), which passes over leaves without active voxels.
        for (auto leaf = grid_->tree().cbeginLeaf(); leaf; ++leaf)
            box.expand(leaf->getNodeBoundingBox());
        if (box.empty())
            return;
        std::size_t n = 1;
        for (int axis = 0; axis < 3; ++axis) {
            n_places_[static_cast<std::size_t>(axis)] =
                static_cast<std::size_t>(box.dim()[axis] >> 3);
            n *= n_places_[static_cast<std::size_t>(axis)];
        }
        if (n > kMostPlaces) // then by the tree
            return;
        leaves_box_ = box;
        places_.resize(n);
        const Accessor accessor(grid_->tree());
        Coord c;
        Place* place = places_.data();
        for (c.x() = box.min().x(); c.x() <= box.max().x(); c.x() += Leaf::DIM)
            for (c.y() = box.min().y(); c.y() <= box.max().y(); c.y() += Leaf::DIM)
                for (c.z() = box.min().z(); c.z() <= box.max().z(); c.z() += Leaf::DIM, ++place) {
                    if (const Leaf* leaf = accessor.probeConstLeaf(c))
                        place->values = leaf->buffer().data();
                    else
                        place->tile = accessor.getValue(c);
                }
    }

    /// Where a leaf is, or could be.
    struct Place {
        const float* values = nullptr; ///< of the leaf, or null
        float tile = 0;                ///< where there is none
    };

    openvdb::FloatGrid::ConstPtr grid_;
    Similarity at_, back_;
    bool is_placed_;
    Lattice own_;
    double per_m_;                  ///< voxels
    openvdb::CoordBBox leaves_box_; ///< whole leaves; empty where they are not listed
    std::array<std::size_t, 3> n_places_{};
    std::vector<Place> places_; ///< in the box, z fastest
};

} // namespace

std::unique_ptr<FieldProbe> level_set_probe(openvdb::FloatGrid::ConstPtr grid) {
    return std::make_unique<LevelSetProbe>(std::move(grid), Similarity());
}

std::unique_ptr<FieldProbe> LevelSetField::probe(const Box&, double) const {
    return level_set_probe(grid_);
}

std::unique_ptr<FieldProbe> PlacedLevelSetField::probe(const Box&, double reach_m) const {
    const Lattice own = lattice_of(*grid_);
    // The eight voxels around a point are within sqrt(3) of it.
    constexpr double kWidest_vox = 16;
    const double half_width = std::min(reach_m / at_.scale() / own.voxel_m + 1.74, kWidest_vox);
    return std::make_unique<LevelSetProbe>(as_wide_as(half_width), at_);
}

} // namespace taihu
