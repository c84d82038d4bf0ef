#include "stats/fit.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include <boost/math/special_functions/gamma.hpp>
#include <boost/math/tools/minima.hpp>

#include "stats/chi_squared.h"
#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "stats/wicksell.h"

namespace taihu {
namespace {

constexpr std::uint64_t kFewestProfiles = 8, kFewProfiles = 20;

// Without promotion to long double, whose width differs from machine to machine.
using Policy = boost::math::policies::policy<boost::math::policies::promote_double<false>>;

using LogLikelihood = std::function<double(double log_rate)>;

double log_likelihood(const Sample& sample, double limit, const SectionLaw& section) {
    double sum = 0;
    for (const double d : sample.diameters)
        sum += section.log_pdf(d);
    for (const Bin& bin : sample.bins) {
        if (bin.count == 0)
            continue;
        const double above = section.log_survival(bin.lo), past = section.log_survival(bin.hi);
        sum += static_cast<double>(bin.count) * (above + std::log(-std::expm1(past - above)));
    }
    return sum - static_cast<double>(n_profiles(sample)) * section.log_survival(limit);
}

double mean_profile(const Sample& sample) {
    double sum = 0;
    for (const double d : sample.diameters)
        sum += d;
    for (const Bin& bin : sample.bins)
        sum += static_cast<double>(bin.count) * 0.5 * (bin.lo + bin.hi);
    return sum / static_cast<double>(n_profiles(sample));
}

// How far the logarithm of the rate may run from where it started: a factor 1.6e5, past which the
// sizes differ by less than 1e-5.
constexpr double kFarthest = 12;

[[noreturn]] void refuse_no_spread() {
    throw Error(Fault::bad_input,
                "fit: the likelihood has no maximum, all profiles lie at the "
                "detection limit; mark holes of several sizes or lower the limit");
}

// The likelihood has one maximum when the profiles spread: towards 0 and towards infinity it falls
// without end. So a walk uphill brackets it.
double maximum(const LogLikelihood& log_l, double start) {
    constexpr double kStride = 0.5;
    double at = start, height = log_l(at);
    const double direction = log_l(start + kStride) > height ? kStride : -kStride;
    while (true) {
        const double next = log_l(at + direction);
        if (next <= height)
            break;
        at += direction;
        height = next;
        if (std::abs(at - start) > kFarthest)
            refuse_no_spread();
    }
    const auto negative = [&](double x) { return -log_l(x); };
    // 26 bits: a minimum is no sharper than the square root of the machine precision.
    return boost::math::tools::brent_find_minima(negative, at - kStride, at + kStride, 26).first;
}

// Where the log-likelihood has fallen to `floor`, on the side of `direction`.
double crossing(const LogLikelihood& log_l, double peak, double floor, double direction) {
    double inside = peak, step = 0.1 * direction;
    while (log_l(inside + step) > floor) {
        inside += step;
        step *= 2;
        if (std::abs(inside - peak) > kFarthest) // flat: one bin holds everything
            refuse_no_spread();
    }
    double outside = inside + step;
    for (int i = 0; i < 60 && std::abs(outside - inside) > 1e-12; ++i) {
        const double middle = 0.5 * (inside + outside);
        (log_l(middle) > floor ? inside : outside) = middle;
    }
    return 0.5 * (inside + outside);
}

// The posterior of N_V: a mixture of Gamma(n + 1/2, exposure) over the likelihood of log rate.
class NumberPosterior {
public:
    NumberPosterior(const LogLikelihood& log_l, double peak, double n, double area, double limit)
        : shape_(n + 0.5) {
        constexpr int kPoints = 60; // of a bell: the rule converges faster than any power
        // exp(-18) of the peak: what lies farther weighs less than 1e-8.
        const double height = log_l(peak);
        const double lo = crossing(log_l, peak, height - 18, -1);
        const double hi = crossing(log_l, peak, height - 18, 1);
        double sum = 0;
        for (int i = 0; i <= kPoints; ++i) {
            const double x = lo + (hi - lo) * i / kPoints;
            const SectionLaw section(Law::exponential(std::exp(x)));
            const double weight = std::exp(log_l(x) - height);
            parts_.push_back({weight, area * section.law().mean() * section.survival(limit)});
            sum += weight;
        }
        for (Part& part : parts_)
            part.weight /= sum;
    }

    double quantile(double share) const {
        double lo = 0, hi = shape_ / parts_.front().exposure;
        while (cdf(hi) < share)
            hi *= 2;
        for (int i = 0; i < 100 && hi - lo > 1e-10 * hi; ++i) {
            const double middle = 0.5 * (lo + hi);
            (cdf(middle) < share ? lo : hi) = middle;
        }
        return 0.5 * (lo + hi);
    }

private:
    struct Part {
        double weight, exposure;
    };

    double cdf(double n_v) const {
        double sum = 0;
        for (const Part& part : parts_)
            sum += part.weight * boost::math::gamma_p(shape_, n_v * part.exposure, Policy());
        return sum;
    }

    double shape_;
    std::vector<Part> parts_;
};

void check_level(double level) {
    if (!(level >= 0.5 && level <= 0.9999))
        throw Error(Fault::bad_argument,
                    "fit: level is " + shortest(level) + "; must be in 0.5..0.9999");
}

std::string percent(double share) {
    return std::to_string(static_cast<int>(std::lround(100 * share))) + " %";
}

} // namespace

Fit fit_exponential(const Sample& sample, const FitSettings& settings) {
    check_level(settings.level);
    const double limit = detection_limit(sample);
    const std::uint64_t count = n_profiles(sample);
    if (count < kFewestProfiles)
        throw Error(Fault::bad_input, "fit: " + std::to_string(count) + " profiles; at least " +
                                          std::to_string(kFewestProfiles) +
                                          " are needed, mark more holes");
    const LogLikelihood log_l = [&](double log_rate) {
        return log_likelihood(sample, limit, SectionLaw(Law::exponential(std::exp(log_rate))));
    };
    const double start =
        std::log(std::numbers::pi / (2 * mean_profile(sample))); // E[d] = pi / 2 rate
    const double peak = maximum(log_l, start);

    Fit fit{Law::exponential(std::exp(peak)), {}, settings.level, 0, 0, {}, limit, count, {}};
    const auto n = static_cast<double>(count);
    fit.log_likelihood = log_l(peak);
    fit.aicc = 2 - 2 * fit.log_likelihood + 4 / (n - 2); // one parameter
    const double floor = fit.log_likelihood - 0.5 * chi_squared_critical(1, 1 - settings.level);
    fit.intervals = {
        {std::exp(crossing(log_l, peak, floor, -1)), std::exp(crossing(log_l, peak, floor, 1))}};
    if (sample.area) {
        const SectionLaw section(fit.law);
        const NumberPosterior posterior(log_l, peak, n, *sample.area, limit);
        fit.n_v = {.estimate = n / (*sample.area * fit.law.mean() * section.survival(limit)),
                   .lo = posterior.quantile((1 - settings.level) / 2),
                   .hi = posterior.quantile((1 + settings.level) / 2),
                   .extrapolated_share = fit.law.cdf(limit)};
    }
    if (count < kFewProfiles)
        fit.notes.push_back("Only " + std::to_string(count) + " profiles: below " +
                            std::to_string(kFewProfiles) + " no law can be told from another.");
    if (fit.law.cdf(limit) > 0.5)
        fit.notes.push_back(percent(fit.law.cdf(limit)) +
                            " of the holes of this law are smaller than the detection limit and "
                            "were not seen by anybody.");
    return fit;
}

} // namespace taihu
