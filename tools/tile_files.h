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

/// Whether a path is that of a tiles.json.
bool is_tile_set(const std::filesystem::path& path);

/// Writes the surface of a solid in tiles, and returns the keys of the verb's JSON result.
nlohmann::ordered_json mesh_tiles(const std::filesystem::path& set,
                                  const std::filesystem::path& out, const Console& console);

} // namespace taihu
