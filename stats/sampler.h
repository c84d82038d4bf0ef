#pragma once
#include <cstdint>

#include "stats/core/box.h"
#include "stats/core/rng.h"
#include "stats/core/sphere.h"
#include "stats/law.h"

namespace taihu {

/// Streams of random numbers, one for each purpose; the values are part of every recorded output.
inline constexpr std::uint32_t kHoleStream = 0x686f6c65;  ///< centres and diameters of holes
inline constexpr std::uint32_t kCountStream = 0x636f756e; ///< how many there are

/// An endless list of holes, addressed by number: centres uniform in a box, diameters by a law.
///
/// hole(i) depends on the seed and i alone, so the first N holes of a stream are the first N of any
/// longer list, on any thread. The same bytes on every machine for laws whose quantile has them.
class HoleStream {
public:
    /// \param box      where centres lie [m].
    /// \param scale_m  length of one unit of the law [m]: 1 for a law in metres.
    /// \throws Error bad_argument: box empty or not finite; scale not finite and > 0.
    HoleStream(Law law, const Box& box, double scale_m, std::uint64_t seed);

    Sphere hole(std::uint64_t i) const;
    double radius_m(std::uint64_t i) const; ///< of that hole

private:
    Law law_;
    Box box_;
    double scale_m_;
    Rng rng_;
};

/// A Poisson number with this mean: how many of a process' unit gaps, -log(u), fit into `mean`.
/// The same on every machine. Time O(mean).
/// \param mean  0..1e8.
/// \param rng   its stream should be kCountStream; items 0, 1, ... are used.
/// \throws Error bad_argument: mean out of range.
std::uint64_t poisson_count(double mean, const Rng& rng);

} // namespace taihu
