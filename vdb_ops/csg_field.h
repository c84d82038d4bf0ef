#pragma once
#include <memory>

#include "vdb_ops/field.h"

namespace taihu {

/// A minus B: max(a, -b). Where B covers a region, A is never evaluated there.
class DifferenceField final : public Field {
public:
    DifferenceField(std::shared_ptr<const Field> a, std::shared_ptr<const Field> b);
    std::unique_ptr<LatticeField> on(const Lattice& lattice,
                                     const openvdb::CoordBBox& region) const override;
    Primitive n_primitives() const override;
    std::unique_ptr<FieldProbe> probe(const Box& region_m, double reach_m) const override;

private:
    std::shared_ptr<const Field> a_, b_;
};

} // namespace taihu
