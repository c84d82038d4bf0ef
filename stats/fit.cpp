#include "stats/fit.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "stats/chi_squared.h"
#include "stats/core/error.h"
#include "stats/detection.h"
#include "stats/likelihood_detail.h"
#include "stats/number_detail.h"
#include "stats/peak_detail.h"

namespace taihu {
namespace {

constexpr std::uint64_t kFewestProfiles = 8, kFewProfiles = 20;
constexpr double kLeastLength = 1e-9, kMostLength = 1e9;

void check_settings(const Sample& sample, Family family, const FitSettings& settings) {
    if (!(settings.level >= 0.5 && settings.level <= 0.9999))
        throw Error(Fault::bad_argument,
                    "fit: level is " + shortest(settings.level) + "; must be in 0.5..0.9999");
    if (family == Family::empirical)
        throw Error(Fault::bad_argument, "fit: an empirical law has no parameters; unfold it");
    if (!settings.resolution)
        return;
    if (!(*settings.resolution > 0 && std::isfinite(*settings.resolution)))
        throw Error(Fault::bad_argument, "fit: resolution is " + shortest(*settings.resolution) +
                                             "; must be finite and > 0");
    if (!sample.bins.empty())
        throw Error(Fault::bad_argument, "fit: a resolution of " + shortest(*settings.resolution) +
                                             " for a sample in bins; leave it out");
}

void check_profiles(const Sample& sample) {
    const std::uint64_t count = n_profiles(sample);
    if (count < kFewestProfiles)
        throw Error(Fault::bad_input, "fit: " + std::to_string(count) + " profiles; at least " +
                                          std::to_string(kFewestProfiles) +
                                          " are needed, mark more holes");
    for (const double d : sample.diameters)
        if (!(d >= kLeastLength && d <= kMostLength))
            throw Error(Fault::bad_input, "fit: a diameter is " + shortest(d) +
                                              "; must be in 1e-9..1e9, choose another unit");
    for (const Bin& bin : sample.bins)
        if (bin.count > 0 && !(bin.hi >= kLeastLength && bin.hi <= kMostLength))
            throw Error(Fault::bad_input, "fit: a bin ends at " + shortest(bin.hi) +
                                              "; must be in 1e-9..1e9, choose another unit");
}

// Nothing but the limit itself, or the bin that begins there: any law that is steep enough will do.
void check_spread(const Sample& sample, Family family, double limit) {
    const auto above = [&](double d) { return d > limit; };
    const auto filled = [&](const Bin& bin) { return bin.count > 0 && bin.lo > limit; };
    if (family != Family::constant && std::ranges::none_of(sample.diameters, above) &&
        std::ranges::none_of(sample.bins, filled))
        throw Error(Fault::bad_input,
                    "fit: the likelihood has no maximum, all profiles lie at the "
                    "detection limit; mark holes of several sizes or lower the limit");
}

std::optional<double> resolution_for(const Sample& sample, Family family,
                                     const FitSettings& settings) {
    const bool needed = family == Family::uniform || family == Family::constant;
    if (settings.resolution || !needed || sample.diameters.empty())
        return settings.resolution;
    return 0.01 * *std::max_element(sample.diameters.begin(), sample.diameters.end());
}

std::string percent(double share) {
    return std::to_string(static_cast<int>(std::lround(100 * share))) + " %";
}

NumberDensity number_density(Likelihood& likelihood, const Peak& peak, double area, double level) {
    const NumberPosterior posterior(likelihood, peak, area);
    NumberDensity n_v;
    n_v.estimate = likelihood.n() /
                   (area * std::exp(peak.log_mean) * likelihood.seen(peak.log_mean, peak.shape));
    n_v.lo = std::min(n_v.estimate, posterior.quantile((1 - level) / 2));
    n_v.hi = std::max(n_v.estimate, posterior.quantile((1 + level) / 2));
    return n_v;
}

void add_notes(Fit& fit, const Peak& peak, bool open) {
    if (fit.n_profiles < kFewProfiles)
        fit.notes.push_back("Only " + std::to_string(fit.n_profiles) + " profiles: below " +
                            std::to_string(kFewProfiles) + " no law can be told from another.");
    const std::string name(family_name(fit.law.family()));
    if (peak.at_edge)
        fit.notes.push_back("The likeliest " + name +
                            " law is at the edge of what is tried: another family fits better.");
    else if (open)
        fit.notes.push_back("An interval of the " + name +
                            " law ends where the search ends: the profiles do not bound it.");
    if (fit.law.cdf(fit.detection_limit) > 0.5)
        fit.notes.push_back(percent(fit.law.cdf(fit.detection_limit)) +
                            " of the holes of this law are smaller than the detection limit and "
                            "were not seen by anybody.");
}

} // namespace

Fit fit_law(const Sample& sample, Family family, const FitSettings& settings) {
    check_settings(sample, family, settings);
    const Detection detection(sample);
    check_profiles(sample);
    check_spread(sample, family, detection.limit());
    Likelihood likelihood(sample, detection, family, resolution_for(sample, family, settings));
    const Peak peak = find_peak(likelihood);
    Fit fit{law_at(family, peak.log_mean, peak.shape),
            {},
            settings.level,
            peak.log_likelihood,
            0,
            {},
            detection.limit(),
            n_profiles(sample),
            {}};
    const double n = likelihood.n();
    const auto k = static_cast<double>(parameter_names(family).size());
    fit.aicc = 2 * k - 2 * fit.log_likelihood + 2 * k * (k + 1) / (n - k - 1);
    const double depth = 0.5 * chi_squared_critical(1, 1 - settings.level);
    Region region = likelihood_region(likelihood, peak, fit.log_likelihood - depth);
    fit.intervals = std::move(region.intervals);
    for (std::size_t i = 0; i < fit.intervals.size();
         ++i) { // the search ends before the last digit
        fit.intervals[i].lo = std::min(fit.intervals[i].lo, fit.law.parameters()[i]);
        fit.intervals[i].hi = std::max(fit.intervals[i].hi, fit.law.parameters()[i]);
    }
    if (detection.area()) {
        fit.n_v = number_density(likelihood, peak, *detection.area(), settings.level);
        fit.n_v->extrapolated_share = fit.law.cdf(detection.limit());
    }
    add_notes(fit, peak, region.open);
    return fit;
}

Law likeliest_law(const Sample& sample, Family family, const FitSettings& settings) {
    check_settings(sample, family, settings);
    const Detection detection(sample);
    check_profiles(sample);
    check_spread(sample, family, detection.limit());
    Likelihood likelihood(sample, detection, family, resolution_for(sample, family, settings));
    const Peak peak = find_peak(likelihood);
    return law_at(family, peak.log_mean, peak.shape);
}

LawRanking fit_laws(const Sample& sample, std::span<const Family> families,
                    const FitSettings& settings) {
    if (families.empty())
        throw Error(Fault::bad_argument, "fit: no families; name one");
    for (std::size_t i = 0; i < families.size(); ++i)
        if (std::find(families.begin(), families.begin() + static_cast<std::ptrdiff_t>(i),
                      families[i]) != families.begin() + static_cast<std::ptrdiff_t>(i))
            throw Error(Fault::bad_argument, "fit: the family " +
                                                 std::string(family_name(families[i])) +
                                                 " is named twice; name it once");
    LawRanking ranking;
    static constexpr std::array kSafe = {Family::exponential};
    if (n_profiles(sample) < kFewProfiles && !std::ranges::equal(families, kSafe)) {
        families = kSafe;
        ranking.notes.emplace_back("Only the exponential law was fitted: fewer than " +
                                   std::to_string(kFewProfiles) +
                                   " profiles cannot tell one law from another.");
    }
    std::optional<Error> first;
    for (const Family family : families) {
        try {
            ranking.fits.push_back(fit_law(sample, family, settings));
        } catch (const Error& e) {
            if (e.fault() == Fault::bad_argument)
                throw;
            if (!first)
                first = e;
            ranking.notes.push_back(std::string(family_name(family)) + " left out: " + e.what());
        }
    }
    if (ranking.fits.empty())
        throw *first;
    std::stable_sort(ranking.fits.begin(), ranking.fits.end(),
                     [](const Fit& a, const Fit& b) { return a.aicc < b.aicc; });
    for (const Fit& fit : ranking.fits)
        ranking.weights.push_back(std::exp(0.5 * (ranking.fits.front().aicc - fit.aicc)));
    const double sum = std::accumulate(ranking.weights.begin(), ranking.weights.end(), 0.0);
    for (double& weight : ranking.weights)
        weight /= sum;
    if (!ranking.fits.front().n_v)
        return ranking;
    LawRanking::Spread spread;
    for (std::size_t i = 0; i < ranking.fits.size(); ++i)
        spread.mean += ranking.weights[i] * ranking.fits[i].n_v->estimate;
    for (std::size_t i = 0; i < ranking.fits.size(); ++i)
        spread.sd += ranking.weights[i] * std::pow(ranking.fits[i].n_v->estimate - spread.mean, 2);
    spread.sd = std::sqrt(spread.sd);
    ranking.n_v = spread;
    return ranking;
}

} // namespace taihu
