#pragma once
#include <string>

#include <nlohmann/json.hpp>

#include "stats/io/annotations_detail.h"
#include "stats/io/table_detail.h"

namespace taihu {

/// Whether these are annotations or a project of the VGG Image Annotator, version 1 or 2.
bool is_via(const nlohmann::json& file);

/// Regions that are a `polyline` of two points; the others are left out and counted. The label is
/// the region attribute `label`, `type`, `name` or `class`, or else the only one there is.
/// \throws Error bad_input: an image without file name or regions, a region without a shape.
Annotations read_via(const nlohmann::json& file, const std::string& name);

/// The columns that are read of the CSV form.
inline constexpr std::string_view kViaShapeColumn = "region_shape_attributes";

/// The same from the CSV form, whose cells hold JSON.
Annotations read_via_table(const Table& table, const std::string& name);

} // namespace taihu
