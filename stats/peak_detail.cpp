#include "stats/peak_detail.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include <boost/math/special_functions/gamma.hpp>
#include <boost/math/tools/minima.hpp>
#include <boost/math/tools/toms748_solve.hpp>

#include "stats/core/error.h"

namespace taihu {
namespace {

// Without promotion to long double, whose width differs from machine to machine; the gamma function
// of a large shape may overflow on the way to a CDF of 0.
using Policy = boost::math::policies::policy<
    boost::math::policies::promote_double<false>,
    boost::math::policies::overflow_error<boost::math::policies::ignore_error>>;

// How far the logarithm of the mean may run from where it started: a factor 1.6e5, past which the
// sizes differ by less than 1e-5.
constexpr double kFarthest = 12;

[[noreturn]] void refuse_no_maximum(Family family) {
    throw Error(Fault::numeric, "fit: " + std::string(family_name(family)) +
                                    ": the likelihood rises without end; mark more holes or lower "
                                    "the detection limit");
}

// A peak that means something.
Peak sound(Likelihood& likelihood, const Peak& peak) {
    if (likelihood.seen(peak.log_mean, peak.shape) >= kLeastSeen)
        return peak;
    throw Error(Fault::numeric, "fit: " + std::string(family_name(likelihood.family())) +
                                    ": hardly any hole of the likeliest law reaches the detection "
                                    "limit; lower it or mark holes of several sizes");
}

struct Top {
    double at, height;
    bool far; ///< the walk uphill did not end
};

// The maximum of a function of one variable that falls on both sides.
Top climb(const std::function<double(double)>& f, double start, int bits) {
    constexpr double kStride = 0.25;
    double stride = kStride, at = start, height = f(at);
    double before = start - stride, after = start + stride;
    const double right = f(after), left = right > height ? height : f(before);
    if (right > height || left > height) {
        if (left > height)
            stride = -stride;
        before = start;
        at = start + stride;
        height = stride > 0 ? right : left;
        while (true) {
            after = at + stride;
            const double next = f(after);
            if (next <= height)
                break;
            if (std::abs(after - start) > kFarthest)
                return {after, next, true};
            before = at;
            at = after;
            height = next;
            stride *= 1.4;
        }
    }
    const auto negative = [&](double x) { return -f(x); };
    const auto [x, least] = boost::math::tools::brent_find_minima(negative, std::min(before, after),
                                                                  std::max(before, after), bits);
    return -least > height ? Top{x, -least, false} : Top{at, height, false};
}

// Where f passes 0, from f(a) = f_a > 0 to f(b) = f_b <= 0.
double root(const std::function<double(double)>& f, double a, double b, double f_a, double f_b,
            int bits) {
    if (!(f_a > 0 && f_b < 0))
        return f_a > 0 ? b : a;
    if (a > b) {
        std::swap(a, b);
        std::swap(f_a, f_b);
    }
    std::uintmax_t n = 60;
    const auto [lo, hi] = boost::math::tools::toms748_solve(
        f, a, b, f_a, f_b, boost::math::tools::eps_tolerance<double>(bits), n);
    return 0.5 * (lo + hi);
}

// Where f has fallen to `floor`, from `top` by steps of `step` or more; NaN when it never does.
double crossing(const std::function<double(double)>& f, const Top& top, double floor, double step,
                int bits) {
    double inside = top.at, outside = inside + step, over = top.height - floor, under = 0;
    while ((under = f(outside) - floor) > 0) {
        inside = outside;
        over = under;
        step *= 2;
        outside = inside + step;
        if (std::abs(inside - top.at) > kFarthest)
            return std::numeric_limits<double>::quiet_NaN();
    }
    return root([&](double x) { return f(x) - floor; }, inside, outside, over, under, bits);
}

// The likelihood along the mean, for one shape after another.
class Ridge {
public:
    Ridge(Likelihood& likelihood, double log_mean) : likelihood_(&likelihood), hint_(log_mean) {
        step_ = 1 / std::sqrt(likelihood.n());
    }

