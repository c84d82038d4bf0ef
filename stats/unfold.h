#pragma once
#include <vector>

#include "stats/law.h"
#include "stats/sample.h"

// The law of spheres from their sections with no family assumed: as a check on a fit, or where no
// family fits. All begin at the detection limit and speak of spheres above it alone, whose sections
// tell their number without a guess; edges and limits of frames count by 1 / g (detection.h).

namespace taihu {

/// Spheres in classes of diameter.
struct Unfolding {
    std::vector<double> edges; ///< of the classes, rising from the limit [unit]
    /// Spheres of each class [profiles per unit of length]; divided by the searched area, N_V.
    std::vector<double> spheres;
    int n_clipped = 0; ///< classes whose count came out negative and was set to 0

    /// F3 of the spheres above the limit: straight lines between the edges.
    /// \throws Error numeric: no class holds a sphere.
    Law law() const;
};

/// Classes of one width from the detection limit to the greatest profile.
struct ClassSettings {
    int n_classes = 12; ///< 2..1000; binned samples keep their own bins
};

/// Back-substitution from the greatest class down: the spheres of a class, all taken to be as large
/// as its upper edge, and what the greater ones leave of its profiles. A negative count is set to 0
/// before the next class.
/// \throws Error bad_argument: settings; bad_input: as Detection, or all profiles at the limit.
/// Source: Schwartz 1934, Saltykov 1958 (from memory, unchecked).
Unfolding schwartz_saltykov(const Sample& sample, const ClassSettings& settings = {});

struct EmSettings {
    int n_classes = 12;    ///< as ClassSettings
    int n_iterations = 64; ///< 1..10000
    /// Each pass ends by giving this share of a class to both of its neighbours, 0..1/3; 0 for EM,
    /// more for EMS.
    double smoothing = 0;
};

/// Expectation maximisation of the Poisson likelihood of the same classes: never negative.
/// \throws Error as schwartz_saltykov.
/// Source: Silverman, Jones, Wilson, Nychka 1990, J. R. Statist. Soc. B 52, 271 (from memory,
/// unchecked).
Unfolding unfold_em(const Sample& sample, const EmSettings& settings = {});

/// F3 above the limit by isotonic regression: the least concave majorant of the integral of the
/// plug-in inverse over squared diameters. No classes, no settings; time O(n^2).
/// \throws Error bad_input: as Detection, a sample in bins, all profiles equal, more than 20000.
/// Source: Groeneboom and Jongbloed 1995, Ann. Statist. 23, 1518 (from memory, unchecked).
Law unfold_isotonic(const Sample& sample);

} // namespace taihu
