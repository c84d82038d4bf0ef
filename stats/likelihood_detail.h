#pragma once
#include <array>
#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "stats/detection.h"
#include "stats/law.h"
#include "stats/sample.h"
#include "stats/wicksell.h"

// Laws as the search for the likeliest one sees them: the logarithm of the mean diameter, and for
// families of two parameters a shape, which no change of the unit touches.
//
//   gamma, weibull     shape = log(shape parameter)
//   lognormal          shape = log(sd_log)
//   truncated_normal   shape = asinh(mean / sd)
//   uniform            shape = lo / hi

namespace taihu {

struct ShapeRange {
    double lo, hi;
    bool lo_is_natural = false; ///< the family itself ends there: uniform from 0
};

/// What is searched: from nearly a constant law to far beyond any sample. Nothing for a family of
/// one parameter.
std::optional<ShapeRange> shape_range(Family family);

/// Parameters of the law, in the order of parameter_names().
std::array<double, 2> parameters_at(Family family, double log_mean, double shape);
Law law_at(Family family, double log_mean, double shape);

/// log(f2) and log(1 - F2) of the law of mean 1 and one shape, as functions of log d.
///
/// Closed forms where SectionLaw has them. Else nodes are computed once by its quadrature, f2 and
/// 1 - F2 in one pass, and polynomials of degree 5 run through them: error 1e-7 near the middle of
/// the law, below 3e-5 down to logarithms of -20. A likelihood asks some thousand times per shape.
class UnitSection {
public:
    UnitSection(Family family, double shape);
    const Law& law() const { return section_.law(); }
    /// Computes what is missing for log d in lo..hi, which must be done before they are asked for.
    void cover(double lo, double hi);
    double log_pdf(double log_d) const;
    double log_survival(double log_d) const;

private:
    struct Node {
        double log_pdf = 0, log_survival = 0;
    };
    Node node(double log_d);
    template <class LogDensity>
    Node integrate(double log_d, LogDensity log_density);

    SectionLaw section_;
    bool closed_;
    double spacing_ = 0;       ///< of the nodes, in log d
    std::ptrdiff_t first_ = 0; ///< node i of the table stands at (first_ + i) spacing_
    std::vector<Node> nodes_;
    double step_ = 0; ///< of the quadrature, in t
    double lowest_ = 0, mode_ = 0, beyond_ = 0;
    double log_norm_ = 0;
    std::vector<double> log_cosh_, cosh_; ///< at multiples of step_
};

/// What a gamma or Weibull law pays for a shape k below 1, where its density is infinite at 0: log
/// k. The profiles say next to nothing about such a law's small holes, whose number runs away; a
/// likelihood that is flat there ends at 1 instead, the exponential law. Other laws pay nothing.
double log_prior(Family family, double shape);

/// The log-likelihood of a sample as a function of the law, for one family.
///
/// A diameter counts with the density f2 g / int f2 g, or with its mean over the resolution; a bin
/// with its probability; log_prior is added. A law of whose sections less than 1e-12 are seen is
/// kImpossible or less. Not thread-safe: it remembers the sections of the last shape.
class Likelihood {
public:
    /// Lower than any likelihood, but a number: methods that draw parabolas need one.
    static constexpr double kImpossible = -1e12;

    /// \param detection  of the same sample; kept by reference.
    /// \param resolution  diameters are rounded to multiples of it; nothing: they are exact.
    Likelihood(const Sample& sample, const Detection& detection, Family family,
               std::optional<double> resolution);

    double operator()(double log_mean, double shape);
    /// int f2 g: the share of sections that are marked.
    double seen(double log_mean, double shape);
    /// 1 - F3 of the detection limit: the share of holes that are above it; never 0.
    double above(double log_mean, double shape);

    Family family() const { return family_; }
    double n() const { return n_; }
    double mean_profile() const { return mean_profile_; }
    double greatest_profile() const { return greatest_; }

private:
    struct Point {
        double log_d, count;
    };
    struct Cell {
        double lo, hi, log_lo, log_mid, log_hi;
        double count, log_share;
        double log_width; ///< of the resolution; 0 for bins
        bool flat;        ///< g is one number in it
    };
    void add_cell(double lo, double hi, double count, bool is_bin);
    double log_cell(const Cell& cell, double log_mean) const;
    std::function<double(double)> survival(double log_mean) const;
    double log_seen(double log_mean) const;
    void prepare(double log_mean, double shape);

    const Detection* detection_;
    Family family_;
    std::vector<Point> points_;
    std::vector<Cell> cells_;
    double n_ = 0, constant_ = 0, mean_profile_ = 0, greatest_ = 0;
    double log_least_ = 0, log_most_ = 0; ///< of what is asked of the sections
    double shape_ = std::numeric_limits<double>::quiet_NaN();
    std::optional<UnitSection> section_;
};

} // namespace taihu
