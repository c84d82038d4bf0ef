#include "stats/law.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include <boost/math/special_functions/erf.hpp>
#include <boost/math/special_functions/gamma.hpp>

#include "stats/core/error.h"
#include "stats/core/portable_math.h"
#include "stats/core/text.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

// Without promotion to long double, whose width differs from machine to machine; the gamma function
// of a large shape may overflow on the way to a CDF of 0.
using Policy = boost::math::policies::policy<
    boost::math::policies::promote_double<false>,
    boost::math::policies::overflow_error<boost::math::policies::ignore_error>>;

constexpr std::array<std::string_view, 8> kFamilies = {
    "exponential",      "gamma",   "weibull",  "lognormal",
    "truncated_normal", "uniform", "constant", "empirical"};

constexpr double kMinLength = 1e-12, kMaxLength = 1e12;

struct Range {
    double lo, hi;
};

// Legal range of each parameter alone, in the order of parameter_names.
std::array<Range, 2> ranges(Family family) {
    constexpr Range kLength = {kMinLength, kMaxLength};
    switch (family) {
    case Family::exponential:
    case Family::constant:
        return {kLength, {}};
    case Family::gamma:
        return {Range{0.01, 1e4}, kLength};
    case Family::weibull:
        return {Range{0.1, 1e3}, kLength};
    case Family::lognormal:
        return {Range{-27, 27}, Range{1e-3, 4}};
    case Family::truncated_normal:
        return {Range{-kMaxLength, kMaxLength}, kLength};
    case Family::uniform:
        return {Range{0, kMaxLength}, kLength};
    case Family::empirical:
        break;
    }
    return {};
}

[[noreturn]] void refuse(Family family, std::string_view what, std::string_view remedy) {
    throw Error(Fault::bad_argument, std::string(family_name(family)) +
                                         " law: " + std::string(what) + "; " + std::string(remedy));
}

double upper_normal(double z) {
    return 0.5 * boost::math::erfc(z * std::numbers::sqrt2 / 2, Policy());
}

double standard_normal_pdf(double z) {
    return std::exp(-0.5 * z * z) / std::sqrt(2 * std::numbers::pi);
}

double power(double x, int k) {
    double result = 1;
    for (int i = 0; i < k; ++i)
        result *= x;
    return result;
}

// E[X^k] of a uniform variable on [lo, hi]: the mean of lo^i hi^(k-i), without cancellation.
double uniform_moment(double lo, double hi, int k) {
    double sum = 0;
    for (int i = 0; i <= k; ++i)
        sum += power(lo, i) * power(hi, k - i);
    return sum / (k + 1);
}

double truncated_normal_moment(double mean, double sd, int k) {
    double before = 1;
    double now = mean + sd * standard_normal_pdf(mean / sd) / upper_normal(-mean / sd);
    if (k == 0)
        return 1;
    for (int i = 2; i <= k; ++i) // integration by parts; the boundary term at 0 vanishes
        before = std::exchange(now, mean * now + (i - 1) * sd * sd * before);
    return now;
}

} // namespace

std::string_view family_name(Family family) {
    return kFamilies[static_cast<std::size_t>(family)];
}

Family family_from_name(std::string_view name) {
    const auto found = std::find(kFamilies.begin(), kFamilies.end(), name);
    if (found == kFamilies.end()) {
        const std::string nearest = did_you_mean(name, kFamilies);
        throw Error(Fault::bad_argument,
                    "law: unknown family '" + printable(name) + "'" +
                        (nearest.empty() ? "; use one such as exponential or gamma" : nearest));
    }
    return static_cast<Family>(found - kFamilies.begin());
}

std::span<const std::string_view> parameter_names(Family family) {
    static constexpr std::array<std::string_view, 1> kRate = {"rate"}, kDiameter = {"diameter"};
    static constexpr std::array<std::string_view, 2> kShapeScale = {"shape", "scale"},
                                                     kLogs = {"mean_log", "sd_log"},
                                                     kMoments = {"mean", "sd"},
                                                     kEnds = {"lo", "hi"};
    switch (family) {
    case Family::exponential:
        return kRate;
    case Family::gamma:
    case Family::weibull:
        return kShapeScale;
    case Family::lognormal:
        return kLogs;
    case Family::truncated_normal:
        return kMoments;
    case Family::uniform:
        return kEnds;
    case Family::constant:
        return kDiameter;
    case Family::empirical:
        break;
    }
    return {};
}

