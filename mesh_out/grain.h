#pragma once
#include <cstdint>

#include "stats/core/vec3.h"

namespace taihu {

/// Stone made of grains: a number in 0..1 that is the same all over a grain and of its own for
/// each. Grains are the cells of points, one at random in each cube of side `size_m`; in space, so
/// that no seam shows. The same on every platform. \param size_m  of a grain, > 0.
double grain(const Vec3& p, double size_m, std::uint64_t seed = 0);

} // namespace taihu
