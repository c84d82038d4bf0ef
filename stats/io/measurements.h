#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "stats/sample.h"

namespace taihu {

/// What a file may leave open, and the caller then says.
struct MeasurementSettings {
    std::optional<LengthUnit> unit;    ///< of the lengths; a file that names another is refused
    std::optional<double> unit_per_px; ///< of segments that have none of their own [unit / px], > 0
    std::optional<double> area;        ///< searched in all files together [unit^2], > 0
    std::optional<double> detection_limit; ///< nothing smaller was marked [unit], >= 0
};

/// A line drawn over a hole of a picture, from rim to rim along its major axis.
struct Segment {
    std::string image, label;
    double x1 = 0, y1 = 0, x2 = 0, y2 = 0; ///< ends [px], y downwards
    double diameter = 0;                   ///< length times unit_per_px [unit]
    std::optional<double> minor_px;        ///< minor axis of the same hole, when it was measured
    std::size_t line = 0;                  ///< in its file
};

/// A file that numbers came from.
struct SourceFile {
    std::string name;   ///< without folders
    std::string sha256; ///< of its bytes, 64 hexadecimal digits
    friend bool operator==(const SourceFile&, const SourceFile&) = default;
};

struct Measurements {
    Sample sample;                 ///< passes check_sample
    std::vector<Segment> segments; ///< when segments were read; in the order of the files
    std::vector<SourceFile> sources;
    std::vector<std::string> warnings; ///< `file:line: what`, worth showing to people
};

/// Hole profiles from CSV files. The header line tells the kind, not the file's name:
/// - `diameter`: one profile a line.
/// - `diameter_lo,diameter_hi,count`: counts in bins that touch; empty bins have the count 0.
/// - `image,label,x1,y1,x2,y2,unit_per_px` and perhaps `minor`: segments in pixels; the diameter is
///   length * unit_per_px. An empty unit_per_px means: not known.
/// - `plane,u_m,v_m,diameter_m` with `# area_m2=`: what `taihu section` writes, in metres.
///
/// Columns may stand in any order. Several files are one sample: diameters are joined, areas add
/// up, counts add up when the bins are the same; binned and other files do not mix.
///
/// Unit: `# unit=m`, `px` or `greatest` in the file, or the setting. Without one, segments with no
/// unit_per_px other than 1 are in px; scaled segments and the other kinds must have one.
/// "greatest" means the greatest diameter is 1: segments are divided by their greatest, the others
/// must be so. Area: `# area=` in unit^2, in every file or in none; the setting overrides. It is
/// refused with segments whose unit is "greatest". Where every segment has its minor axis, the
/// searched surface was seen at a slant: the area is divided by the mean of minor / major, which is
/// what a picture shortens it by (a circle's image is an ellipse whose major axis keeps the
/// diameter).
///
/// Two segments with the same ends on the same image make a warning, as does a comment key that
/// looks like a slip of `unit` or `area`.
///
/// \throws Error io: as read_file; bad_input: whatever is not as above, with file, line and column:
///         cells that are no finite number, lengths of 0, counts that are no whole number >= 0,
///         bins that do not touch, fewer than 8 profiles in all; bad_argument: a setting out of
///         range.
Measurements read_measurements(std::span<const std::filesystem::path> paths,
                               const MeasurementSettings& settings = {});

} // namespace taihu
