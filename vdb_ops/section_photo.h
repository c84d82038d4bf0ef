#pragma once
#include <cstddef>
#include <optional>
#include <vector>

#include <openvdb/openvdb.h>

#include "stats/core/image.h"
#include "stats/core/progress.h"
#include "stats/io/measurements.h"
#include "vdb_ops/section.h"

namespace taihu {

/// How a cut is photographed, from far away.
struct SectionPhotoSettings {
    /// Side of a pixel, > 0; or 1/800 of the solid's longest axis.
    std::optional<double> pixel_m = std::nullopt;
    /// The eye leaves the plane's normal towards +v by this angle, 0..80.
    double tilt_deg = 0;
    /// Nothing smaller is marked; at least 4 pixels and 2 voxels, which is also the default.
    std::optional<double> detection_limit_m = std::nullopt;
    /// Length of the bar beside the stone, at least 8 pixels; or 1, 2 or 5 times a power of ten, up
    /// to a quarter of the shortest side of the solid's box: the same for all its planes.
    std::optional<double> scale_bar_m = std::nullopt;
};

/// A picture of a plane of a solid, with its holes marked as a person would mark them.
struct SectionPhoto {
    Image picture; ///< 3 channels, linear light
    Image mask;    ///< 1 channel: 1 where the base, or else the filled outline of the solid, is
    std::vector<Segment> holes; ///< label `hole`, major axes, with minor_px; diameter [m]
    Segment scale_bar;          ///< label `scale`; its diameter is its length [m]
    double pixel_m = 0, detection_limit_m = 0; ///< as they were used
    double area_factor = 1;   ///< area of the plane / area of its picture, 1 / cos(tilt)
    double area_m2 = 0;       ///< of the plane, in the mask
    std::size_t n_small = 0;  ///< profiles below the detection limit, not marked
    std::size_t n_inside = 0; ///< of the list, wholly inside another one, not marked
    std::size_t n_solid = 0;  ///< of the list, but the solid has none there, not marked
};

/// Cut a solid by a plane and look at what lies behind the cut: pale stone with its grain, holes
/// with their depth, a flat background and a scale bar. Orthographic: u runs to the right, v
/// upwards, and a tilt shortens v by its cosine, so that a circle is seen as an ellipse whose major
/// axis keeps the diameter.
///
/// With the list of holes, marks are the exact circles whose centre lies in the mask, as far as
/// they are seen: not those inside another, nor where the solid is solid at their centre (because
/// cleaning filled them). Otherwise they are the face-connected void regions of the picture, by
/// their second moments; merged holes are one.
///
/// The same bits on any number of threads. Time O(pixels + samples inside of holes), memory up
/// to 40 bytes a pixel.
/// \param plane  of section().
/// \throws Error bad_argument: a setting out of range, a bar longer than the picture, more than
///         2^24 pixels, the solid or the base is no level set, or empty; numeric: no pixel of the
///         plane lies in the solid; cancelled: within a row of pixels.
SectionPhoto section_photo(const openvdb::FloatGrid& solid, const SectionKnown& known,
                           const SectionPlane& plane, const SectionPhotoSettings& settings = {},
                           Progress* progress = nullptr);

} // namespace taihu
