#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "stats/law.h"
#include "stats/sample.h"

namespace taihu {

/// The inversion of the thesis on ornamental garden rocks, chapter 4, with its own conventions, for
/// comparison: it is biased and does not converge (fit.h is what to use).
struct ThesisInversion {
    double n = 0;                ///< profiles
    double bin_width = 0;        ///< [unit]
    std::size_t first_bin = 0;   ///< the first filled bin; those before are not tested
    std::vector<double> centers; ///< D, one for each bin, as all rows below [unit]
    std::vector<double> counts;  ///< F2' N dD
    std::vector<double> f2;      ///< share of profiles in this bin and below
    std::vector<double> f3;      ///< share of spheres, as inverted: negative values 0, not monotone
    std::vector<double> density; ///< F3' N dD: rises of f3, falls set to 0; sums to more than n
};

/// One line of the thesis' chi-squared table.
struct ThesisTest {
    std::string_view law;
    double chi_squared = 0;
    int df = 0;                ///< bins used - 1 - 2: two parameters are counted for every law
    double critical = 0;       ///< at 5 %
    bool rejected = false;     ///< chi_squared >= critical
    double least_expected = 0; ///< the smallest expected number of holes in a bin
};

/// F3(D_k) = 1 - sum_{i > k} n_i / sqrt(c_i^2 - D_k^2) / sum_i n_i / c_i: the integrals over h
/// become sums over bin centres, and the bin of D itself, where the integrand is infinite, is left
/// out. \param bins  contiguous, from 0, of one width (to 1e-9), the last one filled; at least 3.
/// \throws Error bad_input otherwise, or as check_sample does.
/// Source: the thesis, section 4.6 and Table 4.1; the conventions are those that reproduce the
/// table.
ThesisInversion thesis_inversion(std::span<const Bin> bins);

/// The density row against uniform, normal, Poisson and exponential laws, in this order.
/// \throws Error bad_input: fewer than 4 bins to test, which leaves no degree of freedom.
/// Source: the thesis, section 4.4 and Table 4.2. Of the normal law's value only the verdict is
/// that of the thesis; its 115.276 follows from no moments of the data.
std::vector<ThesisTest> thesis_tests(const ThesisInversion& inversion);

/// F3 as a law to draw diameters from: straight lines through (D, F3), made monotone first.
Law empirical_law(const ThesisInversion& inversion);

/// Both tables as text, and in plain words where they cannot be trusted or reproduced.
std::string format_thesis_tables(const ThesisInversion& inversion,
                                 std::span<const ThesisTest> tests);

} // namespace taihu
