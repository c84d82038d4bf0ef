#pragma once
#include <cstdint>

#include "stats/detection.h"
#include "stats/law.h"
#include "stats/sample.h"
#include "stats/section_draws.h"

namespace taihu {

/// Samples as a sample could have been, had the sections of a law been measured: as many profiles,
/// seen through the same limits and edges, in bins when it is in bins. Immutable; may be shared by
/// threads.
class Resampler {
public:
    /// \throws Error bad_input: as Detection; numeric: as SectionDraws.
    Resampler(const Sample& sample, const Law& law);

    /// Sample number i, < 2^24, which depends on the seed and i alone.
    /// \throws Error numeric: hardly a profile is seen through the windows.
    Sample draw(std::uint64_t seed, std::uint64_t i) const;

    const Detection& detection() const { return detection_; }

private:
    void sort_into_bins(Sample& drawn) const;

    Sample like_; ///< the sample, its limit filled in and its diameters left out
    std::uint64_t n_;
    Detection detection_;
    SectionDraws draws_;
};

} // namespace taihu
