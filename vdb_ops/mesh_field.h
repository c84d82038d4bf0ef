#pragma once
#include <memory>

#include "vdb_ops/closed_mesh.h"
#include "vdb_ops/field.h"

namespace taihu {

/// A closed mesh as an exact signed distance. Sign: the integer winding number counted along grid
/// columns, inside where it is not 0. Distance: nearest face, evaluated only in leaves that a face
/// comes near; voxels within 1e-5 of the surface are 0. Several shells combine by min, cavities by
/// max(d, -cavity), so walls inside a solid vanish. A shell that crosses itself has the right sign;
/// its distance near the crossing is approximate.
class MeshField final : public Field {
public:
    explicit MeshField(ClosedMesh mesh);
    /// Cost: the columns and a coarse list of faces; serial parts O(faces).
    std::unique_ptr<LatticeField> on(const Lattice& lattice,
                                     const openvdb::CoordBBox& region) const override;
    Primitive n_primitives() const override { return 1; }
    std::unique_ptr<FieldProbe> probe(const Box& region_m, double reach_m) const override;
    const ClosedMesh& mesh() const { return mesh_; }

private:
    ClosedMesh mesh_;
};

} // namespace taihu
