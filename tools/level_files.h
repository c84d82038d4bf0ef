#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tools/console.h"
#include "tools/units.h"
#include "vdb_ops/field.h"
#include "vdb_ops/recipe.h"

namespace taihu {

/// How many levels there are and how far off each may be.
struct LevelOptions {
    int n_levels = 4;
    double factor = 2;
    std::string max_error = "0.5vox";
    std::vector<std::uint64_t> triangles;
    std::vector<double> pixels;
    bool no_ao = false;
    std::string origin = "world";
    void add_options(CLI::App& verb);
    /// \param height_m  of the solid.
    /// \throws Error bad_argument: numbers that do not fall.
    RecipeLod lod(const Measure& measure, double height_m) const;
};

/// Where levels go: one GLB, or a folder with a GLB for each and manifest.json.
struct LevelFiles {
    std::filesystem::path out, report; ///< no report: not written
    bool split = false;
    double fov_deg = 60;
    void add_options(CLI::App& verb);
    /// Before the work: whether all can be written, and `report` where it was left out.
    void check(const std::filesystem::path& input, const Console& console);
};

/// Makes the levels and writes them. Returns the keys of the verb's JSON result.
/// \param field  what the surface is made of, or null. \param lod  not uniform.
nlohmann::ordered_json write_levels(const LevelFiles& files, const openvdb::FloatGrid& grid,
                                    const Field* field, const RecipeLod& lod,
                                    const std::string& recipe, const Console& console);

} // namespace taihu
