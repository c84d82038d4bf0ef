#pragma once
#include <span>

#include "vdb_ops/dense_detail.h"

namespace taihu {

/// What is seen through a solid from the side. Views are parallel and horizontal, evenly turned
/// about the Y axis; a pixel is a sample. The outline is the solid's shadow with all that it
/// surrounds; what is open inside it are windows.
struct ViewMeasures {
    double open_share = 0;        ///< of the outline's area, mean of the views
    double share_with_window = 0; ///< of the views
    double windows_per_view = 0;  ///< mean number
    double widest_m = 0; ///< diameter of the thickest straight horizontal rod that passes a window
};

/// \param distances  signed_distances() of the solid, far outside along the sides of the lattice
/// \param least_m  windows of a smaller area than the disc of this diameter are not counted
ViewMeasures measure_views(const DenseLattice& lattice, std::span<const float> distances,
                           int n_views, double least_m, Progress* progress);

} // namespace taihu
