#pragma once
#include <filesystem>

#include "vdb_ops/relief.h"

namespace taihu {

/// One channel of a tile that `taihu relief` wrote, its heights if no other is named, or of any EXR
/// that has it: its `pixel_m` (0 where it has none) and `wrap` attributes say the rest.
/// \throws Error as read_exr(); bad_input: a height that is not finite, fewer than 2 x 2 points, a
/// pixel_m that is no length.
ReliefTile read_relief(const std::filesystem::path& path, const char* channel = "Y");

} // namespace taihu
