#pragma once
#include <functional>

#include "stats/core/box.h"
#include "vdb_ops/field.h"

namespace taihu {

/// A solid given by a distance function: 1-Lipschitz, negative inside, exact near the surface.
class AnalyticField final : public Field {
public:
    /// \param box  holds the solid [m]; \param distance  [m], called from several threads.
    AnalyticField(const Box& box, std::function<double(const Vec3&)> distance);
    std::unique_ptr<LatticeField> on(const Lattice& lattice,
                                     const openvdb::CoordBBox& region) const override;

private:
    Box box_;
    std::function<double(const Vec3&)> distance_;
};

/// Exact signed distances of solids centred on the origin, axis +Y. Lengths [m], > 0.
double box_distance(const Vec3& p, const Vec3& half_size);
double cylinder_distance(const Vec3& p, double radius_m, double half_height_m);
/// A ring round the Y axis: circle of radius `ring_m`, thick by `tube_m` (radii).
double torus_distance(const Vec3& p, double ring_m, double tube_m);
/// By bisection on the Lagrange multiplier of the nearest point (robust for any axes; Eberly,
/// "Distance from a point to an ellipsoid", from memory, unchecked); error below 1e-12 of the size.
double ellipsoid_distance(const Vec3& p, const Vec3& semi_axes);

} // namespace taihu
