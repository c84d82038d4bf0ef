#pragma once
#include <memory>

#include "vdb_ops/closed_mesh.h"
#include "vdb_ops/field.h"

namespace taihu {

/// A closed mesh as an exact signed distance. Sign: the integer winding number counted along grid
/// columns, inside where it is not 0. Distance: nearest face, evaluated only in leaves that a face
/// comes near; voxels within 1e-5 of the surface are 0. Several shells combine by min, cavities by
/// max(d, -cavity), so walls inside a solid vanish; under ShellRule::parity by
/// max(min(a, b), -max(a, b)). A shell that crosses itself has the right sign;
/// its distance near the crossing is approximate.
class MeshField final : public Field {
public:
    explicit MeshField(ClosedMesh mesh);
    /// Cost: the columns and a coarse list of faces; serial parts O(faces).
    std::unique_ptr<LatticeField> on(const Lattice& lattice,
                                     const openvdb::CoordBBox& region) const override;
    /// One for each set of faces that meet at less than 30 degrees; one for all where nearly every
    /// face would be one.
    Primitive n_primitives() const override;
    std::unique_ptr<FieldProbe> probe(const Box& region_m, double reach_m) const override;
    const ClosedMesh& mesh() const { return mesh_; }

private:
    struct Patches;
    const Patches& patches() const;

    ClosedMesh mesh_;
    std::shared_ptr<Patches> patches_; ///< made when first asked for
};

} // namespace taihu
