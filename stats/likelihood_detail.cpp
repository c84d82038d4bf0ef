#include "stats/likelihood_detail.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace taihu {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The logarithm of a density far from its law, where differences of logarithms have no digits left.
constexpr double kNothing = -1e15;
// The logarithm of a share of sections below which nothing is said of what is seen: 1e-12.
constexpr double kUnseen = -27.6;

// Mean of the normal law with sd 1 above 0.
double truncated_mean(double ratio) {
    return Law(Family::truncated_normal, std::array<double, 2>{ratio, 1}).mean();
}

// Width of the density in log D.
double log_width(const Law& law) {
    const auto p = law.parameters();
    switch (law.family()) {
    case Family::gamma:
        return 1 / std::sqrt(p[0]);
    case Family::weibull:
        return 1 / p[0];
    case Family::lognormal:
        return p[1];
    default: // truncated normal
        return p[0] > p[1] ? p[1] / p[0] : 1;
    }
}

// A diameter near which the density is greatest, or 0.
double mode(const Law& law) {
    const auto p = law.parameters();
    switch (law.family()) {
    case Family::gamma:
        return std::max(0.0, p[0] - 1) * p[1];
    case Family::weibull:
        return p[0] > 1 ? p[1] * std::pow(1 - 1 / p[0], 1 / p[0]) : 0;
    case Family::lognormal:
        return std::exp(p[0] - p[1] * p[1]);
    default: // truncated normal
        return std::max(0.0, p[0]);
    }
}

// Degree 5 through the values at -2..3, at 0 <= f < 1.
template <class Value>
double interpolate(double f, Value value) {
    const double a = f + 2, b = f + 1, c = f, d = f - 1, e = f - 2, g = f - 3;
    const double ab = a * b, cd = c * d, eg = e * g;
    return (a * cd * eg / 24) * value(-1) - (b * cd * eg / 120) * value(-2) -
           (ab * d * eg / 12) * value(0) + (ab * c * eg / 12) * value(1) -
           (ab * cd * g / 24) * value(2) + (ab * cd * e / 120) * value(3);
}

// The same, but straight beside values that stand for nothing: a polynomial would swing over them.
template <class Value>
double between(double f, Value value) {
    for (int k = -2; k <= 3; ++k)
        if (value(k) <= kNothing)
            return (1 - f) * value(0) + f * value(1);
    return interpolate(f, value);
}

} // namespace

std::optional<ShapeRange> shape_range(Family family) {
    switch (family) {
    case Family::gamma:
        return ShapeRange{std::log(0.05), std::log(1000)};
    case Family::weibull:
        return ShapeRange{std::log(0.2), std::log(40)};
    case Family::lognormal:
        return ShapeRange{std::log(0.02), std::log(3)};
    case Family::truncated_normal:
        return ShapeRange{std::asinh(-5.99), std::asinh(40)};
    case Family::uniform:
        return ShapeRange{0, 0.98, true};
    default:
        return std::nullopt;
    }
}

std::array<double, 2> parameters_at(Family family, double log_mean, double shape) {
    const double mean = std::exp(log_mean), a = std::exp(shape);
    switch (family) {
    case Family::exponential:
        return {1 / mean, 0};
    case Family::gamma:
        return {a, mean / a};
    case Family::weibull:
        return {a, mean / std::tgamma(1 + 1 / a)};
    case Family::lognormal:
        return {log_mean - 0.5 * a * a, a};
    case Family::truncated_normal: {
        const double ratio = std::sinh(shape), sd = mean / truncated_mean(ratio);
        return {ratio * sd, sd};
    }
    case Family::uniform:
        return {2 * mean * shape / (1 + shape), 2 * mean / (1 + shape)};
    default:
        return {mean, 0};
    }
}

Law law_at(Family family, double log_mean, double shape) {
    const auto all = parameters_at(family, log_mean, shape);
    return Law(family, std::span(all).first(parameter_names(family).size()));
}

double log_prior(Family family, double shape) {
    return family == Family::gamma || family == Family::weibull ? std::min(0.0, shape) : 0;
}

UnitSection::UnitSection(Family family, double shape)
    : section_(law_at(family, 0, shape)),
      closed_(family == Family::exponential || !shape_range(family) || family == Family::uniform) {
    if (closed_)
        return;
    const Law& law = section_.law();
    const double width = log_width(law);
    spacing_ = std::min(0.1, width / 4);
    // The error of the trapezoid rule on a bell of this width is exp(-2 (2 pi)^2).
    step_ = std::min(0.15, width / 2);
    lowest_ = law.quantile(1e-20);
    mode_ = mode(law);
    beyond_ = std::max(mode_, law.moment(2)); // E[D^2] / E[D], as in SectionLaw
    const auto p = law.parameters();
    switch (law.family()) {
    case Family::gamma:
        log_norm_ = -std::lgamma(p[0]) - std::log(p[1]);
        break;
    case Family::weibull:
        log_norm_ = std::log(p[0] / p[1]);
        break;
    case Family::lognormal:
        log_norm_ = -std::log(p[1] * std::sqrt(2 * std::numbers::pi));
        break;
    default: // truncated normal: at its mode, or at 0
        log_norm_ = std::log(law.pdf(mode_)) + 0.5 * std::pow((mode_ - p[0]) / p[1], 2);
    }
}