Law::Law(Family family, std::span<const double> parameters) : family_(family) {
    const auto names = parameter_names(family);
    if (family == Family::empirical)
        refuse(family, "is a table, not parameters", "give its points");
    if (parameters.size() != names.size())
        refuse(family, std::to_string(parameters.size()) + " parameters",
               "give " + std::to_string(names.size()));
    std::copy(parameters.begin(), parameters.end(), parameters_.begin());
    const auto legal = ranges(family);
    for (std::size_t i = 0; i < names.size(); ++i)
        if (!(parameters_[i] >= legal[i].lo && parameters_[i] <= legal[i].hi))
            refuse(family, std::string(names[i]) + " is " + shortest(parameters_[i]),
                   "must be in " + shortest(legal[i].lo) + ".." + shortest(legal[i].hi));
    const auto [a, b] = parameters_;
    if (family == Family::uniform && !(a < b))
        refuse(family, "lo is " + shortest(a) + " and hi is " + shortest(b), "lo must be below hi");
    // Below, too little of the law is above 0; above, it is a constant to the quadratures.
    if (family == Family::truncated_normal && !(a >= -6 * b && a <= 1000 * b))
        refuse(family, "mean is " + shortest(a) + " with sd " + shortest(b),
               "the mean must be in -6..1000 sd");
    if (family == Family::gamma)
        log_normaliser_ = -boost::math::lgamma(a, Policy()) - std::log(b);
    if (family == Family::truncated_normal)
        log_normaliser_ = -std::log(b * std::sqrt(2 * std::numbers::pi) * upper_normal(-a / b));
}

Law Law::exponential(double rate) {
    return Law(Family::exponential, {&rate, 1});
}

Law Law::constant(double diameter) {
    return Law(Family::constant, {&diameter, 1});
}

Law Law::empirical(std::vector<CdfPoint> points) {
    const auto fail = [](std::size_t i, const std::string& what) {
        refuse(Family::empirical, "point " + std::to_string(i) + ": " + what, "correct the table");
    };
    if (points.size() < 2)
        refuse(Family::empirical, std::to_string(points.size()) + " points", "give at least 2");
    for (std::size_t i = 0; i < points.size(); ++i) {
        const auto [diameter, share] = points[i];
        if (!(diameter >= 0 && diameter <= kMaxLength) || (i > 0 && diameter < kMinLength))
            fail(i, "diameter is " + shortest(diameter) + ", must be in 0..1e12");
        if (!(share >= 0 && share <= 1))
            fail(i, "the CDF is " + shortest(share) + ", must be in 0..1");
        if (i > 0 && !(diameter > points[i - 1].diameter))
            fail(i, "diameter " + shortest(diameter) + " does not rise");
        if (i > 0 && !(share >= points[i - 1].cdf))
            fail(i, "the CDF falls to " + shortest(share));
    }
    if (points.front().cdf != 0)
        fail(0, "the CDF begins at " + shortest(points.front().cdf) + ", must be 0");
    if (points.back().cdf != 1)
        fail(points.size() - 1, "the CDF ends at " + shortest(points.back().cdf) + ", must be 1");
    Law law;
    law.family_ = Family::empirical;
    law.points_ = std::move(points);
    return law;
}

std::span<const double> Law::parameters() const {
    return {parameters_.data(), parameter_names(family_).size()};
}

double Law::pdf(double x) const {
    if (!(x >= 0))
        return 0;
    const auto [a, b] = parameters_;
    switch (family_) {
    case Family::exponential:
        return a * std::exp(-a * x);
    case Family::gamma:
        if (x == 0)
            return a > 1 ? 0 : a == 1 ? 1 / b : std::numeric_limits<double>::infinity();
        return std::exp((a - 1) * std::log(x / b) - x / b + log_normaliser_);
    case Family::weibull: {
        if (x == 0)
            return a > 1 ? 0 : a == 1 ? 1 / b : std::numeric_limits<double>::infinity();
        const double log_ratio = std::log(x / b);
        return a / b * std::exp((a - 1) * log_ratio - std::exp(a * log_ratio));
    }
    case Family::lognormal:
        return x == 0 ? 0 : standard_normal_pdf((std::log(x) - a) / b) / (b * x);
    case Family::truncated_normal:
        return std::exp(log_normaliser_ - 0.5 * (x - a) / b * ((x - a) / b));
    case Family::uniform:
        return x >= a && x <= b ? 1 / (b - a) : 0;
    case Family::constant:
        return 0;
    case Family::empirical:
        break;
    }
    const auto above = std::upper_bound(points_.begin(), points_.end(), x,
                                        [](double v, const CdfPoint& p) { return v < p.diameter; });
    if (above == points_.begin() || above == points_.end())
        return 0;
    const auto below = above - 1;
    return (above->cdf - below->cdf) / (above->diameter - below->diameter);
}

