#pragma once
#include <openvdb/openvdb.h>

#include "vdb_ops/field.h"

namespace taihu {

/// A level set as a field on its own lattice: values are handed on as they stand.
class LevelSetField final : public Field {
public:
    /// \throws Error bad_argument as lattice_of().
    explicit LevelSetField(openvdb::FloatGrid::ConstPtr grid);
    /// \throws Error bad_argument: a lattice other than the grid's own.
    std::unique_ptr<LatticeField> on(const Lattice& lattice,
                                     const openvdb::CoordBBox& region) const override;
    Primitive n_primitives() const override { return 1; }
    /// Trilinear: right as far as the grid's half width less sqrt(3) voxels.
    std::unique_ptr<FieldProbe> probe(const Box& region_m, double reach_m) const override;

private:
    openvdb::FloatGrid::ConstPtr grid_;
};

} // namespace taihu
