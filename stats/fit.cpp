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
constexpr double kLeastArea = 1e-18, kMostArea = 1e24;
constexpr double kHiddenShare = 0.14; // see LawRanking

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
    if (const double greatest =
            sample.diameters.empty()
                ? *settings.resolution
                : *std::max_element(sample.diameters.begin(), sample.diameters.end());
        *settings.resolution > greatest || *settings.resolution < 1e-9 * greatest)
        throw Error(Fault::bad_argument, "fit: resolution is " + shortest(*settings.resolution) +
                                             "; must be at most the greatest profile, " +
                                             shortest(greatest) + ", and 1e-9 of it or more");
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
    if (const auto area = searched_area(sample);
        area && !(*area >= kLeastArea && *area <= kMostArea))
        throw Error(Fault::bad_input, "fit: the area searched is " + shortest(*area) +
                                          "; must be in 1e-18..1e24, choose another unit");
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

Interval with(Interval interval, double value) {
    return {std::min(interval.lo, value), std::max(interval.hi, value)};
}

Interval interval_of(const NumberPosterior& posterior, double level) {
    return {posterior.quantile((1 - level) / 2), posterior.quantile((1 + level) / 2)};
}

std::string percent(double share) {
    return std::to_string(static_cast<int>(std::lround(100 * share))) + " %";
}

Detection detection_for(const Sample& sample, Family family, const FitSettings& settings) {
    check_settings(sample, family, settings);
    Detection detection(sample);
    check_profiles(sample);
    check_spread(sample, family, detection.limit());
    return detection;
}

// A sample, seen through its limits and edges, and the likeliest law of one family.
struct Search {
    Search(const Sample& sample, Family family, const FitSettings& settings)
        : detection(detection_for(sample, family, settings)),
          likelihood(sample, detection, family, resolution_for(sample, family, settings)),
          peak(find_peak(likelihood)) {}
    Search(const Search&) = delete; // the likelihood refers to the detection

    Law law() const { return law_at(likelihood.family(), peak.log_mean, peak.shape); }

    Detection detection;
    Likelihood likelihood;
    Peak peak;
};

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

struct FitParts {
    Fit fit;
    std::vector<LawPart> parts; // what else the law may be
};

FitParts fit_parts(const Sample& sample, Family family, const FitSettings& settings) {
    Search search(sample, family, settings);
    const Peak& peak = search.peak;
    const double n = search.likelihood.n(),
                 depth = 0.5 * chi_squared_critical(1, 1 - settings.level);
    Region region = likelihood_region(search.likelihood, peak, peak.log_likelihood - depth);
    std::vector<LawPart> parts = law_parts(search.likelihood, peak);
    Fit fit{search.law(),
            std::move(region.intervals),
            with(region.mean_diameter, std::exp(peak.log_mean)),
            settings.level,
            peak.log_likelihood,
            0,
            {},
            search.detection.limit(),
            n_profiles(sample),
            {}};
    const auto k = static_cast<double>(parameter_names(family).size());
    fit.aicc = 2 * k - 2 * fit.log_likelihood + 2 * k * (k + 1) / (n - k - 1);
    for (std::size_t i = 0; i < fit.intervals.size(); ++i) // the search ends before the last digit
        fit.intervals[i] = with(fit.intervals[i], fit.law.parameters()[i]);
    if (const auto area = search.detection.area()) {
        const NumberPosterior posterior(parts, n, *area);
        const double seen = search.likelihood.seen(peak.log_mean, peak.shape);
        const double estimate = n / (*area * std::exp(peak.log_mean) * seen);
        const Interval interval = with(interval_of(posterior, settings.level), estimate);
        fit.n_v = {estimate, interval.lo, interval.hi, fit.law.cdf(fit.detection_limit)};
    }
    add_notes(fit, peak, region.open);
    return {std::move(fit), std::move(parts)};
}

std::vector<double> normalised(std::vector<double> weights) {
    const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
    for (double& weight : weights)
        weight /= sum;
    return weights;
}

std::vector<double> akaike_weights(std::span<const FitParts> fits) {
    std::vector<double> weights;
    for (const FitParts& f : fits)
        weights.push_back(std::exp(0.5 * (fits.front().fit.aicc - f.fit.aicc)));
    return normalised(std::move(weights));
}