double Law::cdf(double x) const {
    if (std::isnan(x))
        return x;
    if (x < 0)
        return 0;
    const auto [a, b] = parameters_;
    switch (family_) {
    case Family::exponential:
        return -std::expm1(-a * x);
    case Family::gamma:
        return std::isinf(x) ? 1 : boost::math::gamma_p(a, x / b, Policy());
    case Family::weibull:
        return -std::expm1(-std::pow(x / b, a));
    case Family::lognormal:
        return x == 0 ? 0 : upper_normal((a - std::log(x)) / b);
    case Family::truncated_normal:
        return 1 - upper_normal((x - a) / b) / upper_normal(-a / b);
    case Family::uniform:
        return std::clamp((x - a) / (b - a), 0.0, 1.0);
    case Family::constant:
        return x >= a ? 1 : 0;
    case Family::empirical:
        break;
    }
    const auto above = std::upper_bound(points_.begin(), points_.end(), x,
                                        [](double v, const CdfPoint& p) { return v < p.diameter; });
    if (above == points_.begin())
        return 0;
    if (above == points_.end())
        return 1;
    const auto below = above - 1;
    return below->cdf +
           (above->cdf - below->cdf) * (x - below->diameter) / (above->diameter - below->diameter);
}

double Law::quantile(double u) const {
    if (!(u >= 0 && u <= 1))
        refuse(family_, "quantile asked at " + shortest(u), "must be in 0..1");
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const auto [a, b] = parameters_;
    switch (family_) {
    case Family::exponential:
        return -portable_log(1 - u) / a;
    case Family::gamma:
        return u == 1 ? kInfinity : b * boost::math::gamma_p_inv(a, u, Policy());
    case Family::weibull:
        return u == 1 ? kInfinity : b * std::pow(-std::log1p(-u), 1 / a);
    case Family::lognormal:
        if (u == 0 || u == 1)
            return u == 0 ? 0 : kInfinity;
        return std::exp(a - b * std::numbers::sqrt2 * boost::math::erfc_inv(2 * u, Policy()));
    case Family::truncated_normal: {
        if (u == 0 || u == 1)
            return u == 0 ? 0 : kInfinity;
        // By the smaller tail of the whole normal law, which keeps its digits.
        const double above = (1 - u) * upper_normal(-a / b);
        const double below = upper_normal(a / b) + u * upper_normal(-a / b);
        const double z = above < below ? boost::math::erfc_inv(2 * above, Policy())
                                       : -boost::math::erfc_inv(2 * below, Policy());
        return std::max(0.0, a + b * std::numbers::sqrt2 * z);
    }
    case Family::uniform:
        return std::min(a + u * (b - a), b);
    case Family::constant:
        return a;
    case Family::empirical:
        break;
    }
    const auto at = std::lower_bound(points_.begin() + 1, points_.end(), u,
                                     [](const CdfPoint& p, double v) { return p.cdf < v; });
    const auto below = at - 1;
    const double rise = at->cdf - below->cdf;
    const double share = rise > 0 ? (u - below->cdf) / rise : 0;
    return std::min(below->diameter + share * (at->diameter - below->diameter), at->diameter);
}

double Law::moment(int k) const {
    if (k < 0)
        refuse(family_, "moment of order " + std::to_string(k), "must be 0 or more");
    const auto [a, b] = parameters_;
    double result = 1;
    switch (family_) {
    case Family::exponential:
        for (int i = 1; i <= k; ++i)
            result *= i / a;
        return result;
    case Family::gamma:
        for (int i = 0; i < k; ++i)
            result *= (a + i) * b;
        return result;
    case Family::weibull:
        return k == 0 ? 1 : power(b, k) * std::tgamma(1 + k / a);
    case Family::lognormal:
        return std::exp(k * a + 0.5 * k * k * b * b);
    case Family::truncated_normal:
        return truncated_normal_moment(a, b, k);
    case Family::uniform:
        return uniform_moment(a, b, k);
    case Family::constant:
        return power(a, k);
    case Family::empirical:
        break;
    }
    result = 0;
    for (std::size_t i = 1; i < points_.size(); ++i)
        result += (points_[i].cdf - points_[i - 1].cdf) *
                  uniform_moment(points_[i - 1].diameter, points_[i].diameter, k);
    return result;
}

Law scaled(const Law& law, double factor) {
    if (!(factor > 0 && std::isfinite(factor)))
        refuse(law.family(), "scaled by " + shortest(factor), "give a finite factor > 0");
    if (law.family() == Family::empirical) {
        std::vector<CdfPoint> points(law.points().begin(), law.points().end());
        for (CdfPoint& p : points)
            p.diameter *= factor;
        return Law::empirical(std::move(points));
    }
    std::vector<double> p(law.parameters().begin(), law.parameters().end());
    switch (law.family()) {
    case Family::exponential:
        p[0] /= factor;
        break;
    case Family::gamma:
    case Family::weibull:
        p[1] *= factor;
        break;
    case Family::lognormal:
        p[0] += std::log(factor);
        break;
    default: // every parameter is a length
        for (double& length : p)
            length *= factor;
    }
    return Law(law.family(), p);
}

} // namespace taihu
