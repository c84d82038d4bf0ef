#pragma once
#include <string>
#include <string_view>

#include "stats/io/annotations_detail.h"

namespace taihu {

/// `CVAT for images 1.1`: polylines of two points; other shapes are left out and counted. Document
/// types and entities of the file's own are not read.
/// \throws Error bad_input: no XML, another root, more than 64 MiB, an image without name or with
///         only half of its size, a polyline without label or with points that are no numbers.
Annotations read_cvat(std::string_view text, const std::string& name);

} // namespace taihu
