// Readers of solids: level sets, lists of tiles, recipes.
#include <cmath>

#include "mesh_out/io/mesh_file.h"
#include "mesh_out/io/relief_file.h"
#include "stats/core/error.h"
#include "tests/fuzz/formats.h"
#include "vdb_ops/recipe_solid.h"
#include "vdb_ops/tiles.h"
#include "vdb_ops/vdb_file.h"

namespace taihu {

namespace fs = std::filesystem;

void read_vdb_bytes(const std::string& bytes, const fs::path& folder) {
    const VdbFile file = read_solid_vdb(in_file(bytes, folder, "mutant.vdb"));
    demand(file.solid != nullptr, "no grid");
    for (auto value = file.solid->cbeginValueAll(); value; ++value)
        demand(std::isfinite(*value), "a voxel that is not finite");
    const double voxel_m = file.solid->voxelSize()[0];
    demand(std::isfinite(voxel_m) && voxel_m > 0, "a voxel without a size");
    (void)recipe_solid(file.recipe);
}

void read_tiles_bytes(const std::string& bytes, const fs::path& folder) {
    const TileSet set = read_tile_set(in_file(bytes, folder, "mutant.json"));
    demand(set.lattice.voxel_m > 0 && is_finite(set.lattice.origin), "no lattice");
    for (const Tile& tile : set.tiles) {
        demand(tile.file.find('/') == std::string::npos && tile.file.size() <= 255, "a path");
        demand(!tile.box.empty(), "a box without voxels");
    }
}

namespace {

/// A recipe was read, and is not made.
struct WasRead {};

class StopAfterReading final : public Progress {
public:
    void stage(std::string_view name) override {
        if (name == "estimating")
            throw WasRead{};
    }
    void fraction(double) override {}
    bool cancelled() const override { return false; }
};

} // namespace

void read_recipe_bytes(const std::string& bytes, const fs::path& folder) {
    if (!fs::exists(folder / "holes.csv"))
        write_recipe_files(folder);
    const RecipeAssets assets{
        {folder},
        [](const fs::path& file, double unit_m, bool z_up) {
            return read_mesh(file, {unit_m, z_up ? UpAxis::z : UpAxis::y}).levels.front();
        },
        [](const fs::path& path) { return read_relief(path); }};
    StopAfterReading stop;
    try {
        (void)estimate_recipe(bytes, "mutant.json", assets, {}, &stop);
    } catch (const WasRead&) {
    }
    (void)recipe_solid(bytes);
}

} // namespace taihu
