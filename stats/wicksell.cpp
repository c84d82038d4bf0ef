#include "stats/wicksell.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <boost/math/special_functions/bessel.hpp>

#include "stats/core/error.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

using Policy = boost::math::policies::policy<boost::math::policies::promote_double<false>>;

// log K_nu(x) for nu = 0 or 1 and x > 0. Past 50, where K itself underflows soon, by its asymptotic
// series, whose terms fall below 1e-17 long before they grow again.
double log_bessel_k(int nu, double x) {
    if (x < 50)
        return std::log(boost::math::cyl_bessel_k(nu, x, Policy()));
    double term = 1, sum = 1;
    for (int k = 1; k < 20; ++k) {
        const double odd = 2 * k - 1;
        term *= (4.0 * nu * nu - odd * odd) / (8 * x * k);
        sum += term;
    }
    return -x + 0.5 * std::log(std::numbers::pi / (2 * x)) + std::log(sum);
}

// Width of the density f3 in log D, which sets how fine the quadrature must be.
double log_width(const Law& law) {
    const double a = law.parameters()[0];
    switch (law.family()) {
    case Family::gamma:
        return 1 / std::sqrt(a);
    case Family::weibull:
        return 1 / a;
    case Family::lognormal:
        return law.parameters()[1];
    case Family::truncated_normal:
        return a > 0 ? law.parameters()[1] / a : 1;
    default:
        return 1;
    }
}

// int sqrt(x^2 - d^2) dx; both parts are taken relative to d = 0 at x = d.
double root_integral(double x, double d) {
    if (x <= d)
        return 0;
    const double chord = x * std::sqrt((x - d) * (x + d));
    return d > 0 ? (chord - d * d * std::acosh(x / d)) / 2 : chord / 2;
}

} // namespace

SectionLaw::SectionLaw(Law law) : law_(std::move(law)) {
    mean_ = law_.mean();
    if (law_.family() == Family::uniform)
        points_ = {{law_.parameters()[0], 0}, {law_.parameters()[1], 1}};
    if (law_.family() == Family::empirical)
        points_.assign(law_.points().begin(), law_.points().end());
    if (!points_.empty() || law_.family() == Family::exponential ||
        law_.family() == Family::constant)
        return;
    step_ = std::min(0.05, log_width(law_) / 4);
    lowest_ = law_.quantile(1e-20);
    // The weight D^2 f3 of the survival integral peaks below E[D^2] / E[D] for all these laws.
    beyond_ = law_.moment(2) / mean_;
}

// int_0^inf w(t) f3(d cosh t) dt with w = 1, or sinh^2 t when weighted.
double SectionLaw::integral(double d, bool weighted) const {
    const double first = d < lowest_ ? std::acosh(lowest_ / d) : 0;
    double sum = 0;
    for (std::size_t i = 0;; ++i) {
        const double t = first + static_cast<double>(i) * step_;
        const double s = std::sinh(t), diameter = d * std::cosh(t);
        double term = law_.pdf(diameter) * (weighted ? s * s : 1);
        if (i == 0)
            term /= 2; // the other half belongs to the mirror image; past `lowest_` it is nothing
        sum += term;
        const bool falling = i > 0 && diameter > beyond_;
        if (falling && term <= 1e-18 * sum)
            return sum * step_;
    }
}

double SectionLaw::pdf(double d) const {
    if (!(d > 0))
        return 0;
    if (law_.family() == Family::exponential)
        return std::exp(log_pdf(d));
    if (law_.family() == Family::constant) {
        const double diameter = mean_;
        return d > diameter ? 0 : d / (diameter * std::sqrt((diameter - d) * (diameter + d)));
    }
    if (points_.empty())
        return d / mean_ * integral(d, false);
    double sum = 0;
    for (std::size_t i = 1; i < points_.size(); ++i) {
        const auto &a = points_[i - 1], &b = points_[i];
        if (b.diameter <= d)
            continue;
        sum += (b.cdf - a.cdf) / (b.diameter - a.diameter) *
               (std::acosh(b.diameter / d) - std::acosh(std::max(a.diameter, d) / d));
    }
    return d / mean_ * sum;
}

double SectionLaw::survival(double d) const {
    if (!(d > 0))
        return 1;
    if (law_.family() == Family::exponential)
        return std::exp(log_survival(d));
    if (law_.family() == Family::constant)
        return d >= mean_ ? 0 : std::sqrt((mean_ - d) * (mean_ + d)) / mean_;
    if (points_.empty())
        return std::min(1.0, d * d / mean_ * integral(d, true));
    double sum = 0;
    for (std::size_t i = 1; i < points_.size(); ++i) {
        const auto &a = points_[i - 1], &b = points_[i];
        sum += (b.cdf - a.cdf) / (b.diameter - a.diameter) *
               (root_integral(b.diameter, d) - root_integral(a.diameter, d));
    }
    return std::min(1.0, sum / mean_);
}

double SectionLaw::log_pdf(double d) const {
    if (law_.family() != Family::exponential || !(d > 0))
        return std::log(pdf(d));
    const double rate = law_.parameters()[0];
    return 2 * std::log(rate) + std::log(d) + log_bessel_k(0, rate * d);
}

double SectionLaw::log_survival(double d) const {
    if (law_.family() != Family::exponential || !(d > 0))
        return std::log(survival(d));
    const double x = law_.parameters()[0] * d;
    return std::min(0.0, std::log(x) + log_bessel_k(1, x));
}

double SectionLaw::quantile(double u) const {
    if (!(u > 0 && u < 1))
        throw Error(Fault::bad_argument,
                    "section law: quantile asked at " + shortest(u) + "; must be inside 0..1");
    double lo = 0, hi = mean_;
    while (survival(hi) > 1 - u) {
        lo = hi;
        hi *= 2;
    }
    while (true) {
        const double middle = 0.5 * (lo + hi);
        if (!(lo < middle && middle < hi) || hi - lo <= 1e-15 * hi)
            return middle;
        (survival(middle) > 1 - u ? lo : hi) = middle;
    }
}

} // namespace taihu
