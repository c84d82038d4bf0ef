#pragma once
#include <span>
#include <vector>

#include "stats/core/sphere.h"

namespace taihu {

/// Balls of one radius round points: one for all that lie in a cube as wide as it, which it covers.
std::vector<Sphere> balls_over_cubes(std::span<const Vec3> points, double radius_m);

/// Balls of one radius, no centre in another ball: each is the first of the points in none before.
/// O(points x balls).
std::vector<Sphere> balls_apart(std::span<const Vec3> points, double radius_m);

} // namespace taihu
