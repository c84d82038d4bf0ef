#pragma once
#include <filesystem>
#include <optional>

#include "tools/console.h"
#include "vdb_ops/tiles.h"

namespace taihu {

/// `--tiles N`: the output is a folder of tiles.
struct TileOptions {
    std::optional<int> tiles; ///< edge [voxels]
    void add_option(CLI::App& verb);
};

/// Says what was written, and returns the keys of the verb's JSON result.
nlohmann::ordered_json tiles_result(const std::filesystem::path& folder, const TilesResult& made,
                                    const Console& console);

} // namespace taihu
