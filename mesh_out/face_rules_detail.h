#pragma once
#include <algorithm>
#include <array>
#include <cstdint>

#include "stats/core/vec3.h"

namespace taihu {

using FaceCorners = std::array<Vec3, 3>;
using FaceValues = std::array<double, 3>; ///< of a primitive at the corners [m]

/// The range of values of a primitive over a face [m].
struct FaceRange {
    double lo = 0, hi = 0;
    Vec3 gradient;          ///< summed over samples; 0 for balls
    double least_slope = 1; ///< of the samples
    double most() const { return std::max(-lo, hi); }
};

/// The gradient at a vertex of one of its primitives.
struct FaceSlope {
    static constexpr std::uint32_t kNone = 0xffffffffu;
    std::uint32_t shape = kNone;
    std::array<float, 3> gradient{};
    Vec3 at() const { return {gradient[0], gradient[1], gradient[2]}; }
};

/// What one face is judged by.
struct FaceRules {
    double face_m = 0;         ///< distance to its own primitive, at most
    double rim_m = 0;          ///< distance past rims, at most
    bool centred = false;      ///< judge as if values were shifted to be centred on 0
    double turn_cosine = -1;   ///< of the angle to the gradient at the middle, at least
    bool exact_corners = true; ///< corners lie on all their primitives
    bool may_pierce = false;   ///< faces may pass through other primitives, within `rim_m`
    bool may_halve = true;     ///< parts of faces may be looked at one by one
    double clear_m = 0;        ///< FaceErrors::Clearance::sampled of the first corner, or less
    /// Of the corners: then other primitives go by parabolas where these leave no doubt, which is
    /// no bound any more.
    const std::array<FaceSlope, 3>* slopes = nullptr;
};

/// Of the parabolas along the edges of a face that go by values and gradients at its corners.
struct FaceParabolas {
    FaceRange range;
    double skew = 0;        ///< how far the cubics through all of these are from them, at most
    bool is_smooth = false; ///< gradients are those of a distance, and differ little
};
FaceParabolas parabolas(const FaceCorners& face, const FaceValues& values,
                        const std::array<Vec3, 3>& gradients);

} // namespace taihu
