#pragma once
#include "stats/sample.h"

namespace taihu {

/// How many hole centres a unit volume holds.
struct NumberDensity {
    double estimate = 0;   ///< [1 / unit^3]
    double lo = 0, hi = 0; ///< the interval, which always holds the estimate
    /// Share of these holes whose diameter is below the detection limit: no profile stands for
    /// them, their number is what the family of the law makes of the seen ones.
    double extrapolated_share = 0;
    friend constexpr bool operator==(const NumberDensity&, const NumberDensity&) = default;
};

/// The number of holes to expect in a volume, with the same interval; the number that is found
/// there spreads about it by its square root (Poisson).
/// \param volume  [unit^3]; of the solid grown by a radius when holes may bite its surface. >= 0.
/// \throws Error bad_argument: volume.
NumberDensity expected_holes(const NumberDensity& n_v, double volume);

/// N_A of the profiles at and above the detection limit [1 / unit^2], with no law assumed: each
/// stands for 1 / (area g(d)), after Horvitz and Thompson.
/// \throws Error bad_input: as Detection, or the area is unknown.
double profiles_per_area(const Sample& sample);

} // namespace taihu
