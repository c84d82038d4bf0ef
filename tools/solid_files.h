#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "mesh_out/io/mesh_file.h"
#include "mesh_out/surface_file.h"
#include "tools/console.h"
#include "tools/units.h"
#include "vdb_ops/field.h"
#include "vdb_ops/mesh_diagnosis.h"
#include "vdb_ops/recipe.h"
#include "vdb_ops/recipe_solid.h"

namespace taihu {

/// The options by which a verb takes a solid: a level set, or a mesh that becomes one.
struct SolidOptions {
    std::filesystem::path path;
    std::optional<int> dim;            ///< voxels along the longest axis
    std::string voxel;                 ///< or their size
    std::optional<std::string> close;  ///< loops, winding, plane, none
    std::optional<std::string> shells; ///< union, parity
    std::optional<double> unit_m;
    std::optional<std::string> up; ///< y, z

    void add_mesh_options(CLI::App& verb);  ///< --unit, --up
    void add_voxel_options(CLI::App& verb); ///< --dim, --voxel, --close, --shells, and these
    MeshReadSettings mesh_settings() const;
    bool z_up() const { return up.value_or("y") == "z"; }
    CloseSettings close_settings() const;
    bool any_mesh_option() const { return close || shells || unit_m || up; }
};

struct Solid {
    openvdb::FloatGrid::Ptr grid;
    std::shared_ptr<const Field> field; ///< what its surface is made of, or null
    Measure measure;                    ///< its voxel, its longest axis
    std::string node;                   ///< its place in a recipe
    std::vector<std::string> found;     ///< what was repaired in a mesh
};

inline constexpr int kDefaultDim = 256;
inline constexpr const char* kDefaultMaxError = "0.5vox";

/// Whether a surface is made of the solid, which is sharper with its field.
enum class Surfaces { none, wanted };

/// A .vdb as it is, or a mesh voxelized. Findings are said on the console. Where surfaces are
/// wanted, a .vdb with a recipe is made again by that, and if that gives the same level set, its
/// field is the solid's.
Solid read_solid(const SolidOptions& options, const Console& console,
                 Surfaces surfaces = Surfaces::none);

/// A level set of which a surface will be made. \throws Error as read_solid_vdb(); unsupported: one
/// that needs more memory than there is.
openvdb::FloatGrid::Ptr read_level_set(const std::filesystem::path& path, const Console& console);

/// Files of a recipe, and how its meshes are read.
RecipeAssets recipe_assets(std::vector<std::filesystem::path> folders, const Console& console);

/// How a surface is written where `-o` names a mesh format.
struct SurfaceOptions {
    bool uniform = false, no_draco = false, no_ao = false;
    std::optional<std::string> max_error, method, origin;
    std::optional<double> adaptivity;
    std::optional<std::uint64_t> triangles;
    void add_options(CLI::App& verb);
    /// The name of one that was given, or nothing.
    std::optional<std::string> any() const;
    /// \throws Error bad_argument: an option that has no meaning for this output.
    void check(const std::filesystem::path& out) const;
    SurfaceSettings settings(const Measure& measure) const;
    /// What a recipe says of them; nothing where the output is a level set.
    std::optional<RecipeLod> lod(const std::filesystem::path& out, const Measure& measure) const;
};

/// The settings by which a single mesh is written as a recipe says.
SurfaceSettings surface_settings(const RecipeLod& lod);

/// Write a solid as the extension of `path` says: .vdb, or a certified mesh. Returns the keys of
/// the verb's JSON result: file, bytes, and for a mesh its certificate.
/// \param field  what its surface is made of, or null.
nlohmann::ordered_json write_solid(const std::filesystem::path& path,
                                   const openvdb::FloatGrid& grid, const Field* field,
                                   const std::string& recipe, const SurfaceSettings& surface,
                                   const Console& console);

/// Where a bound is not promised; nothing when that is nowhere.
void say_unresolved(const std::string& where, std::size_t n, double error_m,
                    const Console& console);

/// The line for bubbles and specks that no voxel sees.
void say_unseen(const std::string& where, std::size_t n, const Console& console);

nlohmann::ordered_json certificate_json(const Certificate& certificate);
/// `closed 2-manifold, outward: 1 piece, genus 12, 0.41 m^3, 0 self-intersections`.
std::string certificate_line(const Certificate& certificate);

bool is_vdb(const std::filesystem::path& path);
/// \throws Error unsupported unless `path` ends in .vdb or a mesh format.
void check_solid_path(const std::filesystem::path& path);

} // namespace taihu
