#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "stats/core/progress.h"
#include "stats/density.h"
#include "stats/fit.h"
#include "stats/goodness.h"
#include "stats/io/measurements.h"
#include "stats/location.h"

namespace taihu {

/// A solid that holes are to be counted for.
struct SolidSize {
    double volume = 0; ///< [unit^3], > 0
    double area = 0;   ///< of its surface [unit^2]; 0: not known
};

struct AssessSettings {
    std::uint64_t n_resamples = 999; ///< of the tests, 19..1e5
    std::uint64_t seed = 0;
    std::optional<double> resolution = {}; ///< that of the fit
    std::optional<SolidSize> solid = {};
};

/// Where the profiles of a photo lie.
struct PhotoLocation {
    std::size_t photo = 0;             ///< index into Measurements::photos
    std::vector<PlanePoint> points;    ///< their centres, those inside the window [unit]
    std::optional<QuadratTest> cells;  ///< 3 x 2 of them, or 2 x 1 for few points
    std::optional<NeighbourTest> near; ///< with fewer than 10 points neither is made
};

/// What has to be known beside a fit before it is believed.
struct Assessment {
    std::optional<Goodness> goodness;     ///< nothing: too few profiles above the detection limit
    std::vector<PhotoLocation> locations; ///< of photos whose window is known
    /// N_V if every profile hidden in others was left out by the eye; the fit itself takes them all
    /// to be marked. Nothing: unknown area, or more profiles than such holes could show.
    std::optional<double> n_v_overlap;
    std::optional<double> porosity;     ///< of holes of this law and N_V; nothing: unknown area
    std::optional<NumberDensity> holes; ///< with centres inside the solid; needs it and N_V
    std::optional<double> holes_biting; ///< more, centred outside, that reach into it; about
    /// Radius of a ball as large as the solid / mean diameter: below 5 its surface is too curved
    /// for flat sections, N_V and the rate come out too high (2 % at 5, 12 % at 2).
    std::optional<double> curvature;
    std::vector<std::string> findings; ///< what it all means, whole sentences for anybody
    std::vector<std::string> advice;   ///< what to do better next time, whole sentences
};

/// \param fit  made of measurements.sample.
/// \throws Error as goodness() but for too few profiles; bad_argument: the solid.
/// Cost: n_resamples refits and n_resamples random sets of points.
Assessment assess(const Fit& fit, const Measurements& measurements,
                  const AssessSettings& settings = {}, Progress* progress = nullptr);

} // namespace taihu
