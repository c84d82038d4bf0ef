#include "stats/expect.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <boost/math/special_functions/beta.hpp>
#include <boost/math/special_functions/gamma.hpp>

#include "stats/core/error.h"
#include "stats/detection.h"
#include "stats/number_detail.h"
#include "stats/wicksell.h"

namespace taihu {
namespace {

constexpr double kSignificance = 0.05; // of all tests together

// A number of profiles against a Poisson law, or a negative binomial whose variance is
// mean + excess mean^2. P(N <= n) = Q(n + 1, mean), I(1 / excess, n + 1; 1 / (1 + excess mean)).
double two_sided(std::uint64_t found, double mean, double excess) {
    const auto n = static_cast<double>(found);
    double at_most = 0, at_least = 1;
    if (excess > 0) {
        const double r = 1 / excess, p = r / (r + mean);
        at_most = boost::math::ibeta(r, n + 1, p);
        at_least = found == 0 ? 1 : boost::math::ibetac(r, n, p);
    } else {
        at_most = boost::math::gamma_q(n + 1, mean);
        at_least = found == 0 ? 1 : boost::math::gamma_p(n, mean);
    }
    return std::min(1.0, 2 * std::min(at_most, at_least));
}

Expectation::Number judge_number(std::uint64_t found, double expected, const Law& law, double n_v,
                                 const std::optional<SharedHoles>& shared) {
    Expectation::Number number{found, expected, 1, 0};
    double excess = 0;
    if (shared && shared->n_planes > 1) {
        const double mean = law.mean(), n_holes = n_v * shared->volume;
        excess = (1 - 1 / static_cast<double>(shared->n_planes)) * law.moment(2) /
                 (mean * mean * n_holes);
        number.shared = excess * expected;
    }
    number.p_value = two_sided(found, expected, excess);
    return number;
}

} // namespace

Expectation expect_law(const Sample& sample, const Law& law, std::optional<double> n_v,
                       const std::optional<SharedHoles>& shared, const GoodnessSettings& settings,
                       Progress* progress) {
    if (n_v && !(*n_v > 0 && std::isfinite(*n_v)))
        throw Error(Fault::bad_argument,
                    "expect: n_v is " + shortest(*n_v) + "; must be finite and > 0");
    Expectation e;
    e.sizes = goodness(sample, law, {}, settings, progress);
    const double p_sizes = e.sizes.anderson_darling.p_value;
    if (const auto area = searched_area(sample); n_v && area) {
        const SectionLaw section(law);
        const Detection detection(sample);
        const double seen =
            detection.seen([&](double d) { return section.survival(d); }, detection.limit(),
                           std::numeric_limits<double>::infinity());
        e.number =
            judge_number(n_profiles(sample), *n_v * law.mean() * *area * seen, law, *n_v, shared);
        e.obeys = std::min(p_sizes, e.number->p_value) > kSignificance / 2;
    } else {
        e.obeys = p_sizes > kSignificance;
    }
    return e;
}

} // namespace taihu