    Top top(double shape, int bits = 16) {
        const Top result = climb(along(shape), hint_, bits);
        hint_ = result.at;
        return result;
    }

    // The end of what lies above `floor`, towards smaller (-1) or greater means.
    double end(double shape, const Top& top, double floor, double direction, int bits = 26) {
        if (!(top.height > floor))
            return top.at;
        return crossing(along(shape), top, floor, direction * step_, bits);
    }

    std::function<double(double)> along(double shape) {
        return [this, shape](double log_mean) { return (*likelihood_)(log_mean, shape); };
    }

private:
    Likelihood* likelihood_;
    double hint_, step_;
};

double first_log_mean(const Likelihood& likelihood) {
    // E[d] = pi / 4 E[D^2] / E[D]; exponential: pi / 2 E[D]. Laws with an end must reach the
    // greatest profile.
    if (likelihood.family() == Family::constant || likelihood.family() == Family::uniform)
        return std::log(1.01 * likelihood.greatest_profile());
    return std::log(2 * likelihood.mean_profile() / std::numbers::pi);
}

// The shape at which the profile likelihood has fallen to `floor`, or the end of the range.
double shape_end(Ridge& ridge, const Peak& peak, double floor, double end, bool& open) {
    const double direction = end < peak.shape ? -1 : 1;
    if (end == peak.shape) {
        open = true;
        return end;
    }
    double inside = peak.shape, over = peak.log_likelihood - floor, step = 0.2;
    while (true) {
        const double outside = std::abs(end - inside) <= step ? end : inside + direction * step;
        const double under = ridge.top(outside).height - floor;
        if (!(under > 0)) {
            const auto fall = [&](double s) { return ridge.top(s).height - floor; };
            return root(fall, inside, outside, over, under, 18);
        }
        if (outside == end) {
            open = true;
            return end;
        }
        inside = outside;
        over = under;
        step *= 2;
    }
}

// The parameters, and the mean as a third.
std::array<double, 3> values_at(Family family, double log_mean, double shape) {
    const auto [a, b] = parameters_at(family, log_mean, shape);
    return {a, b, std::exp(log_mean)};
}

// Shapes from one end of the region to the other, dense at the ends, where the region closes.
double shape_at(const Interval& shapes, double angle) {
    return 0.5 * (shapes.lo + shapes.hi) + 0.5 * (shapes.hi - shapes.lo) * std::sin(angle);
}

constexpr int kSlices = 12;

double slice_angle(int i) {
    return std::numbers::pi * (static_cast<double>(i) / kSlices - 0.5);
}

Region region_of_one(Likelihood& likelihood, const Peak& peak, double floor) {
    Ridge ridge(likelihood, peak.log_mean);
    const Top top{peak.log_mean, peak.log_likelihood, false};
    const double lo = ridge.end(0, top, floor, -1, 40), hi = ridge.end(0, top, floor, 1, 40);
    if (std::isnan(lo) || std::isnan(hi))
        refuse_no_maximum(likelihood.family());
    const double a = parameters_at(likelihood.family(), lo, 0)[0];
    const double b = parameters_at(likelihood.family(), hi, 0)[0];
    return {{{std::min(a, b), std::max(a, b)}}, {std::exp(lo), std::exp(hi)}, false};
}

} // namespace

Peak find_peak(Likelihood& likelihood) {
    const auto range = shape_range(likelihood.family());
    Ridge ridge(likelihood, first_log_mean(likelihood));
    if (!range) {
        // 26 bits: a maximum is no sharper than the square root of the machine precision.
        const Top top = ridge.top(0, 26);
        if (top.far)
            refuse_no_maximum(likelihood.family());
        return sound(likelihood, {top.at, 0, top.height, false});
    }
    constexpr int kScan = 8; // as many shapes as tell the right hill from its neighbours
    const double stride = (range->hi - range->lo) / kScan;
    int best = 0;
    double height = -std::numeric_limits<double>::infinity();
    for (int i = 0; i <= kScan; ++i) {
        const double here = ridge.top(range->lo + i * stride, 8).height;
        if (here > height) {
            best = i;
            height = here;
        }
    }
    const auto negative = [&](double shape) { return -ridge.top(shape).height; };
    const double lo = range->lo + std::max(0, best - 1) * stride;
    const double hi = range->lo + std::min(kScan, best + 1) * stride;
    double shape = boost::math::tools::brent_find_minima(negative, lo, hi, 20).first;
    // Brent never tries the ends themselves.
    const double tiny = 1e-4 * (range->hi - range->lo);
    const bool at_edge = shape - range->lo < tiny || range->hi - shape < tiny;
    if (at_edge)
        shape = shape - range->lo < tiny ? range->lo : range->hi;
    const Top top = ridge.top(shape, 26);
    const bool natural = range->lo_is_natural && shape == range->lo;
    if (top.far)
        refuse_no_maximum(likelihood.family());
    return sound(likelihood, {top.at, shape, top.height, at_edge && !natural});
}

Region likelihood_region(Likelihood& likelihood, const Peak& peak, double floor) {
    const Family family = likelihood.family();
    const auto range = shape_range(family);
    if (!range)
        return region_of_one(likelihood, peak, floor);
    Region region;
    Ridge ridge(likelihood, peak.log_mean);
    const double lo = shape_end(ridge, peak, floor, range->lo, region.open);
    region.open &= !range->lo_is_natural;
    const Interval shapes = {lo, shape_end(ridge, peak, floor, range->hi, region.open)};
    // An extreme value on the slice at this angle.
    const auto value = [&](double angle, std::size_t which, double direction) {
        const double shape = shape_at(shapes, angle);
        const Top top = ridge.top(shape);
        const double end = ridge.end(shape, top, floor, direction, 18);
        region.open |= std::isnan(end) || top.far;
        return values_at(family, std::isnan(end) ? top.at : end, shape)[which];
    };
    std::array<std::array<std::array<double, 3>, 2>, kSlices + 1> ends{}; // [slice][side][which]
    for (int i = 0; i <= kSlices; ++i) {
        const double shape = shape_at(shapes, slice_angle(i));
        const Top top = ridge.top(shape);
        for (const int side : {0, 1}) {
            const double end = ridge.end(shape, top, floor, side == 0 ? -1 : 1, 18);
            region.open |= std::isnan(end) || top.far;
            ends[static_cast<std::size_t>(i)][static_cast<std::size_t>(side)] =
                values_at(family, std::isnan(end) ? top.at : end, shape);
        }
    }
    // For one shape every parameter moves one way with the mean, so its extremes are at the ends.
    const auto extreme = [&](std::size_t which, double sign) {
        std::size_t slice = 0, side = 0;
        for (std::size_t i = 0; i <= kSlices; ++i)
            for (const std::size_t s : {0U, 1U})
                if (sign * ends[i][s][which] > sign * ends[slice][side][which])
                    slice = i, side = s;
        const double found = ends[slice][side][which];
        if (slice == 0 || slice == kSlices)
            return found;
        const auto at = [&](double angle) {
            return -sign * value(angle, which, side == 0 ? -1 : 1);
        };
        const int i = static_cast<int>(slice);
        const double better = -sign * boost::math::tools::brent_find_minima(at, slice_angle(i - 1),
                                                                            slice_angle(i + 1), 8)
                                          .second;
        return sign * better > sign * found ? better : found;
    };
    for (std::size_t p = 0; p < parameter_names(family).size(); ++p)
        region.intervals.push_back({extreme(p, -1), extreme(p, 1)});
    region.mean_diameter = {extreme(2, -1), extreme(2, 1)};
    return region;
}

std::vector<LawPart> law_parts(Likelihood& likelihood, const Peak& peak) {
    // Of a bell: the trapezoid rule converges faster than any power of the number of points.
    const auto range = shape_range(likelihood.family());
    const int n_means = range ? 16 : 60, n_shapes = range ? 20 : 0;
    // exp(-12) of the peak; of one parameter, at no cost, exp(-18).
    const double depth = range ? 12 : 18;
    Ridge ridge(likelihood, peak.log_mean);
    bool open = false;
    Interval shapes = {peak.shape, peak.shape};
    if (range)
        shapes = {shape_end(ridge, peak, peak.log_likelihood - depth, range->lo, open),
                  shape_end(ridge, peak, peak.log_likelihood - depth, range->hi, open)};
    std::vector<LawPart> parts;
    double sum = 0;
    const auto add = [&](double weight, double log_mean, double width, double shape) {
        const double seen = likelihood.seen(log_mean, shape);
        if (!(seen >= kLeastSeen))
            return;
        parts.push_back({weight, log_mean, width, std::exp(log_mean) * seen,
                         likelihood.above(log_mean, shape)});
        sum += weight;
    };
    for (int j = 0; j <= n_shapes; ++j) {
        const double shape =
            range ? shapes.lo + (shapes.hi - shapes.lo) * j / n_shapes : peak.shape;
        const Top top =
            range ? ridge.top(shape, 10) : Top{peak.log_mean, peak.log_likelihood, false};
        const int bits = range ? 8 : 40;
        double lo = ridge.end(shape, top, top.height - depth, -1, bits);
        double hi = ridge.end(shape, top, top.height - depth, 1, bits);
        lo = std::isnan(lo) ? top.at - kFarthest : lo;
        hi = std::isnan(hi) ? top.at + kFarthest : hi;
        const double width = (hi - lo) / n_means;
        for (int i = 0; i <= n_means; ++i) {
            const double log_mean = lo + width * i;
            const double weight =
                width * std::exp(likelihood(log_mean, shape) - peak.log_likelihood);
            if (weight > 1e-9 * width)
                add(weight, log_mean, width, shape);
        }
    }
    if (parts.empty()) // a peak too narrow for the grid
        add(1, peak.log_mean, 1e-9, peak.shape);
    for (LawPart& part : parts)
        part.weight /= sum;
    return parts;
}

NumberPosterior::NumberPosterior(std::vector<LawPart> parts, double n, double area)
    : parts_(std::move(parts)), shape_(n + 0.5), area_(area) {
    for (const LawPart& part : parts_)
        sum_ += part.weight;
}

double NumberPosterior::cdf(double n_v) const {
    double below = 0;
    for (const LawPart& part : parts_)
        below += part.weight * boost::math::gamma_p(shape_, n_v * area_ * part.exposure, Policy());
    return below / sum_;
}

double NumberPosterior::quantile(double share) const {
    double hi = shape_ / (area_ * parts_.front().exposure), lo = hi;
    while (cdf(hi) < share)
        hi *= 1.5;
    while (cdf(lo) > share)
        lo /= 1.5;
    return root([&](double n_v) { return share - cdf(n_v); }, lo, hi, share - cdf(lo),
                share - cdf(hi), 34);
}

double mean_quantile(std::span<const LawPart> parts, double share) {
    double sum = 0, lo = parts.front().log_mean, hi = lo;
    for (const LawPart& part : parts) {
        sum += part.weight;
        lo = std::min(lo, part.log_mean - part.width);
        hi = std::max(hi, part.log_mean + part.width);
    }
    const auto missing = [&](double log_mean) {
        double below = 0;
        for (const LawPart& p : parts)
            below += p.weight * std::clamp((log_mean - p.log_mean) / p.width + 0.5, 0.0, 1.0);
        return share - below / sum;
    };
    return std::exp(root(missing, lo, hi, missing(lo), missing(hi), 34));
}

} // namespace taihu
