#include "stats/goodness.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "stats/section_draws.h"
#include "stats/wicksell.h"

namespace taihu {
namespace {

constexpr std::uint32_t kGoodnessStream = 0x676f6f64;
constexpr std::size_t kFewestProfiles = 8;
// Of logarithms of shares: a fitted constant law gives its largest profile none.
constexpr double kLeastLog = -700;

using Statistic = double GoodnessStatistics::*;
constexpr Statistic kStatistics[] = {
    &GoodnessStatistics::anderson_darling, &GoodnessStatistics::kolmogorov_smirnov,
    &GoodnessStatistics::cramer_von_mises, &GoodnessStatistics::chi_squared};
constexpr GoodnessTest Goodness::*kTests[] = {&Goodness::anderson_darling,
                                              &Goodness::kolmogorov_smirnov,
                                              &Goodness::cramer_von_mises, &Goodness::chi_squared};

GoodnessTest judge(double statistic, std::vector<double> drawn) {
    std::sort(drawn.begin(), drawn.end());
    const auto below = std::lower_bound(drawn.begin(), drawn.end(), statistic) - drawn.begin();
    const auto n = static_cast<double>(drawn.size());
    const auto rank = static_cast<std::size_t>(std::ceil(0.95 * n)) - 1;
    return {statistic, drawn[rank], (n - static_cast<double>(below) + 1) / (n + 1)};
}

} // namespace

GoodnessStatistics goodness_statistics(std::span<const double> diameters, double limit,
                                       const Law& law) {
    std::vector<double> sorted(diameters.begin(), diameters.end());
    for (std::size_t i = 0; i < sorted.size(); ++i)
        if (!(sorted[i] > limit && std::isfinite(sorted[i])))
            throw Error(Fault::bad_argument, "goodness: diameters[" + std::to_string(i) + "] is " +
                                                 shortest(sorted[i]) +
                                                 "; must be above the limit, " + shortest(limit));
    if (sorted.empty())
        throw Error(Fault::bad_argument, "goodness: no diameters; give at least one");
    std::sort(sorted.begin(), sorted.end());
    const SectionLaw section(law);
    const std::size_t n = sorted.size();
    const auto count = static_cast<double>(n);
    const std::size_t n_cells = std::clamp<std::size_t>(n / 5, 2, 10);
    const double whole = section.log_survival(limit);
    std::vector<double> share(n), log_past(n), cells(n_cells, 0);
    for (std::size_t i = 0; i < n; ++i) {
        log_past[i] = std::clamp(section.log_survival(sorted[i]) - whole, kLeastLog, 0.0);
        share[i] = -std::expm1(log_past[i]);
        const auto cell = static_cast<std::size_t>(share[i] * static_cast<double>(n_cells));
        cells[std::min(cell, n_cells - 1)] += 1;
    }
    GoodnessStatistics s{-count, 0, 1 / (12 * count), 0};
    for (std::size_t i = 0; i < n; ++i) {
        const double before = static_cast<double>(i) / count, after = before + 1 / count;
        const double middle = before + 0.5 / count;
        const double log_share = std::max(kLeastLog, std::log(share[i]));
        s.kolmogorov_smirnov =
            std::max({s.kolmogorov_smirnov, after - share[i], share[i] - before});
        s.cramer_von_mises += (share[i] - middle) * (share[i] - middle);
        s.anderson_darling -= 2 * middle * (log_share + log_past[n - 1 - i]);
    }
    const double expected = count / static_cast<double>(n_cells);
    for (const double observed : cells)
        s.chi_squared += (observed - expected) * (observed - expected) / expected;
    return s;
}

Goodness goodness(std::span<const double> diameters, double limit, const Law& law,
                  const Refit& refit, std::uint64_t n_resamples, std::uint64_t seed,
                  Progress* progress) {
    if (n_resamples < 19 || n_resamples > 1'000'000)
        throw Error(Fault::bad_argument, "goodness: n_resamples is " + std::to_string(n_resamples) +
                                             "; must be in 19..1e6");
    std::vector<double> sample;
    std::copy_if(diameters.begin(), diameters.end(), std::back_inserter(sample),
                 [&](double d) { return d != limit; });
    if (sample.size() < kFewestProfiles)
        throw Error(Fault::bad_input, "goodness: " + std::to_string(sample.size()) +
                                          " profiles above the detection limit; at least 8 are "
                                          "needed, mark more holes");
    const GoodnessStatistics found = goodness_statistics(sample, limit, law);
    Goodness result;
    result.n_profiles = sample.size();
    result.n_at_limit = diameters.size() - sample.size();

    report_stage(progress, "testing the fit");
    const SectionDraws draws(law, limit);
    const Rng rng{seed, kGoodnessStream};
    std::vector<double> drawn[std::size(kStatistics)];
    for (std::uint64_t b = 0; b < n_resamples; ++b) {
        check_cancelled(progress);
        if (b % (n_resamples / 19) == 0)
            report_fraction(progress, static_cast<double>(b) / static_cast<double>(n_resamples));
        for (std::size_t i = 0; i < sample.size(); ++i)
            sample[i] = draws.diameter(rng, b << 32 | i);
        try {
            const GoodnessStatistics s =
                goodness_statistics(sample, limit, refit ? refit(sample) : law);
            for (std::size_t k = 0; k < std::size(kStatistics); ++k)
                drawn[k].push_back(s.*kStatistics[k]);
        } catch (const Error& e) {
            if (e.fault() == Fault::cancelled)
                throw;
            if (20 * ++result.n_failed > n_resamples)
                throw Error(Fault::numeric,
                            "goodness: more than a twentieth of the drawn samples cannot be "
                            "fitted, the last because of '" +
                                std::string(e.what()) + "'; use a law with fewer parameters");
        }
    }
    result.n_resamples = n_resamples - result.n_failed;
    for (std::size_t k = 0; k < std::size(kStatistics); ++k)
        result.*kTests[k] = judge(found.*kStatistics[k], std::move(drawn[k]));
    return result;
}

} // namespace taihu
