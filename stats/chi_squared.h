#pragma once
#include <vector>

#include "stats/law.h"
#include "stats/sample.h"

namespace taihu {

/// The x that a chi-squared variable passes with probability `share`: 9.4877 for 4 and 0.05.
/// \throws Error bad_argument: df < 1, or a share outside of 0..1.
double chi_squared_critical(int df, double share);

/// The probability that a chi-squared variable with `df` degrees of freedom passes `x` >= 0.
double chi_squared_survival(double x, int df);

struct ChiSquaredTest {
    double statistic = 0;      ///< sum (observed - expected)^2 / expected
    int df = 0;                ///< cells - 1 - fitted parameters
    double p_value = 1;        ///< approximate: the parameters were not fitted to these cells
    std::vector<double> edges; ///< cells are (edges[i], edges[i + 1]]; the last may be infinite
    std::vector<double> observed, expected; ///< profiles in each cell
};

/// Pearson's test of the profiles themselves against the sections of `law` above the detection
/// limit.
///
/// Binned profiles keep their bins from the detection limit to the end of the last one, what the
/// law expects past it being no cell; bins are joined upwards until each cell expects 5 or more,
/// and the rest joins the last. Diameters are counted in cells of equal expectation, n / 5 of them
/// but at most 10, the last one open.
///
/// \param n_fitted  how many parameters of the law were fitted to this sample.
/// \throws Error bad_input: too few profiles for one degree of freedom; as check_sample.
ChiSquaredTest chi_squared_test(const Sample& sample, const Law& law, int n_fitted);

} // namespace taihu
