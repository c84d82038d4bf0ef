#pragma once
#include <string>

#include "stats/core/tri_mesh.h"
#include "vdb_ops/field.h"
#include "vdb_ops/similarity.h"

namespace taihu {

/// (|x/a|^(2/around) + |z/c|^(2/around))^(around/vertical) + |y/b|^(2/vertical) <= 1: exponents of
/// 1 give an ellipsoid, towards 0 a box, 2 an octahedron; it is convex.
struct Superquadric {
    Vec3 semi_axes_m{0.5, 0.5, 0.5}; ///< a, b, c [m], > 0
    double vertical = 1;             ///< exponent of upright sections, 0.1..2
    double around = 1;               ///< exponent of level sections, 0.1..2
};

/// \throws Error bad_argument: a length or an exponent out of range, named after `where`.
void check_superquadric(const Superquadric& shape, const std::string& where);

/// A closed, outward mesh with all its vertices on the surface: 8 octants of n x n cells, finer
/// where it bends. The last bits are those of the platform's pow, sin and cos.
TriMesh superquadric_mesh(const Superquadric& shape, int n);

/// There is no closed form of its distance; iterations find one of several nearest points inside.
/// So on each lattice it becomes a mesh that lies within 0.02 voxel of the surface (1e-6 of its
/// size where that is more; measured at the middles of edges and faces), inscribed, and the
/// distances are the exact ones of that mesh: 1-Lipschitz, exceeding the true ones by no more than
/// that. Up to 4 million triangles, for 40,000 voxels of length.
class SuperquadricField final : public Field {
public:
    /// \throws Error as check_superquadric().
    explicit SuperquadricField(const Superquadric& shape, const Similarity& at = {});
    std::unique_ptr<LatticeField> on(const Lattice& lattice,
                                     const openvdb::CoordBBox& region) const override;
    Primitive n_primitives() const override { return 1; }
    std::unique_ptr<FieldProbe> probe(const Box& region_m, double reach_m) const override;

private:
    Superquadric shape_;
    Similarity at_;
};

} // namespace taihu
