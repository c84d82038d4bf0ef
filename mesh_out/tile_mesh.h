#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>

#include "mesh_out/extract.h"
#include "stats/core/progress.h"

namespace taihu {

/// What was seen of a mesh while its tiles were written, with positions as the file holds them.
struct TileMeshResult {
    std::size_t n_tiles = 0;
    std::uint64_t n_vertices = 0, n_triangles = 0, n_bytes = 0;
    std::uint64_t n_boundary_edges = 0;       ///< edges that were met once, or twice the same way
    std::uint64_t n_nonmanifold_vertices = 0; ///< vertices whose faces form more than one fan
    std::uint64_t n_degenerate_faces = 0;     ///< of zero area
    std::uint64_t n_self_intersections = 0;   ///< pairs of faces, also of different tiles
    std::uint64_t n_components = 0;
    std::int64_t genus = 0; ///< summed over components; of a closed mesh
    double volume_m3 = 0, area_m2 = 0;

    /// Closed, 2-manifold and oriented, without zero-area faces, more inside than out. Whether each
    /// cavity is in a piece is not looked at.
    bool holds() const {
        return n_triangles > 0 && n_boundary_edges == 0 && n_nonmanifold_vertices == 0 &&
               n_degenerate_faces == 0 && volume_m3 > 0;
    }
};

/// The surface of a solid that is larger than memory, from its tiles (write_tiles()), as one binary
/// PLY: extract()'s of the level set, its own field, tile after tile. Vertices are written as float
/// and welded across tiles; pieces of a voxel or two that extract() turns to face outwards stay as
/// they are. Memory: a tile with what is around it, the vertices and edges on the faces of one
/// layer of tiles, and some bytes for each piece that a tile sees. Tiles are read once for each
/// tile beside them. Next to `out` a second file is made for a while, of its faces.
/// \param set  a tiles.json.
///
/// \throws Error as read_tile_set(), read_tile() and extract(); unsupported: 2^32 vertices;
/// numeric: a place that triangles cross in is so large that no halo of a tile holds it; io;
/// cancelled: nothing is left.
TileMeshResult write_tile_mesh(const std::filesystem::path& set, const std::filesystem::path& out,
                               const ExtractSettings& settings = {}, Progress* progress = nullptr);

} // namespace taihu
