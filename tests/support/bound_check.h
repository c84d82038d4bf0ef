#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "stats/core/sphere.h"
#include "stats/core/tri_mesh.h"
#include "tests/support/zero_set.h"

namespace taihu {

/// Samples beyond a bound.
struct OffBound {
    std::size_t n = 0, n_thin = 0; ///< thin: the solid or the air there is thinner than a voxel
    double worst_rel = 0;          ///< the farthest, over the bound; no more than 8
    Vec3 worst;
};

struct BoundVerdict {
    OffBound mesh, surface;    ///< from the mesh to the surface, and back
    std::size_t n_samples = 0; ///< both ways
    std::size_t n_named = 0;   ///< in the places that were named, not judged
    std::size_t n_unclear = 0;
};

/// Whether meshes keep a bound of their distance to the surface of a formula, both ways: by the
/// values of the formula and CGAL's distances alone. Samples lie a third of a voxel apart on the
/// mesh; on the surface half a voxel, denser where they are far from the mesh.
class BoundCheck {
public:
    /// \param box  of the solid.
    BoundCheck(Lipschitz formula, const Box& box, double voxel_m);

    BoundVerdict judge(const TriMesh& mesh, double bound_m, std::span<const Sphere> named) const;

private:
    void judge_mesh(const TriMesh& mesh, double bound_m, std::span<const Sphere> named,
                    BoundVerdict& verdict) const;
    void judge_surface(const TriMesh& mesh, double bound_m, std::span<const Sphere> named,
                       BoundVerdict& verdict) const;
    bool is_thin(const Vec3& on_surface) const;
    bool is_near_thin(const Vec3& p) const;

    Lipschitz formula_;
    double voxel_m_;
    std::vector<Vec3> points_; ///< of the surface
    std::vector<std::uint8_t> is_thin_;
};

} // namespace taihu
