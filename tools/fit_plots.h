#pragma once
#include <optional>
#include <string>

#include "stats/assess.h"
#include "stats/bootstrap.h"
#include "stats/core/progress.h"
#include "stats/fit.h"
#include "stats/io/measurements.h"

namespace taihu {

/// Lengths as a page shows them.
struct DisplayUnit {
    double factor = 1;        ///< times a length in the sample's unit
    std::string name;         ///< of the length shown: `cm`
    std::string square, cube; ///< of the sample's own unit: `m²`, `cubic metre`
};

/// Metres, centimetres or millimetres, by the greatest profile; px and greatest diameters stay.
DisplayUnit display_unit(const Sample& sample);

double smallest_profile(const Sample& sample); ///< [unit]
double greatest_profile(const Sample& sample); ///< [unit]

// Pictures of a fit as SVG, drawn by gnuplot. All throw as gnuplot_svg().

/// Histogram of the profiles and the density that the laws expect.
std::string plot_sections(const Sample& sample, const LawRanking& ranking, const DisplayUnit& unit,
                          const Progress* progress);
/// F3 of the holes with its band, and beside it what the photos say alone.
std::string plot_holes(const Fit& fit, const Band& band, const std::optional<Law>& photos,
                       const DisplayUnit& unit, const Progress* progress);
/// The holes of a photo where they lie, on what was searched.
std::string plot_places(const Measurements& measurements, const PhotoLocation& at,
                        const DisplayUnit& unit, const Progress* progress);

} // namespace taihu
