#include "stats/bootstrap.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "stats/resample_detail.h"

namespace taihu {
namespace {

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
    const Resampler resampler(sample, law);
    const FitSettings fit{.resolution = settings.resolution};
    std::vector<std::vector<double>> f3(diameters.size());
    Band band{{diameters.begin(), diameters.end()}, {}, {}, {}, 0};
    for (std::uint64_t i = 0; i < settings.n_resamples; ++i) {
        check_cancelled(progress);
        report_fraction(progress,
                        static_cast<double>(i) / static_cast<double>(settings.n_resamples));
        try {
            const Law again = likeliest_law(resampler.draw(settings.seed, i), law.family(), fit);
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
