#include "tools/tile_files.h"

namespace taihu {

void TileOptions::add_option(CLI::App& verb) {
    verb.add_option("--tiles", tiles,
                    "For solids larger than memory: -o is a folder, for a .vdb of each cube of so "
                    "many voxels along an edge (a multiple of 128 in 128..4096; 512 is usual) and "
                    "a tiles.json that lists them")
        ->check(CLI::Range(kLeastTile, kMostTile));
}

nlohmann::ordered_json tiles_result(const std::filesystem::path& folder, const TilesResult& made,
                                    const Console& console) {
    std::size_t n_leaves = 0, n_bytes = 0;
    for (const Tile& t : made.set.tiles) {
        n_leaves += t.n_leaves;
        n_bytes += t.n_bytes;
    }
    console.say("{}: {} tiles of {} voxels, voxel {:.4g} m, {} leaves, {:.4g} MB, {:.4g} m^3",
                (folder / kTileSetName).string(), made.set.tiles.size(), made.set.tile_voxels,
                made.set.lattice.voxel_m, n_leaves, static_cast<double>(n_bytes) * 1e-6,
                made.volume_m3);
    nlohmann::ordered_json json = {{"file", (folder / kTileSetName).string()},
                                   {"tiles", made.set.tiles.size()},
                                   {"voxel_m", made.set.lattice.voxel_m},
                                   {"leaves", n_leaves},
                                   {"bytes", n_bytes},
                                   {"volume_m3", made.volume_m3}};
    if (made.cleaned) {
        json["pieces"] = made.cleaned->n_pieces;
        json["pieces_removed"] = made.cleaned->n_pieces_removed;
        json["pieces_removed_m3"] = made.cleaned->removed_m3;
        json["bubbles"] = made.cleaned->n_bubbles;
        json["bubbles_filled"] = made.cleaned->n_bubbles_filled;
        json["bubbles_filled_m3"] = made.cleaned->filled_m3;
    }
    return json;
}

} // namespace taihu
