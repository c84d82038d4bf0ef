#pragma once
#include <functional>
#include <span>
#include <type_traits>

#include "stats/core/box.h"
#include "vdb_ops/field.h"

namespace taihu {

/// A solid given by a distance function: 1-Lipschitz, negative inside, exact near the surface. For
/// spheres, boxes and their like use SolidsField, which is faster and turns them.
class AnalyticField final : public Field {
public:
    /// Distances at so many points [m], called from several threads with whole leaves.
    using Distances = std::function<void(std::span<const Vec3> points, double* out)>;

    /// \param box  holds the solid [m].
    AnalyticField(const Box& box, Distances distances);

    /// \param distance  of one point [m], called from several threads.
    template <class Distance>
    requires std::is_invocable_r_v<double, const Distance&, const Vec3&>
    AnalyticField(const Box& box, Distance distance)
        : AnalyticField(box, Distances([distance](std::span<const Vec3> points, double* out) {
                            for (std::size_t i = 0; i < points.size(); ++i)
                                out[i] = distance(points[i]);
                        })) {}

    std::unique_ptr<LatticeField> on(const Lattice& lattice,
                                     const openvdb::CoordBBox& region) const override;
    Primitive n_primitives() const override { return 1; }
    std::unique_ptr<FieldProbe> probe(const Box& region_m, double reach_m) const override;

private:
    Box box_;
    Distances distances_;
};

/// Exact signed distance of a box centred on the origin [m]; half sizes > 0.
double box_distance(const Vec3& p, const Vec3& half_size);

} // namespace taihu
