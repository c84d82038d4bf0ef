#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>

#include "stats/core/tri_mesh.h"

namespace taihu {

/// The nearest point of a triangle mesh, by an Embree hierarchy built once. Thread-safe to ask.
class SurfaceDistance {
public:
    /// \throws Error bad_argument: no triangle, or a non-finite position.
    explicit SurfaceDistance(const TriMesh& mesh);
    SurfaceDistance(SurfaceDistance&&) noexcept;
    SurfaceDistance& operator=(SurfaceDistance&&) noexcept;
    ~SurfaceDistance();

    /// Distance from `point` to the surface [m], >= 0; `at_most` ends the search early (then that).
    double operator()(const Vec3& point, double at_most = 1e300) const;
    /// The nearest surface point itself.
    Vec3 nearest(const Vec3& point) const;
    /// The index of a triangle that the nearest point lies on (of several, the lowest).
    std::uint32_t nearest_triangle(const Vec3& point) const;

private:
    struct Scene;
    std::unique_ptr<Scene> scene_;
};

/// Distances between two surfaces, both ways, by true closest points (never |field|).
struct TwoSidedDistance {
    double max_m = 0; ///< larger of the two maxima (a sampled Hausdorff distance)
    double max_a_to_b_m = 0, max_b_to_a_m = 0;
    double rms_m = 0; ///< larger of the two root mean squares over the area
    std::size_t n_samples = 0;
};

/// Samples: all vertices, edge middles and face middles of each mesh, plus a regular barycentric
/// pattern on faces whose longest edge exceeds `spacing_m`, so that no point of a face is farther
/// than about `spacing_m` from a sample. Deterministic on any number of threads. \param spacing_m
/// > 0, and at least 1e-5 of the longer mesh. \throws Error bad_argument: another spacing, or what
/// SurfaceDistance refuses.
TwoSidedDistance two_sided_distance(const TriMesh& a, const TriMesh& b, double spacing_m);

} // namespace taihu
