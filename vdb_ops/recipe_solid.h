#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "stats/core/progress.h"
#include "stats/core/sphere.h"
#include "stats/core/tri_mesh.h"
#include "vdb_ops/estimate.h"
#include "vdb_ops/field.h"
#include "vdb_ops/recipe.h"
#include "vdb_ops/relief.h"
#include "vdb_ops/tiles.h"

namespace taihu {

/// What a recipe takes from outside. Its files are base names with a SHA-256; a file of that name
/// whose bytes are others is refused.
struct RecipeAssets {
    std::vector<std::filesystem::path> folders; ///< searched in turn
    /// Reads the finest level of a mesh file, in metres and with +Y up.
    std::function<TriMesh(const std::filesystem::path& file, double unit_m, bool z_up)> read_mesh;
    /// Reads a height tile; pixel_m is 0 where the file does not say it.
    std::function<ReliefTile(const std::filesystem::path& file)> read_relief = {};
};

/// What is to be other than the recipe says.
struct RecipeSettings {
    std::optional<double> voxel_m = {};  ///< > 0
    std::optional<int> dim = {};         ///< or voxels along the longest axis, 4..65536
    std::optional<double> height_m = {}; ///< all is scaled so that the solid's box is so high, > 0
    std::optional<std::uint64_t> seed = {};  ///< of everything that has no seed of its own
    std::optional<double> memory_bytes = {}; ///< at most so much, of what the machine has left
    bool meshed = false;                     ///< a surface is made of it, which needs memory, too
};

/// What is made of a recipe, but for the solid.
struct RecipeReport {
    double voxel_m = 0;
    std::optional<RecipeLod> lod;
    std::string recipe;             ///< what makes it again, the settings in it
    std::vector<Sphere> holes;      ///< that were carved, in the order of the recipe [m]
    std::vector<std::string> found; ///< what was repaired, placed and removed, by node
};

struct RecipeSolid : RecipeReport {
    openvdb::FloatGrid::Ptr solid;
    /// What its surface is made of, but for pieces removed and bubbles filled; null where only the
    /// level set says.
    std::shared_ptr<const Field> field;
};

struct RecipeTiles : RecipeReport {
    TilesResult tiles;
};

/// Makes the solid of a recipe (version 1, data/schema/recipe.schema.json).
///
/// Transforms are carried down to what they move, so nothing is sampled twice on their account.
/// Holes of a law are placed in the solid that stands before them in their difference, in its own
/// place before any transform around both, so that they move and grow with it. Seeds that are left
/// out follow from the recipe's, in the order of the text.
/// The same bytes on any number of threads, and as the verb that wrote the recipe.
///
/// \param where  stands for the recipe in messages: `rock.json`.
/// \throws Error bad_input: not a recipe, with the node, the key, the value and what it may be; a
///         file that is another than the one meant; bad_argument: a setting; io: a file that is
///         missing or cannot be read; unsupported: more memory than there is; what the operators
///         throw.
RecipeSolid make_recipe(const std::string& recipe, const std::string& where,
                        const RecipeAssets& assets, const RecipeSettings& settings = {},
                        Progress* progress = nullptr);

/// What make_recipe() will need.
struct RecipeEstimate {
    double voxel_m = 0;
    SizeEstimate size;
    MemoryUse memory;
    double limit_bytes = 0;
};

/// By estimate_size(); holes of a law are placed in a solid of at most 128 voxels for it.
/// \throws Error as make_recipe(), but for memory.
RecipeEstimate estimate_recipe(const std::string& recipe, const std::string& where,
                               const RecipeAssets& assets, const RecipeSettings& settings = {},
                               Progress* progress = nullptr);

/// The same as tiles in a folder, for solids that are larger than memory: their union is, bit for
/// bit, what make_recipe() makes. Where the recipe ends in `clean`, that is done across tiles; a
/// `clean` inside of it, and holes of a law, need the level set of what they are made in.
/// \param tile_voxels  as TileSettings. \throws Error as make_recipe() and write_tiles().
RecipeTiles make_recipe_tiles(const std::string& recipe, const std::string& where,
                              const RecipeAssets& assets, const RecipeSettings& settings,
                              const std::filesystem::path& folder, int tile_voxels,
                              Progress* progress = nullptr);

/// A recipe with one value changed: `key` is a name that its `set` explains (`porosity`), or a path
/// of names and numbers (`/solid/sphere/size_m/0`) to something that is there.
/// \param value  JSON; what is none is taken for text.
/// \throws Error bad_input: not a recipe; bad_argument: no such key, with the nearest.
std::string with_setting(const std::string& recipe, const std::string& where,
                         const std::string& key, const std::string& value);

} // namespace taihu
