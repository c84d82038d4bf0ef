#include "tools/tile_files.h"

#include "mesh_out/tile_mesh.h"
#include "stats/core/error.h"

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

bool is_tile_set(const std::filesystem::path& path) {
    return path.filename() == kTileSetName;
}

nlohmann::ordered_json mesh_tiles(const std::filesystem::path& set,
                                  const std::filesystem::path& out, const Console& console) {
    if (out.extension() != ".ply")
        throw Error(Fault::unsupported,
                    out.string() + ": the mesh of tiles is written as .ply; name it so");
    console.may_write(out, {set});
    const TileMeshResult made = write_tile_mesh(set, out, {}, console.progress);
    console.say("{}: {}: {} triangles of {} tiles, {} piece{}, genus {}, {:.4g} m^3, {} "
                "self-intersection{}",
                out.string(), made.holds() ? "closed 2-manifold" : "not a closed 2-manifold",
                made.n_triangles, made.n_tiles, made.n_components,
                made.n_components == 1 ? "" : "s", made.genus, made.volume_m3,
                made.n_self_intersections, made.n_self_intersections == 1 ? "" : "s");
    return {{"file", out.string()},
            {"bytes", made.n_bytes},
            {"tiles", made.n_tiles},
            {"certificate",
             {{"holds", made.holds()},
              {"vertices", made.n_vertices},
              {"triangles", made.n_triangles},
              {"boundary_edges", made.n_boundary_edges},
              {"nonmanifold_vertices", made.n_nonmanifold_vertices},
              {"degenerate_faces", made.n_degenerate_faces},
              {"components", made.n_components},
              {"genus", made.genus},
              {"self_intersections", made.n_self_intersections},
              {"volume_m3", made.volume_m3},
              {"area_m2", made.area_m2}}}};
}

} // namespace taihu