std::vector<double> schwarz_weights(std::span<const FitParts> fits) {
    const auto criterion = [](const Fit& fit) { // half of it, as a likelihood
        return fit.log_likelihood - 0.5 * static_cast<double>(fit.intervals.size()) *
                                        std::log(static_cast<double>(fit.n_profiles));
    };
    double best = criterion(fits.front().fit);
    for (const FitParts& f : fits)
        best = std::max(best, criterion(f.fit));
    std::vector<double> weights;
    for (const FitParts& f : fits)
        weights.push_back(std::exp(criterion(f.fit) - best));
    return normalised(std::move(weights));
}

// The parts of all families, by the weights of these and a prior of the share that is hidden.
template <class Prior>
std::vector<LawPart> join(std::span<const FitParts> fits, std::span<const double> weights,
                          Prior prior) {
    std::vector<LawPart> all;
    for (std::size_t i = 0; i < fits.size(); ++i)
        for (LawPart part : fits[i].parts) {
            part.weight *= weights[i] * prior(1 - part.above);
            all.push_back(part);
        }
    return all;
}

// What every law of every family may be, for intervals.
std::vector<LawPart> all_parts(std::span<const FitParts> fits, std::span<const double> weights) {
    return join(fits, weights, [](double hidden) { return 1 - hidden; });
}

LawRanking::AllLaws number_by_all(std::span<const FitParts> fits, std::span<const double> weights,
                                  double area) {
    const auto prior = [](double hidden) {
        return std::exp(-0.5 * std::pow(hidden / kHiddenShare, 2));
    };
    const std::vector<double> schwarz = schwarz_weights(fits);
    const Fit& first = fits.front().fit;
    const auto n = static_cast<double>(first.n_profiles);
    double sum = 0, exposure = 0, squares = 0;
    LawRanking::AllLaws n_v;
    for (const LawPart& part : join(fits, schwarz, prior)) {
        sum += part.weight;
        exposure += part.weight * part.exposure;
        squares += part.weight * part.exposure * part.exposure;
        n_v.extrapolated_share += part.weight * (1 - part.above);
    }
    n_v.extrapolated_share /= sum;
    n_v.mean = n / area * exposure / squares;
    for (std::size_t i = 0; i < fits.size(); ++i)
        for (const LawPart& part : fits[i].parts)
            n_v.sd += schwarz[i] * part.weight * prior(1 - part.above) / sum *
                      std::pow(fits[i].fit.n_v->estimate - n_v.mean, 2);
    n_v.sd = std::sqrt(n_v.sd);
    const NumberPosterior posterior(all_parts(fits, weights), n, area);
    const Interval interval = with(interval_of(posterior, first.level), n_v.mean);
    n_v.lo = interval.lo;
    n_v.hi = interval.hi;
    return n_v;
}

} // namespace

Fit fit_law(const Sample& sample, Family family, const FitSettings& settings) {
    return fit_parts(sample, family, settings).fit;
}

Law likeliest_law(const Sample& sample, Family family, const FitSettings& settings) {
    return Search(sample, family, settings).law();
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
    std::vector<FitParts> fits;
    std::optional<Error> first;
    for (const Family family : families) {
        try {
            fits.push_back(fit_parts(sample, family, settings));
        } catch (const Error& e) {
            if (e.fault() == Fault::bad_argument)
                throw;
            if (!first)
                first = e;
            ranking.notes.push_back(std::string(family_name(family)) + " left out: " + e.what());
        }
    }
    if (fits.empty())
        throw *first;
    std::stable_sort(fits.begin(), fits.end(),
                     [](const FitParts& a, const FitParts& b) { return a.fit.aicc < b.fit.aicc; });
    for (const FitParts& f : fits)
        ranking.fits.push_back(f.fit);
    ranking.weights = akaike_weights(fits);
    const std::vector<LawPart> all = all_parts(fits, ranking.weights);
    ranking.mean_diameter = {mean_quantile(all, (1 - settings.level) / 2),
                             mean_quantile(all, (1 + settings.level) / 2)};
    if (const auto area = searched_area(sample))
        ranking.n_v = number_by_all(fits, ranking.weights, *area);
    return ranking;
}

} // namespace taihu
