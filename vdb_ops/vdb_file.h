#pragma once
#include <filesystem>
#include <string>

#include <openvdb/openvdb.h>

#include "stats/core/progress.h"

namespace taihu {

struct VdbFile {
    openvdb::FloatGrid::Ptr solid;
    std::string recipe; ///< JSON text of what made it, or empty
    std::string tile;   ///< of a tile: JSON text of its box and of what it belongs to, or empty
};

/// The first level set of a .vdb file. That of a tile as it is: see read_solid_vdb(). OpenVDB reads
/// it in a program of its own (stats/core/foreign.h).
/// \throws Error bad_input: not a .vdb, damaged, no float level set in it, a non-finite voxel, or
/// as
///   lattice_of(); as read_foreign(); io.
VdbFile read_vdb(const std::filesystem::path& path, Progress* progress = nullptr);

/// The same, but a tile as a solid of its own, by tile_solid().
VdbFile read_solid_vdb(const std::filesystem::path& path, Progress* progress = nullptr);

/// The first grid of floats of a .vdb file, be it a level set or a fog volume.
/// \throws Error as read_vdb().
openvdb::FloatGrid::Ptr read_volume(const std::filesystem::path& path,
                                    Progress* progress = nullptr);

/// Write `solid` (named "surface") with `recipe` as the metadata taihu_recipe. The random id that
/// OpenVDB writes into each file is replaced by one from the content: the same solid gives the same
/// bytes. In one step, as write_file(). \throws Error io.
void write_vdb(const std::filesystem::path& path, const openvdb::FloatGrid& solid,
               const std::string& recipe);

/// The bytes of such a file. \param where  stands for it in messages. \param tile  of a tile:
/// metadata taihu_tile.
std::string format_vdb(const openvdb::FloatGrid& solid, const std::string& recipe,
                       const std::string& where, const std::string& tile = {});

} // namespace taihu
