#pragma once
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "stats/core/progress.h"
#include "vdb_ops/clean.h"
#include "vdb_ops/field.h"

namespace taihu {

// A solid that is larger than memory, as files of its parts.

inline constexpr const char* kTileSetName = "tiles.json"; ///< in the folder of the tiles
inline constexpr int kLeastTile = 128, kMostTile = 4096;  ///< edges [voxels]

struct TileSettings {
    int tile_voxels = 512;              ///< edge of a tile, a multiple of 128 in 128..4096
    std::optional<CleanSettings> clean; ///< of the whole, across tiles; absent: not cleaned
};

/// One file, a .vdb: the part of the whole in `box`, its leaves and inside tiles.
struct Tile {
    std::string file; ///< base name, beside tiles.json
    openvdb::CoordBBox box;
    std::string sha256;
    std::size_t n_leaves = 0, n_bytes = 0;
};

/// What tiles.json says (version 1, data/schema/tiles.schema.json).
struct TileSet {
    Lattice lattice;
    int tile_voxels = 0;
    std::string recipe;      ///< of the whole, or empty
    std::vector<Tile> tiles; ///< those in which something is inside, x before y before z
};

struct TilesResult {
    TileSet set;
    std::optional<CleanCounts> cleaned;
    double volume_m3 = 0; ///< as volume_m3() of the whole, but for the order of the sum
};

/// The level set of a field, tile by tile, into `folder`: made when it is not there; an earlier set
/// in it is there until all tiles are written, and then replaced by them (see FileSet). The union
/// of the tiles is, bit for bit, what rasterize() gives, and with `clean` what clean() makes of
/// that. Memory: the field's and that of a tile, with cleaning of the voxels that change side, too.
/// Cleaning goes over the field three times: parts are named, joined over the faces of tiles and
/// chosen; their voxels are marked; tiles are made, each with as much around it as rebuilding looks
/// at. \throws Error bad_argument: an edge out of range, as rasterize(); bad_input as clean(); io:
/// the
///   folder holds other files; whatever is thrown: no tile is left, and an earlier set untouched.
TilesResult write_tiles(const std::filesystem::path& folder, const Field& field,
                        const Lattice& lattice, const TileSettings& settings,
                        const std::string& recipe, Progress* progress = nullptr);

/// Reads a tiles.json. \throws Error bad_input, with the key; io.
TileSet read_tile_set(const std::filesystem::path& path);

/// One tile of a set on this lattice. \throws Error bad_input: another file than the set means, or
/// another lattice; as read_vdb().
openvdb::FloatGrid::Ptr read_tile(const std::filesystem::path& folder, const Tile& tile,
                                  const Lattice& lattice);

/// A tile as a solid of its own, for what needs a closed one: cut off half a voxel within its box.
openvdb::FloatGrid::Ptr tile_solid(const openvdb::FloatGrid& tile, const openvdb::CoordBBox& box,
                                   Progress* progress = nullptr);

/// All tiles as one level set, where that fits into memory.
openvdb::FloatGrid::Ptr read_tiles(const std::filesystem::path& set, Progress* progress = nullptr);

} // namespace taihu
