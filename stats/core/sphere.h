#pragma once
#include "stats/core/vec3.h"

namespace taihu {

/// A ball; a hole is a ball to remove.
struct Sphere {
    Vec3 center;         ///< [m]
    double radius_m = 0; ///< > 0

    friend constexpr bool operator==(const Sphere&, const Sphere&) = default;
};

} // namespace taihu
