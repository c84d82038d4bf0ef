#pragma once
#include <cstddef>

#include "vdb_ops/mesh_repair.h"

namespace taihu {

/// What the winding number says of a mesh, at 27^3 places of its box and on up to 4096 faces.
struct WindingSurvey {
    std::size_t n_inside = 0;    ///< |w| > 1/2
    std::size_t n_undecided = 0; ///< farther than 1/4 from a whole number
    double mean = 0;             ///< below 0: faces point inwards
    /// Share of the faces' area that has a whole number on either side, one more within: w on a
    /// face, the mean of both sides, is then 1/2, 3/2 and so on, here within 0.3, and has the sign
    /// that prevails: in its shell, where that has a sixteenth of the area, or else in all.
    double parting = 0;
};
WindingSurvey survey_winding(const RepairedMesh& mesh);

} // namespace taihu