// The integral of SectionLaw, relative to the greatest density on its way, so that neither end of
// the range of a double is met. `log_density` takes log D and D.
template <class LogDensity>
UnitSection::Node UnitSection::integrate(double x, LogDensity log_density) {
    const double d = std::exp(x);
    const double greatest = log_density(std::log(std::max(d, mode_)), std::max(d, mode_));
    if (!(greatest > kNothing))
        return {kNothing, kNothing};
    const double start = d < lowest_ ? std::acosh(lowest_ / d) / step_ : 0;
    double density = 0, weighted = 0;
    for (auto k = static_cast<std::size_t>(start);; ++k) {
        while (k >= cosh_.size()) {
            const double t = static_cast<double>(cosh_.size()) * step_;
            cosh_.push_back(std::cosh(t));
            log_cosh_.push_back(t + std::log1p(std::expm1(-2 * t) / 2));
        }
        const double c = cosh_[k], diameter = d * c;
        double term = std::exp(log_density(x + log_cosh_[k], diameter) - greatest);
        if (k == 0)
            term /= 2;
        const double squared = (c - 1) * (c + 1);
        density += term;
        weighted += term * squared;
        if (diameter > beyond_ && term * squared <= 1e-13 * weighted && term <= 1e-13 * density)
            break;
    }
    return {x + std::log(step_ * density) + greatest,
            std::min(0.0, 2 * x + std::log(step_ * weighted) + greatest)};
}

UnitSection::Node UnitSection::node(double x) {
    const double a = section_.law().parameters()[0], b = section_.law().parameters()[1];
    const double log_b = std::log(b), norm = log_norm_;
    switch (section_.law().family()) {
    case Family::gamma:
        return integrate(x, [=](double z, double diameter) {
            return norm + (a - 1) * (z - log_b) - diameter / b;
        });
    case Family::weibull:
        return integrate(x, [=](double z, double) {
            return norm + (a - 1) * (z - log_b) - std::exp(a * (z - log_b));
        });
    case Family::lognormal:
        return integrate(
            x, [=](double z, double) { return norm - z - 0.5 * ((z - a) / b) * ((z - a) / b); });
    default: // truncated normal
        return integrate(x, [=](double, double diameter) {
            return norm - 0.5 * ((diameter - a) / b) * ((diameter - a) / b);
        });
    }
}

void UnitSection::cover(double lo, double hi) {
    if (closed_)
        return;
    auto first = static_cast<std::ptrdiff_t>(std::floor(lo / spacing_)) - 2;
    auto last = static_cast<std::ptrdiff_t>(std::floor(hi / spacing_)) + 3;
    const auto n = static_cast<std::ptrdiff_t>(nodes_.size());
    if (n > 0 && first >= first_ && last < first_ + n)
        return;
    std::vector<Node> nodes;
    if (n > 0) {
        first = std::min(first, first_);
        last = std::max(last, first_ + n - 1);
    }
    nodes.reserve(static_cast<std::size_t>(last - first + 1));
    for (std::ptrdiff_t i = first; i <= last; ++i)
        nodes.push_back(i >= first_ && i < first_ + n ? nodes_[static_cast<std::size_t>(i - first_)]
                                                      : node(static_cast<double>(i) * spacing_));
    first_ = first;
    nodes_ = std::move(nodes);
}

double UnitSection::log_pdf(double x) const {
    if (closed_)
        return section_.log_pdf(std::exp(x));
    const double at = x / spacing_, i = std::floor(at);
    const Node* node = nodes_.data() + (static_cast<std::ptrdiff_t>(i) - first_);
    return between(at - i, [&](int k) { return node[k].log_pdf; });
}

double UnitSection::log_survival(double x) const {
    if (closed_)
        return section_.log_survival(std::exp(x));
    if (x == -kInfinity)
        return 0;
    const double at = x / spacing_, i = std::floor(at);
    const Node* node = nodes_.data() + (static_cast<std::ptrdiff_t>(i) - first_);
    return std::min(0.0, between(at - i, [&](int k) { return node[k].log_survival; }));
}

