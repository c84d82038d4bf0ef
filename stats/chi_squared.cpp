#include "stats/chi_squared.h"

#include <algorithm>
#include <limits>
#include <string>

#include <boost/math/special_functions/gamma.hpp>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "stats/wicksell.h"

namespace taihu {
namespace {

constexpr double kLeastExpected = 5;

// Cells of equal expectation for a list of diameters.
void equal_cells(const Sample& sample, const SectionLaw& section, double limit,
                 ChiSquaredTest& test) {
    const std::size_t n = sample.diameters.size();
    const std::size_t n_cells = std::clamp<std::size_t>(n / 5, 1, 10);
    const double hidden = section.cdf(limit);
    test.edges = {limit};
    for (std::size_t i = 1; i < n_cells; ++i) {
        const double share = static_cast<double>(i) / static_cast<double>(n_cells);
        test.edges.push_back(section.quantile(hidden + share * (1 - hidden)));
    }
    test.edges.push_back(std::numeric_limits<double>::infinity());
    test.observed.assign(n_cells, 0);
    test.expected.assign(n_cells, static_cast<double>(n) / static_cast<double>(n_cells));
    for (const double d : sample.diameters) {
        const auto above = std::lower_bound(test.edges.begin() + 1, test.edges.end(), d);
        test.observed[static_cast<std::size_t>(above - test.edges.begin()) - 1] += 1;
    }
}

// The bins above the limit, joined upwards until each cell expects enough; what is left over at the
// end joins the last cell.
void pooled_cells(const Sample& sample, const SectionLaw& section, double limit,
                  ChiSquaredTest& test) {
    const double per_share = static_cast<double>(n_profiles(sample)) / section.survival(limit);
    double observed = 0, expected = 0;
    test.edges = {limit};
    for (const Bin& bin : sample.bins) {
        if (bin.hi <= limit)
            continue;
        observed += static_cast<double>(bin.count);
        expected +=
            per_share * (section.survival(std::max(bin.lo, limit)) - section.survival(bin.hi));
        if (expected < kLeastExpected)
            continue;
        test.edges.push_back(bin.hi);
        test.observed.push_back(observed);
        test.expected.push_back(expected);
        observed = expected = 0;
    }
    if (test.observed.empty())
        return;
    test.edges.back() = sample.bins.back().hi;
    test.observed.back() += observed;
    test.expected.back() += expected;
}

} // namespace

double chi_squared_critical(int df, double share) {
    if (df < 1 || !(share > 0 && share < 1))
        throw Error(Fault::bad_argument,
                    "chi-squared: " + std::to_string(df) + " degrees of freedom and a share of " +
                        shortest(share) + "; df >= 1 and 0 < share < 1 needed");
    return 2 * boost::math::gamma_q_inv(0.5 * df, share);
}

double chi_squared_survival(double x, int df) {
    if (df < 1 || !(x >= 0))
        throw Error(Fault::bad_argument, "chi-squared: " + shortest(x) + " with " +
                                             std::to_string(df) +
                                             " degrees of freedom; x >= 0 and df >= 1 needed");
    return boost::math::gamma_q(0.5 * df, 0.5 * x);
}

ChiSquaredTest chi_squared_test(const Sample& sample, const Law& law, int n_fitted) {
    const double limit = detection_limit(sample);
    const SectionLaw section(law);
    ChiSquaredTest test;
    if (sample.bins.empty())
        equal_cells(sample, section, limit, test);
    else
        pooled_cells(sample, section, limit, test);
    const auto n_cells = test.observed.size();
    test.df = static_cast<int>(n_cells) - 1 - n_fitted;
    if (test.df < 1)
        throw Error(Fault::bad_input, "chi-squared: " + std::to_string(n_profiles(sample)) +
                                          " profiles make " + std::to_string(n_cells) +
                                          " cells that expect 5 or more, which leaves no degree of "
                                          "freedom; mark more holes");
    for (std::size_t i = 0; i < n_cells; ++i) {
        const double miss = test.observed[i] - test.expected[i];
        test.statistic += miss * miss / test.expected[i];
    }
    test.p_value = chi_squared_survival(test.statistic, test.df);
    return test;
}

} // namespace taihu
