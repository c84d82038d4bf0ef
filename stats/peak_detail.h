#pragma once
#include <span>
#include <vector>

#include "stats/fit.h"
#include "stats/likelihood_detail.h"

// Where a likelihood is greatest and how far its top reaches. The mean is sought for each shape,
// then the shape: the sections of one shape are computed once, and one dimension has no ridge to
// get lost on.

namespace taihu {

/// Share of the sections that must be above the limit: profiles that all lie within a hundredth of
/// it suit laws of which nothing reaches it, whose number of holes has no end.
inline constexpr double kLeastSeen = 1e-9;

struct Peak {
    double log_mean = 0, shape = 0;
    double log_likelihood = 0;
    bool at_edge = false; ///< the shape is the first or the last one that is tried
};

/// \throws Error numeric: it rises without end towards smaller or greater means, or to a law of
/// whose
///         sections less than kLeastSeen would be seen.
Peak find_peak(Likelihood& likelihood);

struct Region {
    std::vector<Interval> intervals; ///< of the parameters, in the order of parameter_names()
    Interval mean_diameter;
    bool open = false; ///< an end is where the search ended
};

/// The extremes of each parameter, and of the mean, where the likelihood has not fallen to `floor`:
/// the ends of the profile likelihood's intervals.
/// \throws Error numeric: a family of one parameter whose likelihood does not fall to the floor.
Region likelihood_region(Likelihood& likelihood, const Peak& peak, double floor);

/// One of the laws that the likelihood allows, for averages over all of them.
struct LawPart {
    double weight =
        0; ///< likelihood, with a flat prior of log mean and shape; of one family, sum 1
    double log_mean = 0, width = 0; ///< stands for log means of this width
    double exposure = 0;            ///< profiles per area and hole per volume: mean * int f2 g
    double above = 1;               ///< share of its holes above the detection limit
};

/// About 60 parts of a family of one parameter, 350 of two; at least one.
std::vector<LawPart> law_parts(Likelihood& likelihood, const Peak& peak);

/// What N_V may be: Gamma(n + 1/2, area * exposure) laws, mixed by weights that need not sum to 1.
class NumberPosterior {
public:
    NumberPosterior(std::vector<LawPart> parts, double n, double area);
    /// N_V with this share of its probability below, to 1e-10.
    double quantile(double share) const;

private:
    double cdf(double n_v) const;

    std::vector<LawPart> parts_;
    double shape_, area_, sum_ = 0;
};

/// The mean diameter with this share of the parts' weight below.
double mean_quantile(std::span<const LawPart> parts, double share);

} // namespace taihu
