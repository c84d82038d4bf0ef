#pragma once
#include <span>

#include "vdb_ops/dense_detail.h"

namespace taihu {

/// A surface beside the same surface smoothed: the zero set of its signed distance averaged with a
/// Gauss kernel.
struct WrinkleMeasures {
    double area_ratio = 1;     ///< area / smoothed area
    double rms_samples = 0;    ///< distance of the surface from the smoothed one, by area
    double mean_curvature = 0; ///< mean |H| of the smoothed surface [1 / samples]
    double concave_share = 0;  ///< of the smoothed surface's area: H below -`least`
};

/// \param distances  signed_distances() of the solid, with 3 sd more of air round it; \param sd  of
/// the kernel [samples], > 0; \param least_curvature  flatter than this is neither [1 / samples]
/// Nothing left of the smoothed solid: all 0 but the area ratio, which is 1.
WrinkleMeasures measure_wrinkles(const DenseLattice& lattice, std::span<const float> distances,
                                 double sd, double least_curvature, const Progress* progress);

} // namespace taihu
