#pragma once
#include <vector>

#include "vdb_ops/field.h"
#include "vdb_ops/solids.h"

namespace taihu {

/// The union of any number of analytic solids, each with a place of its own: the least of their
/// exact distances. The order of the solids changes no bit. Opening a block costs the solids whose
/// surface comes near it, a leaf those whose surface comes near the leaf; what lies inside one
/// solid is never evaluated. Memory: about 500 bytes a solid, 5 kB for one larger than 4 blocks.
class SolidsField final : public Field {
public:
    /// \throws Error bad_argument: `solids[i]`, and its length that is out of range.
    explicit SolidsField(std::vector<AnalyticSolid> solids);
    std::unique_ptr<LatticeField> on(const Lattice& lattice,
                                     const openvdb::CoordBBox& region) const override;
    Primitive n_primitives() const override { return first_.back(); }
    std::unique_ptr<FieldProbe> probe(const Box& region_m, double reach_m) const override;

private:
    std::vector<AnalyticSolid> solids_;
    std::vector<Primitive> first_; ///< of each solid, and past the last
};

} // namespace taihu
