#pragma once
#include <functional>
#include <vector>

#include "stats/core/box.h"
#include "stats/core/vec3.h"

namespace taihu {

// The surface where a 1-Lipschitz function changes sign, from the values of the function alone: no
// primitives, no projection, no mesh.
using Lipschitz = std::function<double(const Vec3&)>; ///< [m], called from several threads

enum class Nearby {
    yes,    ///< a point of the other sign was found within reach
    no,     ///< all of the ball around is on one side
    unclear ///< too many parts of the ball, or slivers below a hundredth of it, may be on the other
};
/// Whether the surface comes within `reach_m` of `p`. Halves cubes that may hold it.
Nearby surface_within(const Lipschitz& f, const Vec3& p, double reach_m);

/// Points of the surface on the edges of a lattice of this spacing, in an order of their own that
/// is always the same.
std::vector<Vec3> surface_crossings(const Lipschitz& f, const Box& box, double spacing_m);

/// Its direction, by differences over twice `step_m`; 0 where there is none.
Vec3 gradient(const Lipschitz& f, const Vec3& p, double step_m);

/// Where f changes its sign between two points that differ in it.
Vec3 crossing_between(const Lipschitz& f, Vec3 a, Vec3 b);

} // namespace taihu
