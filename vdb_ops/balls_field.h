#pragma once
#include <span>
#include <vector>

#include "stats/core/sphere.h"
#include "vdb_ops/field.h"

namespace taihu {

/// The union of any number of balls: min_i |x - c_i| - r_i. The order of the balls changes no bit.
/// Opening a block costs the balls that meet it; a leaf inside one ball is never evaluated.
class BallsField final : public Field {
public:
    /// \throws Error bad_argument: `holes[i]` with a radius not finite and > 0, or a centre not
    /// finite.
    explicit BallsField(std::span<const Sphere> balls);
    std::unique_ptr<LatticeField> on(const Lattice& lattice,
                                     const openvdb::CoordBBox& region) const override;
    Primitive n_primitives() const override { return static_cast<Primitive>(balls_.size()); }
    std::unique_ptr<FieldProbe> probe(const Box& region_m, double reach_m) const override;

private:
    std::vector<Sphere> balls_;
};

} // namespace taihu
