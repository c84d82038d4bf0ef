#include "stats/goodness.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "stats/core/error.h"
#include "stats/detection.h"
#include "stats/number_detail.h"
#include "stats/resample_detail.h"
#include "stats/wicksell.h"

namespace taihu {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kFewestProfiles = 8;
constexpr double kFewestInCell = 5;
// Of logarithms of shares: a fitted constant law gives its largest profile none.
constexpr double kLeastLog = -700;

using Statistic = double GoodnessStatistics::*;
constexpr Statistic kStatistics[] = {
    &GoodnessStatistics::anderson_darling, &GoodnessStatistics::kolmogorov_smirnov,
    &GoodnessStatistics::cramer_von_mises, &GoodnessStatistics::chi_squared};
constexpr GoodnessTest Goodness::*kTests[] = {&Goodness::anderson_darling,
                                              &Goodness::kolmogorov_smirnov,
                                              &Goodness::cramer_von_mises, &Goodness::chi_squared};

// log of the share of marked profiles that are greater than each of `sorted`, which rise.
std::vector<double> log_shares_past(const std::vector<double>& sorted, const Detection& detection,
                                    const SectionLaw& section) {
    std::vector<double> past(sorted.size());
    if (detection.is_flat(detection.limit(), kInfinity)) {
        const double whole = section.log_survival(detection.limit());
        for (std::size_t i = 0; i < sorted.size(); ++i)
            past[i] = section.log_survival(sorted[i]) - whole;
    } else { // from the greatest down, each a short step from the one before
        const auto survival = [&](double d) { return section.survival(d); };
        double sum = 0, above = kInfinity;
        for (std::size_t i = sorted.size(); i-- > 0; above = sorted[i])
            past[i] = sum += detection.seen(survival, sorted[i], above);
        const double whole = sum + detection.seen(survival, detection.limit(), above);
        for (double& p : past)
            p = std::log(p / whole);
    }
    for (double& p : past)
        p = std::clamp(p, kLeastLog, 0.0);
    return past;
}

GoodnessStatistics of_diameters(const Sample& sample, const Detection& detection,
                                const SectionLaw& section) {
    std::vector<double> sorted = sample.diameters;
    std::sort(sorted.begin(), sorted.end());
    if (sorted.front() == detection.limit())
        throw Error(Fault::bad_argument, "goodness: a diameter is the detection limit, " +
                                             shortest(sorted.front()) +
                                             "; leave it out, or lower the limit");
    const std::size_t n = sorted.size();
    const auto count = static_cast<double>(n);
    const std::vector<double> log_past = log_shares_past(sorted, detection, section);
    std::vector<double> cells(std::clamp<std::size_t>(n / 5, 2, 10), 0);
    const auto n_cells = static_cast<double>(cells.size());
    GoodnessStatistics s{-count, 0, 1 / (12 * count), 0};
    for (std::size_t i = 0; i < n; ++i) {
        const double share = -std::expm1(log_past[i]);
        const double before = static_cast<double>(i) / count, after = before + 1 / count;
        const double middle = before + 0.5 / count;
        const double log_share = std::max(kLeastLog, std::log(share));
        s.kolmogorov_smirnov = std::max({s.kolmogorov_smirnov, after - share, share - before});
        s.cramer_von_mises += (share - middle) * (share - middle);
        s.anderson_darling -= 2 * middle * (log_share + log_past[n - 1 - i]);
        ++cells[std::min(static_cast<std::size_t>(share * n_cells), cells.size() - 1)];
    }
    const double expected = count / n_cells;
    for (const double observed : cells)
        s.chi_squared += (observed - expected) * (observed - expected) / expected;
    return s;
}

GoodnessStatistics of_bins(const Sample& sample, const Detection& detection,
                           const SectionLaw& section) {
    const auto survival = [&](double d) { return section.survival(d); };
    const double whole = detection.seen(survival, detection.limit(), kInfinity);
    const auto count = static_cast<double>(n_profiles(sample));
    GoodnessStatistics s;
    double found = 0, asked = 0;               // below the end of a bin
    double cell_found = 0, cell_asked = 0;     // in the cell that is being filled
    double last_found = 0, last_asked = 0;     // in the one before
    const auto add = [&](double a, double b) { // a cell of the chi-squared statistic
        if (b > 0)
            s.chi_squared += (a - b) * (a - b) / b;
    };
    for (std::size_t i = 0; i <= sample.bins.size(); ++i) {
        const bool past_all = i == sample.bins.size();
        const double lo = past_all ? sample.bins.back().hi : sample.bins[i].lo;
        const double hi = past_all ? kInfinity : sample.bins[i].hi;
        const double observed = past_all ? 0 : static_cast<double>(sample.bins[i].count);
        const double share = detection.seen(survival, lo, hi) / whole;
        found += observed;
        asked += count * share;
        const double off = found - asked, below = asked / count;
        if (!past_all && below > 0 && below < 1) {
            s.kolmogorov_smirnov = std::max(s.kolmogorov_smirnov, std::abs(off) / count);
            s.cramer_von_mises += off * off * share / count;
            s.anderson_darling += off * off * share / (below * (1 - below)) / count;
        }
        cell_found += observed;
        cell_asked += count * share;
        if (cell_asked >= kFewestInCell) {
            add(last_found, last_asked);
            last_found = cell_found;
            last_asked = cell_asked;
            cell_found = cell_asked = 0;
        }
    }
    add(last_found + cell_found, last_asked + cell_asked); // what is left joins the last cell
    return s;
}

GoodnessTest judge(double statistic, std::vector<double> drawn) {
    std::sort(drawn.begin(), drawn.end());
    const auto below = std::lower_bound(drawn.begin(), drawn.end(), statistic) - drawn.begin();
    const auto n = static_cast<double>(drawn.size());
    const auto rank = static_cast<std::size_t>(std::ceil(0.95 * n)) - 1;
    return {statistic, drawn[rank], (n - static_cast<double>(below) + 1) / (n + 1)};
}

// The sample without the diameters that are its limit.
Sample above_limit(const Sample& sample) {
    Sample kept = sample;
    kept.detection_limit = detection_limit(sample, {});
    std::erase(kept.diameters, detection_limit(sample));
    return kept;
}

} // namespace

