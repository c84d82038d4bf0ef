#include "tools/shape_cave.h"

#include "mesh_out/extract.h"
#include "stats/core/error.h"
#include "vdb_ops/recipe.h"
#include "vdb_ops/recipe_solid.h"
#include "vdb_ops/voxelize.h"

namespace taihu {

nlohmann::ordered_json make_cave(const CaveSettings& settings, const std::filesystem::path& out,
                                 std::optional<int> dim, const std::string& voxel,
                                 const Console& console) {
    report_stage(console.progress, "placing rocks");
    const std::string node = cave_node(settings);
    RecipeSettings how;
    how.dim = dim.value_or(kDefaultDim);
    if (!voxel.empty()) {
        how.dim.reset();
        how.voxel_m =
            length_m("--voxel", voxel,
                     {0, std::max({settings.size_m.x, settings.size_m.y, settings.size_m.z})});
    }
    const RecipeSolid made =
        make_recipe(format_recipe(node, 0, settings.seed), "cave", {}, how, console.progress);
    console.say_all(out.string(), made.found);
    const CaveReport report = measure_cave(*made.solid, settings.size_m, console.progress);
    const Certificate surface =
        certify(extract_uniform(*made.solid, console.progress), {.self_intersections = false});
    nlohmann::ordered_json json =
        write_solid(out, *made.solid, made.field.get(), made.recipe,
                    SurfaceOptions().settings({made.voxel_m, 0}), console);
    json["kind"] = "cave";
    json["rocks"] = settings.n_rocks;
    json["voids"] = report.n_voids;
    json["void_share"] = report.void_share;
    json["mouth_m2"] = report.mouth_m2;
    json["genus"] = surface.genus;
    console.say("{}: cave of {} rocks: {} void{}, {:.3g} of the block, mouth {:.3g} m^2, genus {}",
                out.string(), settings.n_rocks, report.n_voids, report.n_voids == 1 ? "" : "s",
                report.void_share, report.mouth_m2, surface.genus);
    return json;
}

} // namespace taihu
