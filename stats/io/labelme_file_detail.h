#pragma once
#include <string>

#include <nlohmann/json.hpp>

#include "stats/io/annotations_detail.h"

namespace taihu {

/// Whether the file has what labelme writes: a list of `shapes`.
bool is_labelme(const nlohmann::json& file);

/// Shapes of type `line`, and `linestrip` with two points. A linestrip with more points measures no
/// one hole; it is left out and counted, as are polygons and the rest. The photo is named by
/// imagePath without its folders, which say only where the file once lay.
/// \throws Error bad_input: a shape without type, label or points, a line without two points.
Annotations read_labelme(const nlohmann::json& file, const std::string& name);

} // namespace taihu
