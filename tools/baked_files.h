#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "mesh_out/bake_level.h"
#include "stats/core/file_set.h"
#include "tools/console.h"
#include "vdb_ops/field.h"
#include "vdb_ops/recipe.h"

namespace taihu {

/// Where levels with maps go: one GLB; all maps as EXR, unless the folder's name is empty; and the
/// figures, likewise.
struct BakedFiles {
    std::filesystem::path out, maps, report;
    /// Before the work: whether all can be written.
    void check(std::initializer_list<std::filesystem::path> inputs, const Console& console) const;
};

/// Writes a GLB, the maps that are written so far, and the figures: none comes into view before all
/// are whole, and none when it is cancelled.
void write_together(const BakedFiles& files, std::optional<FileSet>& maps, std::string_view glb,
                    const nlohmann::ordered_json& report, const Console& console);

/// The side of maps where none is asked for, and how far it grows where normals want it.
inline constexpr int kSide_px = 2048, kMostSide_px = 4096;

/// The figures of a level's maps.
nlohmann::ordered_json maps_json(const BakedLevel& baked);

/// Makes the levels with the maps that `lod` has and writes them. Returns the report.
/// \param field  what the surface is made of, or null.
nlohmann::ordered_json write_baked(const BakedFiles& files, openvdb::FloatGrid::ConstPtr grid,
                                   std::shared_ptr<const Field> field, const RecipeLod& lod,
                                   const std::string& recipe, const Console& console);

} // namespace taihu
