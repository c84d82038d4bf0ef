#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "mesh_out/labelled_mesh.h"
#include "stats/core/progress.h"
#include "vdb_ops/field_probe.h"

namespace taihu {

class CornerTable;

struct BoundedSettings {
    double spacing_m = 0; ///< of the lattice that the mesh was made on [m], > 0
    bool balance = true;  ///< move vertices off the surface so that errors fall on both sides
    /// So many faces may be left crossing others, where no more vertices may move; more, and all is
    /// simplified again.
    std::size_t few_crossings = 0;
    double max_turn_deg = 60; ///< between a new face and the field's normal, (0, 90]
};

/// Where the stated bound is not held: walls, fins and slits that the mesh does not resolve.
struct UnresolvedPlace {
    Vec3 center;         ///< [m]
    double radius_m = 0; ///< of a ball round all faces concerned
    double error_m = 0;  ///< an upper bound of their distance, or infinite when none was found
};

struct BoundedMesh {
    LabelledMesh mesh;
    double bound_m = 0; ///< no face point is farther from the solid's surface, but in `unresolved`
    double error_m = 0; ///< the greatest distance that was certified, <= bound_m
    std::vector<UnresolvedPlace> unresolved;
    std::size_t n_crossings = 0; ///< pairs of faces that still meet; 0 unless the input crosses
};

/// Fewer triangles under a bound of the true distance to the surface of a field: half-edge
/// collapses in the order of quadrics, each accepted only when every new face stays within the
/// bound, on the rims and corners of its primitives, and pierces nothing; then balanced, checked
/// again face by face and mended where need be. Distances to balls and past their rims have closed
/// forms; other primitives are sampled at 1.6 spacings with a margin of their second differences.
/// The surface stays a closed 2-manifold of the same pieces and genus. Levels are made one from
/// another: ask for ascending bounds. The same mesh on any number of threads.
class BoundedSimplifier {
public:
    /// \param mesh  closed 2-manifold, its vertices on the primitives of their labels; those
    /// without
    ///   a label, or off their primitives, go first.
    /// \param field  a probe of the whole mesh with a reach of 8 spacings and 5.5 of the largest
    ///   bound; must outlive this.
    /// \throws Error bad_argument: a setting out of range, positions that are not finite, not
    ///   one label set for each position, no closed 2-manifold.
    BoundedSimplifier(LabelledMesh mesh, const FieldProbe& field, const BoundedSettings& settings);

    /// \param bound_m  at least that of the call before. \param kept  what lies in these balls
    /// stays as it came.
    /// \throws Error bad_argument: another bound; cancelled: within one block.
    BoundedMesh within(double bound_m, std::span<const Sphere> kept = {},
                       Progress* progress = nullptr);
    /// At most `n`, and within 2 % of it where any bound leads there, by searching it from that of
    /// the call before. \throws Error bad_argument: n below 4 or above what there is; numeric: all
    ///   bounds up to a quarter of the solid leave more; cancelled.
    BoundedMesh to_triangles(std::size_t n, Progress* progress = nullptr);

    /// On the surface, of the last level, or as it came.
    const LabelledMesh& surface() const { return surface_.mesh; }

private:
    /// A mesh of exact vertices with its corner table.
    struct Surface {
        LabelledMesh mesh;
        std::shared_ptr<const CornerTable> table;
    };

    /// \param collapsed  becomes the surface before it is balanced and mended.
    BoundedMesh level(double bound_m, std::span<const Sphere> kept, Surface& collapsed,
                      Progress* progress) const;

    Surface surface_; ///< of the last level
    const FieldProbe& field_;
    BoundedSettings settings_;
    double bound_m_ = 0; ///< of the last level
};

} // namespace taihu
