#pragma once
#include <filesystem>

#include "tools/console.h"

namespace taihu {

/// The two ways to write a bump map (mesh_out/bump.h) as files: heights [m] in channel Y, offsets
/// [m per texel] in channels u and v.
enum class BumpForm { heights, offsets };

/// Reads the other form, as this or `taihu relief` wrote it, and writes this one; returns
/// the verb's JSON result. \throws Error as read_relief(), write_exr(); cancelled.
nlohmann::ordered_json convert_bumps(const std::filesystem::path& from,
                                     const std::filesystem::path& out, BumpForm form,
                                     const Console& console);

} // namespace taihu
