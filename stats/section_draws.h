#pragma once
#include <cstdint>
#include <vector>

#include "stats/core/rng.h"
#include "stats/law.h"

namespace taihu {

/// Profiles drawn at random: what a plane cuts out of spheres of a law, above a detection limit.
///
/// A plane meets a sphere with a chance that grows with its diameter D, at a height h uniform in
/// 0..1 radii: d = D sqrt(1 - h^2). D is drawn above the limit and accepted by the share
/// sqrt(1 - (limit / D)^2) of its heights that show it, so that no profile is thrown away.
/// Addressed by number, as Rng is; the same bytes on every machine for the exponential, uniform,
/// constant and empirical laws. Immutable; may be shared by threads.
class SectionDraws {
public:
    /// \param limit  [unit of the law], >= 0.
    /// \throws Error bad_argument: the limit; numeric: the law has nothing above it.
    SectionDraws(Law law, double limit);

    /// Diameter of profile number `item`, >= limit.
    /// \param item  of `rng`, whose draws 0, 1, 2, ... are used.
    /// \throws Error numeric: none of 10^5 spheres shows above the limit.
    double diameter(const Rng& rng, std::uint64_t item) const;

private:
    /// A sphere met by the plane, at least as large as the limit, from two uniform numbers.
    double sphere(double u, double w, double v) const;
    double size_biased_quantile(double u) const;

    Law law_;
    double limit_;
    std::vector<Law> biased_;    ///< size-biased law (of D^shape for Weibull's), where it is a Law
    std::vector<CdfPoint> rise_; ///< its CDF at the knots of a uniform or empirical law
    double hidden_ = 0;          ///< share of the spheres met that are below the limit
};

} // namespace taihu
