#pragma once
#include <memory>
#include <span>
#include <vector>

#include "vdb_ops/field.h"

namespace taihu {

enum class Combine {
    unite,     ///< in any of them
    intersect, ///< in all of them
    subtract   ///< in the first and in none of the others
};

/// Fields combined: the least, or the greatest, of their distances. With `blend_m` the seams are
/// rounded by smooth_min() of that width (those between solids that are taken away, too): only
/// where two surfaces are within `blend_m` of each other. The order of the operands (of those after
/// the first, when they are subtracted) changes no bit.
///
/// The result is 1-Lipschitz and never over-estimates, where that holds for the operands. It is
/// exact, where they are, outside of a sharp union and inside of a sharp intersection or
/// difference; on the other side, near seams, and in blends it is a bound: redistance() makes it
/// true.
///
/// Where one operand decides a block or a leaf, the others are not evaluated there, and where one
/// alone is near, its values are handed on. For blending, operands are also asked on a band wider
/// by `blend_m`: a LevelSetField cannot do that, a PlacedLevelSetField can.
class CombineField final : public Field {
public:
    /// \param blend_m  width of the blend [m], >= 0; it moves the surface by up to blend_m / 4
    /// where two operands meet, and less than blend_m / 2 where many do.
    /// \throws Error bad_argument: no operand, a null one, a width out of range.
    CombineField(Combine how, std::vector<std::shared_ptr<const Field>> of, double blend_m = 0);
    /// \throws Error bad_argument: a blend of more than 1000 voxels.
    std::unique_ptr<LatticeField> on(const Lattice& lattice,
                                     const openvdb::CoordBBox& region) const override;
    Primitive n_primitives() const override;
    std::unique_ptr<FieldProbe> probe(const Box& region_m, double reach_m) const override;

private:
    Combine how_;
    std::vector<std::shared_ptr<const Field>> of_;
    double blend_m_;
};

/// A smooth minimum of one value or more: min over weights w_i >= 0 with sum 1 of
/// sum w_i v_i - (k / 2) (1 - sum w_i^2). Symmetric, so that the order of the values changes no
/// bit; once differentiable; 1-Lipschitz, as its gradient is w; equal to the least value when all
/// others are at least `k` above it. Of two values it is the usual quadratic
/// min(a, b) - max(k - |a - b|, 0)^2 / 4k; of three, it is not the two-fold blend of two, which
/// depends on the order. Own derivation, by the projection onto the simplex.
double smooth_min(std::vector<double> values, double k);
/// Of ascending values, at least one.
double smooth_min_sorted(std::span<const double> values, double k);
/// The weights w_i of smooth_min_sorted(), its derivatives; k > 0.
void smooth_min_weights(std::span<const double> values, double k, std::span<double> weights);

} // namespace taihu
