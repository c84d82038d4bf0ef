#pragma once
#include <cstdint>
#include <functional>
#include <span>

#include "stats/core/progress.h"
#include "stats/law.h"

namespace taihu {

/// How far profiles lie from the law of sections, four ways; all are 0 or more.
struct GoodnessStatistics {
    double anderson_darling = 0;   ///< A^2: the ends count as much as the middle
    double kolmogorov_smirnov = 0; ///< greatest distance of the two CDFs, 0..1
    double cramer_von_mises = 0;   ///< W^2: n times the mean squared distance
    double chi_squared = 0;        ///< over cells of equal probability, n / 5 of them, 2..10
};

/// Each of them for profiles above a detection limit, whose CDF is 1 - (1 - F2(d)) / (1 - F2(d0)).
/// \param diameters  > limit, at least one.
/// \throws Error bad_argument: no diameters, or one that is not finite and > limit.
GoodnessStatistics goodness_statistics(std::span<const double> diameters, double limit,
                                       const Law& law);

struct GoodnessTest {
    double statistic = 0;
    double critical = 0; ///< 95 % of the drawn samples lie at or below it
    double p_value = 1;  ///< share of samples as far off as this one, itself counted
};

/// Whether profiles may come from a law; Anderson-Darling is the one to go by.
struct Goodness {
    GoodnessTest anderson_darling, kolmogorov_smirnov, cramer_von_mises, chi_squared;
    std::uint64_t n_profiles = 0;  ///< that were tested
    std::uint64_t n_at_limit = 0;  ///< left out, see goodness()
    std::uint64_t n_resamples = 0; ///< drawn samples that could be fitted
    std::uint64_t n_failed = 0;    ///< those that could not
};

/// The law that is fitted to a sample of profiles; it throws Error where it cannot.
using Refit = std::function<Law(std::span<const double> diameters)>;

/// Tests of fit by parametric bootstrap: n_resamples samples are drawn from the sections of `law`,
/// fitted again and measured, so that the p-values know that the parameters were fitted (tables of
/// Kolmogorov's do not, and accept far too much). The chi-squared statistic needs no degrees of
/// freedom this way.
///
/// Profiles equal to the limit are left out: when the limit is the smallest one marked, the others
/// are, given it, independent draws above it. The first samples do not change with n_resamples.
///
/// \param limit  detection limit [unit], >= 0.
/// \param law    what `refit` made of `diameters`.
/// \param refit  nothing: the law was known beforehand.
/// \param n_resamples  19..1e6.
/// \throws Error bad_argument: as goodness_statistics, or n_resamples; bad_input: fewer than 8
///         profiles above the limit; numeric: more than a twentieth of the samples cannot be
///         fitted; cancelled: within one sample.
/// Source: Stute, Gonzalez Manteiga, Presedo Quindimil 1993, Metrika 40 (from memory, unchecked).
/// Cost: n_resamples refits; 1000 of 46 exponential profiles in 0.1 s with a Newton step.
Goodness goodness(std::span<const double> diameters, double limit, const Law& law,
                  const Refit& refit, std::uint64_t n_resamples = 1000, std::uint64_t seed = 0,
                  Progress* progress = nullptr);

} // namespace taihu
