#include "stats/bootstrap.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "stats/core/error.h"
#include "stats/detection.h"
#include "stats/number_detail.h"
#include "stats/section_draws.h"

namespace taihu {
namespace {

// Streams of random numbers, one for each purpose.
constexpr std::uint32_t kBandStream = 0x62616e64, kSeenStream = 0x7365656e;

void check_settings(const BandSettings& settings, const Law& law) {
    if (settings.n_resamples < 19 || settings.n_resamples > 100'000)
        throw Error(Fault::bad_argument, "band: n_resamples is " +
                                             std::to_string(settings.n_resamples) +
                                             "; must be in 19..100000");
    if (!(settings.level >= 0.5 && settings.level <= 0.9999))
        throw Error(Fault::bad_argument,
                    "band: level is " + shortest(settings.level) + "; must be in 0.5..0.9999");
    if (law.family() == Family::empirical)
        throw Error(Fault::bad_argument,
                    "band: an empirical law is not fitted again; fit a family");
}

// Bins that hold every profile: those of the sample, one before down to the limit, and after the
// last one as many as it takes, each twice as wide.
std::vector<Bin> covering_bins(const Sample& sample, double limit, double greatest) {
    std::vector<Bin> bins = sample.bins;
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

// A sample like `sample`, number `resample` of its kind.
Sample draw(const Sample& sample, const Detection& detection, const SectionDraws& draws,
            std::uint64_t seed, std::uint64_t resample) {
    const std::uint64_t n = n_profiles(sample);
    const Rng sizes{seed, kBandStream}, seen{seed, kSeenStream};
    Sample drawn = sample;
    drawn.diameters.clear();
    drawn.detection_limit = detection_limit(sample, {});
    for (std::uint64_t i = 0; drawn.diameters.size() < n; ++i) {
        if (i > 10'000 * n)
            throw Error(Fault::numeric, "band: of 10000 profiles drawn not one was seen through "
                                        "the windows; count profiles by their centre");
        const std::uint64_t item = (resample << 40) + i;
        const double d = draws.diameter(sizes, item);
        if (seen.uniform(item) < detection.share(d))
            drawn.diameters.push_back(d);
    }
    if (sample.bins.empty())
        return drawn;
    const double greatest = *std::max_element(drawn.diameters.begin(), drawn.diameters.end());
    drawn.bins = covering_bins(sample, detection.limit(), greatest);
    for (const double d : drawn.diameters)
        ++std::lower_bound(drawn.bins.begin(), drawn.bins.end() - 1, d,
                           [](const Bin& bin, double v) { return bin.hi < v; })
              ->count;
    drawn.diameters.clear();
    return drawn;
}

double quantile(const std::vector<double>& sorted, double share) {
    const double at = share * static_cast<double>(sorted.size() - 1);
    const auto i = static_cast<std::size_t>(at);
    return i + 1 < sorted.size() ? std::lerp(sorted[i], sorted[i + 1], at - static_cast<double>(i))
                                 : sorted.back();
}

} // namespace

Band f3_band(const Sample& sample, const Law& law, std::span<const double> diameters,
             const BandSettings& settings, Progress* progress) {
    check_settings(settings, law);
    const Detection detection(sample);
    const SectionDraws draws(law, detection.limit());
    const FitSettings fit{.resolution = settings.resolution};
    std::vector<std::vector<double>> f3(diameters.size());
    Band band{{diameters.begin(), diameters.end()}, {}, {}, {}, 0};
    for (std::uint64_t i = 0; i < settings.n_resamples; ++i) {
        check_cancelled(progress);
        report_fraction(progress,
                        static_cast<double>(i) / static_cast<double>(settings.n_resamples));
        try {
            const Law again =
                likeliest_law(draw(sample, detection, draws, settings.seed, i), law.family(), fit);
            for (std::size_t k = 0; k < diameters.size(); ++k)
                f3[k].push_back(again.cdf(diameters[k]));
        } catch (const Error& e) {
            if (e.fault() == Fault::bad_argument || ++band.n_failed * 20 > settings.n_resamples)
                throw;
        }
    }
    for (std::size_t k = 0; k < diameters.size(); ++k) {
        std::sort(f3[k].begin(), f3[k].end());
        band.f3.push_back(law.cdf(diameters[k]));
        band.lo.push_back(quantile(f3[k], (1 - settings.level) / 2));
        band.hi.push_back(quantile(f3[k], (1 + settings.level) / 2));
    }
    return band;
}

} // namespace taihu
