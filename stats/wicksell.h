#pragma once
#include <vector>

#include "stats/law.h"

namespace taihu {

/// The law of the circles that a plane cuts out of spheres whose diameters follow a Law.
///
/// f2(d) = (d / mu) int_d^inf f3(D) / sqrt(D^2 - d^2) dD, with mu the mean sphere diameter. The
/// plane meets N_A = N_V mu circles per area when the space holds N_V centres per volume.
///
/// Exponential (Bessel K0, K1), uniform, constant and empirical laws in closed form. The others by
/// the trapezoid rule in t with D = d cosh t, where the integrand is even and the rule converges
/// exponentially: relative error about 1e-12, some hundred evaluations of f3 for each value.
/// Immutable; may be shared by threads.
///
/// Source: Wicksell 1925, Biometrika 17, 84 (from memory, unchecked); closed forms and the
/// quadrature: own derivation, checked against each other in the tests.
class SectionLaw {
public:
    explicit SectionLaw(Law law);

    const Law& law() const { return law_; }

    /// Density f2(d) of circle diameters; 0 at d <= 0. At the one diameter of a constant law, where
    /// it is infinite, infinity.
    double pdf(double diameter) const;
    /// 1 - F2(d): the share of circles greater than d; 1 at d <= 0.
    double survival(double diameter) const;
    double cdf(double diameter) const { return 1 - survival(diameter); }
    /// The d with F2(d) = u, 0 < u < 1, by bracketing and bisection of F2; about 60 evaluations.
    /// \throws Error bad_argument for another u.
    double quantile(double u) const;

    /// log(f2(d)) and log(1 - F2(d)), also where the value itself would underflow to 0 for an
    /// exponential law.
    double log_pdf(double diameter) const;
    double log_survival(double diameter) const;

private:
    double integral(double diameter, bool weighted) const;

    Law law_;
    double mean_ = 0;
    double step_ = 0;              ///< of the trapezoid rule, in t
    double lowest_ = 0;            ///< below it f3 adds nothing
    double beyond_ = 0;            ///< past it a vanishing term ends the sum
    std::vector<CdfPoint> points_; ///< the straight pieces of F3, for uniform and empirical laws
};

} // namespace taihu
