#pragma once
#include "tools/solid_files.h"
#include "vdb_ops/cave.h"

namespace taihu {

/// `taihu shape cave`: makes it, writes it as the extension of `out` says, and says what it is.
/// \param voxel  instead of `dim`; may be empty.
nlohmann::ordered_json make_cave(const CaveSettings& settings, const std::filesystem::path& out,
                                 std::optional<int> dim, const std::string& voxel,
                                 const Console& console);

} // namespace taihu
