#pragma once
#include <optional>

#include "stats/law.h"

namespace taihu {

/// What is to be expected of a rock whose holes are balls thrown without regard to each other
/// (centres of a Poisson process, diameters by a law), far from its outer surface.
struct BooleanModel {
    double porosity = 0; ///< volume of the holes' union / volume
    double s_v = 0;      ///< surface of the holes / volume [1 / unit]
    double m_v = 0;      ///< integral of mean curvature / volume, seen from the holes [1 / unit^2]
    double chi_v = 0;    ///< Euler characteristic of the union / volume [1 / unit^3]
    double a_a = 0;      ///< a plane section: area of holes / area, equal to the porosity
    double l_a = 0;      ///< length of their outlines / area [1 / unit]
    double chi_a = 0;    ///< Euler characteristic of the holes / area [1 / unit^2]
    double n_a = 0;      ///< circles met / area, each counted, also those hidden in others
    double n_a_seen = 0; ///< lower bound of what an eye counts: profiles whose lowest point shows
};

/// \param n_v  hole centres per volume [1 / unit^3], >= 0.
/// \throws Error bad_argument: n_v.
/// Source: Miles 1976, Mecke & Wagner 1991, Chiu-Stoyan-Kendall-Mecke 2013 (from memory); every
/// coefficient checked by simulation.
BooleanModel boolean_model(const Law& law, double n_v);

/// Covariance of the holes: the chance that two points at a distance r both lie in holes,
/// 2 porosity - 1 + exp(-n_v E|K u (K + r)|) with K a ball of the law; porosity at 0, porosity^2
/// far away. Error below 1e-8; beyond 1000 (E[D^3])^(1/3) no ball is taken to hold both. \param n_v
/// as in boolean_model(); \param r  [unit], >= 0. \throws Error bad_argument. Source: the union's
/// capacity functional (textbook, from memory) and the lens of two balls averaged by parts: own
/// derivation, checked by quadrature and by simulation.
double boolean_covariance(const Law& law, double n_v, double r);

/// Circles per area from those whose lowest point shows: the others' lie in a hole.
/// \param n_a_seen  [1 / unit^2], >= 0; \param a_a  share of the area that is hole, 0..1, not 1.
/// \throws Error bad_argument.
double overlap_corrected_n_a(double n_a_seen, double a_a);

/// Hole centres per volume, when only the profiles whose lowest point shows were marked: the n with
/// n exp(-n v) = n_v_seen, v the mean volume of a ball. Nothing when there is none: no density
/// shows so many. \param n_v_seen  as if no profile were hidden in others [1 / unit^3], >= 0.
/// \throws Error bad_argument.
std::optional<double> overlap_corrected_n_v(const Law& law, double n_v_seen);

/// The porosity at which chi_v of the union falls to 0: more tunnels than holes from there on, the
/// rock is a sponge. 31 % for equal balls, whatever their size. Nothing for laws so broad that it
/// never happens: small holes, that stay alone, outweigh all tunnels.
std::optional<double> sponge_porosity(const Law& law);

} // namespace taihu
