#include "stats/expect.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <boost/math/special_functions/gamma.hpp>

#include "stats/core/error.h"
#include "stats/detection.h"
#include "stats/number_detail.h"
#include "stats/wicksell.h"

namespace taihu {
namespace {

constexpr double kSignificance = 0.05; // of all tests together

// A number of profiles against a Poisson law. P(N <= n) = Q(n + 1, mean).
Expectation::Number judge_number(std::uint64_t found, double expected) {
    const auto n = static_cast<double>(found);
    const double at_most = boost::math::gamma_q(n + 1, expected);
    const double at_least = found == 0 ? 1 : boost::math::gamma_p(n, expected);
    return {found, expected, std::min(1.0, 2 * std::min(at_most, at_least))};
}

} // namespace

Expectation expect_law(const Sample& sample, const Law& law, std::optional<double> n_v,
                       const GoodnessSettings& settings, Progress* progress) {
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
        e.number = judge_number(n_profiles(sample), *n_v * law.mean() * *area * seen);
        e.obeys = std::min(p_sizes, e.number->p_value) > kSignificance / 2;
    } else {
        e.obeys = p_sizes > kSignificance;
    }
    return e;
}

} // namespace taihu
