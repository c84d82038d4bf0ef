#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "stats/core/tri_mesh.h"
#include "vdb_ops/field_probe.h"

namespace taihu {

/// Exact points of a solid's surface, sorted by what they lie on. Where solid or air is thinner
/// than about a spacing they are `thin` and kept apart.
struct SurfacePoints {
    std::vector<Vec3> face, rim, corner, thin;
};

/// From random points beside a dense mesh, projected onto the primitives that decide there.
SurfacePoints surface_points(const FieldProbe& field, const TriMesh& dense, double spacing,
                             std::size_t n);

struct ErrorSample {
    std::vector<float> values;
    double most() const;
    double rms() const;
    double quantile(double q) const;
    double share_above(double value) const;
};

/// Distances between a mesh and the exact surface, both ways. From the mesh: all points of a dense
/// lattice on every face, to the surface by projection (never |field| alone).
struct SurfaceErrors {
    ErrorSample mesh, face, rim, corner, thin;
    ErrorSample turn_deg;     ///< between the face's normal and the field's at its middle
    std::vector<Vec3> places; ///< points of the mesh beyond `bound`
};
SurfaceErrors surface_errors(const FieldProbe& field, const SurfacePoints& points,
                             const TriMesh& mesh, double step, double bound);

} // namespace taihu
