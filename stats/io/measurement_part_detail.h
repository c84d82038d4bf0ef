#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "stats/io/annotations_detail.h"
#include "stats/io/measurements.h"

namespace taihu {

/// What one file says of holes, before files are joined.
struct MeasurementPart {
    enum class Kind { plain, binned, segments, profiles };

    Kind kind = Kind::segments;
    std::string name;
    std::vector<double> diameters;
    std::vector<Bin> bins;
    std::optional<Annotations> annotations; ///< of segments
    std::optional<LengthUnit> unit;
    std::optional<double> area;
    std::optional<double> planes, volume; ///< of a table of sections
};

/// What the first bytes and the header say decides; names of files may lie. Adds to the sources and
/// warnings of `result`. \throws Error as read_measurements().
MeasurementPart read_measurement_part(const std::filesystem::path& path,
                                      const MeasurementSettings& settings, Measurements& result);

} // namespace taihu
