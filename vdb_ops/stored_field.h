#pragma once
#include <memory>

#include "vdb_ops/field.h"

namespace taihu {

/// A field as a level set gives it back: rasterizing what is made of this one gives, bit for bit,
/// what rasterizing the field first and building on that level set gives, without the level set.
class StoredField final : public Field {
public:
    /// \throws Error bad_argument: a null field.
    explicit StoredField(std::shared_ptr<const Field> of);
    std::unique_ptr<LatticeField> on(const Lattice& lattice,
                                     const openvdb::CoordBBox& region) const override;
    Primitive n_primitives() const override { return of_->n_primitives(); }
    std::unique_ptr<FieldProbe> probe(const Box& region_m, double reach_m) const override {
        return of_->probe(region_m, reach_m);
    }

private:
    std::shared_ptr<const Field> of_;
};

} // namespace taihu