GoodnessStatistics goodness_statistics(const Sample& sample, const Law& law) {
    const Detection detection(sample);
    const SectionLaw section(law);
    return sample.bins.empty() ? of_diameters(sample, detection, section)
                               : of_bins(sample, detection, section);
}

Goodness goodness(const Sample& sample, const Law& law, const Refit& refit,
                  const GoodnessSettings& settings, Progress* progress) {
    const std::uint64_t n = settings.n_resamples;
    if (n < 19 || n > 1'000'000)
        throw Error(Fault::bad_argument,
                    "goodness: n_resamples is " + std::to_string(n) + "; must be in 19..1e6");
    check_sample(sample);
    const Sample kept = above_limit(sample);
    Goodness result;
    result.n_profiles = n_profiles(kept);
    result.n_at_limit = n_profiles(sample) - result.n_profiles;
    if (result.n_profiles < kFewestProfiles)
        throw Error(Fault::bad_input, "goodness: " + std::to_string(result.n_profiles) +
                                          " profiles above the detection limit; at least 8 are "
                                          "needed, mark more holes");
    const GoodnessStatistics found = goodness_statistics(kept, law);

    report_stage(progress, "testing the fit");
    const Resampler resampler(kept, law);
    std::vector<double> drawn[std::size(kStatistics)];
    for (std::uint64_t b = 0; b < n; ++b) {
        check_cancelled(progress);
        report_fraction(progress, static_cast<double>(b) / static_cast<double>(n));
        try {
            const Sample again = resampler.draw(settings.seed, b);
            const GoodnessStatistics s = goodness_statistics(again, refit ? refit(again) : law);
            for (std::size_t k = 0; k < std::size(kStatistics); ++k)
                drawn[k].push_back(s.*kStatistics[k]);
        } catch (const Error& e) {
            if (e.fault() == Fault::cancelled)
                throw;
            if (20 * ++result.n_failed > n)
                throw Error(Fault::numeric,
                            "goodness: more than a twentieth of the drawn samples cannot be "
                            "fitted, the last because of '" +
                                std::string(e.what()) + "'; use a law with fewer parameters");
        }
    }
    result.n_resamples = n - result.n_failed;
    for (std::size_t k = 0; k < std::size(kStatistics); ++k)
        result.*kTests[k] = judge(found.*kStatistics[k], std::move(drawn[k]));
    return result;
}

} // namespace taihu
