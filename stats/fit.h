#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "stats/law.h"
#include "stats/sample.h"

namespace taihu {

struct Interval {
    double lo = 0, hi = 0;
    friend constexpr bool operator==(const Interval&, const Interval&) = default;
};

/// How many hole centres a unit volume holds.
struct NumberDensity {
    double estimate = 0, lo = 0, hi = 0; ///< [1 / unit^3]
    /// Share of these holes whose diameter is below the detection limit: no profile stands for
    /// them, their number is what the family of the law makes of the seen ones.
    double extrapolated_share = 0;
    friend constexpr bool operator==(const NumberDensity&, const NumberDensity&) = default;
};

struct FitSettings {
    double level = 0.95; ///< of all intervals, 0.5..0.9999
};

struct Fit {
    Law law;                          ///< of sphere diameters [unit]
    std::vector<Interval> intervals;  ///< one for each parameter of the law: profile likelihood
    double level = 0.95;              ///< of the intervals
    double log_likelihood = 0;        ///< natural logarithm; of counts when the sample is binned
    double aicc = 0;                  ///< Akaike's criterion, corrected for the sample size
    std::optional<NumberDensity> n_v; ///< nothing when the area is unknown
    double detection_limit = 0;       ///< [unit]
    std::uint64_t n_profiles = 0;
    std::vector<std::string> notes; ///< what a reader of the numbers has to know, whole sentences
};

/// Maximum likelihood of exponential sphere diameters, from the sections that were marked.
///
/// A profile d >= d0 has the density f2(d) / (1 - F2(d0)); a bin has F2(hi) - F2(lo) in place of
/// f2. The interval holds every rate whose likelihood is not rejected by a chi-squared test with
/// one degree of freedom. N_V = n / (A mu (1 - F2(d0))); its interval is that of N_V ~ Gamma(n +
/// 1/2, A mu (1 - F2(d0))), averaged over the likelihood of the rate with a flat prior of its
/// logarithm, by numeric integration: no random numbers.
///
/// \throws Error bad_argument: the level; bad_input: as check_sample, fewer than 8 profiles, or all
///         of them at the detection limit (no spread to fit).
/// Cost: about 300 passes over the sample. Fewer than 20 profiles are noted.
Fit fit_exponential(const Sample& sample, const FitSettings& settings = {});

} // namespace taihu
