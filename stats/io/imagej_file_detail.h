#pragma once
#include <string>
#include <string_view>

#include "stats/io/annotations_detail.h"
#include "stats/io/table_detail.h"

namespace taihu {

/// Whether the bytes begin as ImageJ's .roi, or as a zip, do.
bool is_imagej_roi(std::string_view bytes);
bool is_zip(std::string_view bytes);

/// One ROI: a straight line (an arrow, too) or a polyline of two points; other types are left out
/// and counted. Its label is its name, the file's without .roi where it has none inside; ImageJ's
/// own names (`0178-0160`) are no labels, and the number it puts behind a name that is taken
/// (`hole-2`) is no part of it. The photo has the name "".
/// \throws Error bad_input: cut short, or a coordinate that is not finite.
Annotations read_imagej_roi(std::string_view bytes, const std::string& name);

/// The same of every ROI in a zip, which is one photo. Entries that are no ROI are counted.
/// \throws Error bad_input: a damaged zip; more than 100,000 entries, 1 MiB in one of them or 256
///         MiB in all of them; a compression other than deflate, a password.
Annotations read_imagej_zip(std::string_view bytes, const std::string& name);

/// ImageJ's table of results: `Length`, and the ends where BX, BY, Width, Height and Angle tell
/// them. `Label` is the image, or `image:roi`. The rows of `Summarize` are left out and counted.
/// \throws Error bad_input: a table without Length; a length that is no number > 0.
Annotations read_imagej_results(const Table& table, const std::string& name);

} // namespace taihu
