#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "stats/core/image.h"
#include "stats/io/annotations_detail.h"
#include "stats/io/measurements.h"

namespace taihu {

/// Photos of all files with the holes on them, before windows.
struct PhotoPool {
    std::vector<Photo> photos;               ///< that have holes
    std::vector<std::optional<Image>> masks; ///< one a photo
    std::vector<Segment> segments;           ///< diameters in the unit of their file
    std::vector<LengthUnit> units;           ///< one a file
};

/// Joins the photos of files, decides which marks are holes, and scales them; the rules are those
/// of read_measurements.
PhotoPool pool_photos(std::span<const Annotations> files, const MeasurementSettings& settings,
                      std::vector<std::string>& warnings);

} // namespace taihu
