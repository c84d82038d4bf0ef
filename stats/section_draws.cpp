#include "stats/section_draws.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "stats/core/error.h"
#include "stats/core/portable_math.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

constexpr std::uint32_t kTries = 100'000;

Law make_law(Family family, double a, double b) {
    const double parameters[] = {a, b};
    return Law(family, parameters);
}

/// int_0^x D f3(D) dD / E[D] of the normal law cut at 0.
double truncated_normal_biased_cdf(const Law& law, double x) {
    const double mean = law.parameters()[0], sd = law.parameters()[1];
    // D f3 = mean f3 - sd^2 f3', by the derivative of the exponent.
    const double below = mean * law.cdf(x) - sd * sd * (law.pdf(x) - law.pdf(0));
    return std::clamp(below / law.mean(), 0.0, 1.0);
}

} // namespace

SectionDraws::SectionDraws(Law law, double limit) : law_(std::move(law)), limit_(limit) {
    if (!(limit >= 0 && std::isfinite(limit)))
        throw Error(Fault::bad_argument, "section draws: the detection limit is " +
                                             shortest(limit) + "; must be finite and >= 0");
    const auto p = law_.parameters();
    switch (law_.family()) {
    case Family::gamma:
        biased_ = {make_law(Family::gamma, p[0] + 1, p[1])};
        hidden_ = biased_[0].cdf(limit);
        break;
    case Family::weibull: // (D / scale)^shape is a gamma variable
        biased_ = {make_law(Family::gamma, 1 + 1 / p[0], 1)};
        hidden_ = biased_[0].cdf(std::pow(limit / p[1], p[0]));
        break;
    case Family::lognormal:
        biased_ = {make_law(Family::lognormal, p[0] + p[1] * p[1], p[1])};
        hidden_ = biased_[0].cdf(limit);
        break;
    case Family::truncated_normal:
        hidden_ = truncated_normal_biased_cdf(law_, limit);
        break;
    case Family::uniform:
        rise_ = {{p[0], 0}, {p[1], 1}};
        break;
    case Family::empirical:
        rise_.assign(law_.points().begin(), law_.points().end());
        break;
    case Family::exponential:
        break;
    case Family::constant:
        hidden_ = limit < p[0] ? 0 : 1;
        break;
    }
    // Knots become shares of the spheres met, those below the limit left out.
    double sum = 0;
    for (std::size_t i = 1; i < rise_.size(); ++i) {
        const double lo = std::max(rise_[i - 1].diameter, limit);
        const double hi = std::max(rise_[i].diameter, limit);
        const double density = (law_.cdf(rise_[i].diameter) - law_.cdf(rise_[i - 1].diameter)) /
                               (rise_[i].diameter - rise_[i - 1].diameter);
        sum += density * (hi - lo) * (hi + lo);
        rise_[i].cdf = sum;
    }
    if (!(hidden_ < 1) || (!rise_.empty() && !(sum > 0)))
        throw Error(Fault::numeric, "section draws: the law has no sphere above the detection "
                                    "limit, " +
                                        shortest(limit) + "; lower the limit");
    for (CdfPoint& point : rise_)
        point.cdf /= sum;
}

double SectionDraws::size_biased_quantile(double u) const {
    if (law_.family() == Family::weibull)
        return law_.parameters()[1] * std::pow(biased_[0].quantile(u), 1 / law_.parameters()[0]);
    if (!biased_.empty())
        return biased_[0].quantile(u);
    // The normal law cut at 0: bisection, to the last digits that the CDF has.
    double lo = 0, hi = law_.mean();
    while (truncated_normal_biased_cdf(law_, hi) < u && hi < 1e13)
        hi *= 2;
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (lo + hi);
        (truncated_normal_biased_cdf(law_, middle) < u ? lo : hi) = middle;
    }
    return hi;
}

double SectionDraws::sphere(double u, double w, double v) const {
    if (law_.family() == Family::constant)
        return law_.parameters()[0];
    if (law_.family() == Family::exponential) {
        // Above the limit the density is (limit + x) exp(-rate x): a mixture of one and of two
        // exponential variables.
        const double rate = law_.parameters()[0], share = rate * limit_ / (1 + rate * limit_);
        const double x = portable_log(u) + (v < share ? 0 : portable_log(w));
        return limit_ - x / rate;
    }
    if (rise_.empty()) // the last number below 1 keeps the quantile finite
        return std::max(limit_,
                        size_biased_quantile(std::min(hidden_ + u * (1 - hidden_), 1 - 0x1p-53)));
    const auto at = std::lower_bound(rise_.begin() + 1, rise_.end() - 1, u,
                                     [](const CdfPoint& p, double x) { return p.cdf < x; });
    const auto before = at - 1;
    const double lo = std::max(before->diameter, limit_), hi = std::max(at->diameter, limit_);
    const double rise = at->cdf - before->cdf;
    const double share = rise > 0 ? std::clamp((u - before->cdf) / rise, 0.0, 1.0) : 1;
    return std::sqrt(lo * lo + share * (hi * hi - lo * lo));
}

double SectionDraws::diameter(const Rng& rng, std::uint64_t item) const {
    for (std::uint32_t i = 0; i < kTries; ++i) {
        const std::uint32_t draw = 4 * i;
        const double large = sphere(rng.uniform(item, draw), rng.uniform(item, draw + 1),
                                    rng.uniform(item, draw + 2));
        const double ratio = limit_ / large;
        const double shown = std::sqrt((1 - ratio) * (1 + ratio));
        const double height = rng.uniform(item, draw + 3);
        // A constant law has one sphere to take; the others are taken by how much of them shows.
        // The same number serves twice: below `shown` it is uniform on 0..shown.
        if (law_.family() == Family::constant)
            return std::max(limit_, large * std::sqrt(1 - height * height * shown * shown));
        if (height < shown)
            return std::max(limit_, large * std::sqrt((1 - height) * (1 + height)));
    }
    throw Error(Fault::numeric,
                "section draws: no sphere of 10^5 shows above the detection limit, " +
                    shortest(limit_) + "; lower the limit");
}

} // namespace taihu
