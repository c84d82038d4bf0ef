#pragma once
#include <cstdint>
#include <functional>

#include "stats/core/progress.h"
#include "stats/law.h"
#include "stats/sample.h"

namespace taihu {

/// How far profiles lie from the law of sections, four ways; all are 0 or more.
struct GoodnessStatistics {
    double anderson_darling = 0;   ///< A^2: the ends count as much as the middle
    double kolmogorov_smirnov = 0; ///< greatest distance of the two CDFs, 0..1
    double cramer_von_mises = 0;   ///< W^2: n times the mean squared distance
    double chi_squared = 0;        ///< over cells that expect 5 profiles or more
};

/// Each of them for the profiles that were marked, whose CDF knows of limits and edges
/// (detection.h). Chi-squared has n / 5 cells of equal probability, 2 to 10 of them; of a binned
/// sample the bins, joined upwards. The others of a binned sample compare the CDFs at the ends of
/// the bins, weighted by what the law expects between them.
/// \throws Error bad_input: as Detection; bad_argument: a diameter equal to the limit.
/// Source: for bins, Choulakian, Lockhart, Stephens 1994, Can. J. Stat. 22, 125 (from memory,
/// unchecked).
GoodnessStatistics goodness_statistics(const Sample& sample, const Law& law);

struct GoodnessTest {
    double statistic = 0;
    double critical = 0; ///< 95 % of the drawn samples lie at or below it
    double p_value = 1;  ///< share of samples as far off as this one, itself counted
};

/// Whether profiles may come from a law; Anderson-Darling is the one to go by, Cramer-von Mises
/// where a fitted law ends (constant, uniform).
struct Goodness {
    GoodnessTest anderson_darling, kolmogorov_smirnov, cramer_von_mises, chi_squared;
    std::uint64_t n_profiles = 0;  ///< that were tested
    std::uint64_t n_at_limit = 0;  ///< left out, see goodness()
    std::uint64_t n_resamples = 0; ///< drawn samples that could be fitted
    std::uint64_t n_failed = 0;    ///< those that could not
};

/// The law that is fitted to a sample of profiles; it throws Error where it cannot.
using Refit = std::function<Law(const Sample&)>;

struct GoodnessSettings {
    std::uint64_t n_resamples = 1000; ///< 19..1e6
    std::uint64_t seed = 0;
};

/// Tests of fit by parametric bootstrap: n_resamples samples are drawn from the sections of `law`,
/// fitted again and measured, so that the p-values know that the parameters were fitted (tables of
/// Kolmogorov's do not, and accept far too much). The chi-squared statistic needs no degrees of
/// freedom this way.
///
/// Diameters equal to the limit are left out: when the limit is the smallest one marked, the others
/// are, given it, independent draws above it. The first samples do not change with n_resamples.
///
/// \param law    what `refit` made of `sample`.
/// \param refit  nothing: the law was known beforehand.
/// \throws Error bad_argument: n_resamples; bad_input: as Detection, or fewer than 8 profiles above
///         the limit; numeric: more than a twentieth of the samples cannot be fitted; cancelled:
///         within one sample.
/// Source: Stute, Gonzalez Manteiga, Presedo Quindimil 1993, Metrika 40 (from memory, unchecked).
/// Cost: n_resamples refits; 1000 of 46 profiles take about 0.2 s for the exponential, 2 s for the
/// families of two parameters.
Goodness goodness(const Sample& sample, const Law& law, const Refit& refit,
                  const GoodnessSettings& settings = {}, Progress* progress = nullptr);

} // namespace taihu
