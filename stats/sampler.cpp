#include "stats/sampler.h"

#include <cmath>
#include <utility>

#include "stats/core/error.h"
#include "stats/core/portable_math.h"
#include "stats/number_detail.h"

namespace taihu {

HoleStream::HoleStream(Law law, const Box& box, double scale_m, std::uint64_t seed)
    : law_(std::move(law)), box_(box), scale_m_(scale_m), rng_{seed, kHoleStream} {
    if (box.empty() || !is_finite(box.lo) || !is_finite(box.hi))
        throw Error(Fault::bad_argument,
                    "hole stream: the box is empty or not finite; give its two corners in metres");
    if (!(scale_m > 0 && std::isfinite(scale_m)))
        throw Error(Fault::bad_argument,
                    "hole stream: scale_m is " + shortest(scale_m) + "; must be finite and > 0");
}

Sphere HoleStream::hole(std::uint64_t i) const {
    const Vec3 size = box_.size();
    const Vec3 center{box_.lo.x + rng_.uniform(i, 0) * size.x,
                      box_.lo.y + rng_.uniform(i, 1) * size.y,
                      box_.lo.z + rng_.uniform(i, 2) * size.z};
    return {center, radius_m(i)};
}

double HoleStream::radius_m(std::uint64_t i) const {
    return 0.5 * scale_m_ * law_.quantile(rng_.uniform(i, 3));
}

std::uint64_t poisson_count(double mean, const Rng& rng) {
    if (!(mean >= 0 && mean <= 1e8))
        throw Error(Fault::bad_argument, "poisson count: a mean of " + shortest(mean) +
                                             "; must be in 0..1e8, use fewer or larger holes");
    double left = mean;
    for (std::uint64_t n = 0;; ++n) {
        left += portable_log(rng.uniform(n));
        if (left < 0)
            return n;
    }
}

} // namespace taihu