Likelihood::Likelihood(const Sample& sample, const Detection& detection, Family family,
                       std::optional<double> resolution)
    : detection_(&detection), family_(family) {
    std::vector<double> sorted = sample.diameters;
    std::sort(sorted.begin(), sorted.end());
    log_least_ = detection.limit() > 0 ? std::log(detection.limit()) : kInfinity;
    log_most_ = detection.last_knot() > 0 ? std::log(detection.last_knot()) : -kInfinity;
    for (std::size_t i = 0, next; i < sorted.size(); i = next) {
        const double d = sorted[i];
        for (next = i + 1; next < sorted.size() && sorted[next] == d;)
            ++next;
        const auto count = static_cast<double>(next - i);
        mean_profile_ += count * d;
        n_ += count;
        if (resolution) {
            add_cell(std::max(d - 0.5 * *resolution, detection.limit()), d + 0.5 * *resolution,
                     count, false);
            continue;
        }
        points_.push_back({std::log(d), count});
        constant_ += count * std::log(detection.share(d));
        log_least_ = std::min(log_least_, std::log(d));
        log_most_ = std::max(log_most_, std::log(d));
        greatest_ = d;
    }
    for (const Bin& bin : sample.bins) {
        if (bin.count == 0)
            continue;
        const auto count = static_cast<double>(bin.count);
        mean_profile_ += count * 0.5 * (bin.lo + bin.hi);
        n_ += count;
        add_cell(bin.lo, bin.hi, count, true);
    }
    mean_profile_ /= n_;
}

void Likelihood::add_cell(double lo, double hi, double count, bool is_bin) {
    const double mid = 0.5 * (lo + hi);
    const bool flat = detection_->is_flat(lo, hi);
    cells_.push_back({lo, hi, std::log(lo), std::log(mid), std::log(hi), count,
                      flat ? std::log(detection_->share(mid)) : 0, is_bin ? 0 : std::log(hi - lo),
                      flat});
    log_least_ = std::min(log_least_, lo > 0 ? std::log(lo) : std::log(mid));
    log_most_ = std::max(log_most_, std::log(hi));
    greatest_ = std::max(greatest_, hi);
}

std::function<double(double)> Likelihood::survival(double log_mean) const {
    return [this, log_mean](double d) {
        return d > 0 ? std::exp(section_->log_survival(std::log(d) - log_mean)) : 1;
    };
}

double Likelihood::log_cell(const Cell& cell, double log_mean) const {
    if (!cell.flat)
        return std::log(detection_->seen(survival(log_mean), cell.lo, cell.hi)) - cell.log_width;
    const double above = cell.lo > 0 ? section_->log_survival(cell.log_lo - log_mean) : 0;
    const double past = section_->log_survival(cell.log_hi - log_mean);
    // The difference of two interpolated values has no digits left.
    const double log_share = above - past < 1e-5 ? section_->log_pdf(cell.log_mid - log_mean) -
                                                       log_mean + std::log(cell.hi - cell.lo)
                                                 : above + std::log(-std::expm1(past - above));
    return log_share + cell.log_share - cell.log_width;
}

void Likelihood::prepare(double log_mean, double shape) {
    if (!section_ || !(shape == shape_)) {
        section_.emplace(family_, shape);
        shape_ = shape;
    }
    section_->cover(log_least_ - log_mean, log_most_ - log_mean);
}

double Likelihood::log_seen(double log_mean) const {
    const double limit = detection_->limit();
    if (detection_->is_flat(limit, kInfinity)) // also where the share itself would underflow
        return limit > 0 ? section_->log_survival(std::log(limit) - log_mean) : 0;
    return std::log(detection_->seen(survival(log_mean), limit, kInfinity));
}

double Likelihood::operator()(double log_mean, double shape) {
    prepare(log_mean, shape);
    const double seen = log_seen(log_mean);
    // What follows is then the difference of two large numbers, each with its error. Rising, so
    // that a search finds its way out.
    if (!(seen > kUnseen))
        return kImpossible + std::max(seen, kImpossible);
    double sum = constant_ - n_ * seen + log_prior(family_, shape);
    for (const Point& p : points_)
        sum += p.count * (section_->log_pdf(p.log_d - log_mean) - log_mean);
    for (const Cell& cell : cells_)
        sum += cell.count * log_cell(cell, log_mean);
    // A law with nothing above the limit divides by nothing.
    return std::isfinite(sum) ? std::max(sum, kImpossible) : kImpossible;
}

double Likelihood::seen(double log_mean, double shape) {
    prepare(log_mean, shape);
    return std::exp(log_seen(log_mean));
}

double Likelihood::above(double log_mean, double shape) {
    prepare(log_mean, shape);
    return std::max(1e-16, 1 - section_->law().cdf(detection_->limit() * std::exp(-log_mean)));
}

} // namespace taihu
