#pragma once
#include <vector>

#include "stats/fit.h"
#include "stats/likelihood_detail.h"

// Where a likelihood is greatest and how far its top reaches. The mean is sought for each shape,
// then the shape: the sections of one shape are computed once, and one dimension has no ridge to
// get lost on.

namespace taihu {

struct Peak {
    double log_mean = 0, shape = 0;
    double log_likelihood = 0;
    bool at_edge = false; ///< the shape is the first or the last one that is tried
};

/// \throws Error numeric: it rises without end towards smaller or greater means.
Peak find_peak(Likelihood& likelihood);

struct Region {
    std::vector<Interval> intervals; ///< of the parameters, in the order of parameter_names()
    bool open = false;               ///< an end is where the search ended
};

/// The extremes of each parameter where the likelihood has not fallen to `floor`: the ends of the
/// profile likelihood's intervals.
/// \throws Error numeric: a family of one parameter whose likelihood does not fall to the floor.
Region likelihood_region(Likelihood& likelihood, const Peak& peak, double floor);

/// A mixture of Gamma(n + 1/2, exposure) laws: what N_V may be, averaged over the likelihood of the
/// law with a flat prior of log mean and shape.
class NumberPosterior {
public:
    NumberPosterior(Likelihood& likelihood, const Peak& peak, double area);
    /// N_V with this share of its probability below, to 1e-10.
    double quantile(double share) const;

private:
    struct Part {
        double weight, exposure;
    };
    double cdf(double n_v) const;

    double shape_;
    std::vector<Part> parts_;
};

} // namespace taihu
