#pragma once
#include "stats/core/image.h"
#include "stats/core/progress.h"
#include "vdb_ops/plane_image_detail.h"

namespace taihu {

/// A cut and who looks at it.
struct PhotoScene {
    const openvdb::FloatGrid& rock;
    const SectionPlane& plane;
    const PlaneImage& image; ///< square pixels to the eye; rows run downwards
    Vec3 view;               ///< from the eye into the rock, of length 1
    double reach_m = 0;      ///< no line of sight through the rock is longer
};

/// The pixels x0.. and y0.. of a scene's image; there is background where it has none.
struct PhotoFrame {
    int x0 = 0, y0 = 0, width = 0, height = 0;
};

/// \throws Error cancelled.
Image paint_cut(const PhotoScene& scene, const PhotoFrame& frame, const Progress* progress);

/// A bar of dark and bright quarters with a dark edge, its ends where x and x + length say [px].
void paint_bar(Image& picture, int x, int y, double length, int height);

} // namespace taihu
