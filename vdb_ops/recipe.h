#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "stats/io/measurements.h"
#include "vdb_ops/clean.h"
#include "vdb_ops/mesh_diagnosis.h"
#include "vdb_ops/place.h"
#include "vdb_ops/shapes.h"

namespace taihu {

/// Recipes say how a solid was made: JSON text, version 1, kept in every output. These functions
/// write them from the inside out; each returns one node of the tree, `{"kind": {...}}`, as text.
/// Keys come in a fixed order and numbers in their shortest form, so the same recipe is the same
/// text.

std::string shape_node(const ShapeSettings& shape);
/// A mesh file: its base name and hash, its unit of length, whether its Z axis points up, and how
/// it is closed (keys for what is not by default).
std::string mesh_node(const std::string& name, const std::string& sha256, double unit_m, bool z_up,
                      const CloseSettings& close = {});
/// A level set that carries no recipe of its own.
std::string level_set_node(const std::string& name, const std::string& sha256);
/// Holes from a table.
std::string holes_node(const std::string& name, const std::string& sha256);
/// What the files say that holes of a law come from, beside the law itself.
struct HoleSources {
    bool empirical = false;          ///< diameters from the law file's table instead of its family
    std::optional<SourceFile> where; ///< that of Placement::where
};
/// Holes from a law file. What is by default has no key.
std::string holes_node(const std::string& name, const std::string& sha256,
                       const Placement& placement, const HoleSources& sources = {});
std::string difference_node(const std::string& of, const std::string& minus);
std::string clean_node(const std::string& of, const CleanSettings& settings);

/// Maps of what levels lost, baked into a GLB.
struct RecipeMaps {
    std::optional<int> side_px = {};   ///< of the finest level's, 64..8192; absent: as needed
    int gutter_px = 3;                 ///< around each chart, 1..16
    int n_rays = 64;                   ///< of the occlusion map, 1..4096
    std::optional<double> cage_m = {}; ///< how far the fine surface is sought; absent: by the level
    double grain_m = 0;                ///< of the grains of a colour map; 0: none
    double grain_contrast = 0.4;       ///< 0..1
    std::optional<int> only = {};      ///< this level alone has them, 0..7
    bool vertices = false;             ///< curvature and displacement at each vertex, too
};

/// How a recipe's surface is written; meshes other than GLB are its first level.
struct RecipeLod {
    std::vector<double> bounds_m = {};         ///< of each level, finest first, or
    std::vector<std::uint64_t> triangles = {}; ///< how many each has, or neither:
    bool uniform() const { return bounds_m.empty() && triangles.empty(); } ///< the plain extraction
    bool openness = true;                ///< ambient occlusion in a GLB's vertex colours
    bool at_foot = false;                ///< the origin is moved to the middle of the foot
    std::optional<RecipeMaps> maps = {}; ///< of levels in a GLB
};

/// The whole recipe. \param voxel_m  of the lattice.
std::string format_recipe(const std::string& solid, double voxel_m, std::uint64_t seed,
                          const std::optional<RecipeLod>& lod = std::nullopt);

/// The `solid` node of a recipe, to build on; nothing when `recipe` is not one.
std::optional<std::string> recipe_solid(const std::string& recipe);

} // namespace taihu
