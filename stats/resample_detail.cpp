#include "stats/resample_detail.h"

#include <algorithm>

#include "stats/core/error.h"

namespace taihu {
namespace {

// Streams of random numbers, one for each purpose.
constexpr std::uint32_t kSizeStream = 0x62616e64, kSeenStream = 0x7365656e;

// Bins that hold every profile: those of the sample, one before down to the limit, and after the
// last one as many as it takes, each twice as wide.
std::vector<Bin> covering_bins(std::vector<Bin> bins, double limit, double greatest) {
    for (Bin& bin : bins)
        bin.count = 0;
    if (limit < bins.front().lo)
        bins.insert(bins.begin(), {limit, bins.front().lo, 0});
    while (bins.back().hi < greatest) {
        const Bin& last = bins.back();
        bins.push_back({last.hi, last.hi + 2 * (last.hi - last.lo), 0});
    }
    return bins;
}

} // namespace

Resampler::Resampler(const Sample& sample, const Law& law)
    : like_(sample), n_(n_profiles(sample)), detection_(sample), draws_(law, detection_.limit()) {
    like_.detection_limit = detection_limit(sample, {});
    like_.diameters.clear();
}

void Resampler::sort_into_bins(Sample& drawn) const {
    const double greatest = *std::max_element(drawn.diameters.begin(), drawn.diameters.end());
    drawn.bins = covering_bins(like_.bins, detection_.limit(), greatest);
    for (const double d : drawn.diameters)
        ++std::lower_bound(drawn.bins.begin(), drawn.bins.end() - 1, d,
                           [](const Bin& bin, double v) { return bin.hi < v; })
              ->count;
    drawn.diameters.clear();
}

Sample Resampler::draw(std::uint64_t seed, std::uint64_t i) const {
    const Rng sizes{seed, kSizeStream}, seen{seed, kSeenStream};
    Sample drawn = like_;
    for (std::uint64_t k = 0; drawn.diameters.size() < n_; ++k) {
        if (k > 10'000 * n_)
            throw Error(Fault::numeric, "resampling: of 10000 profiles drawn not one was seen "
                                        "through the windows; count profiles by their centre");
        const std::uint64_t item = (i << 40) + k;
        const double d = draws_.diameter(sizes, item);
        if (seen.uniform(item) < detection_.share(d))
            drawn.diameters.push_back(d);
    }
    if (!like_.bins.empty())
        sort_into_bins(drawn);
    return drawn;
}

} // namespace taihu
