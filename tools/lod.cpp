// taihu lod: levels of detail.
#include "tools/level_files.h"
#include "tools/solid_files.h"
#include "vdb_ops/level_set_box.h"
#include "vdb_ops/recipe.h"

namespace taihu {
namespace {

struct LodArgs {
    SolidOptions solid;
    LevelOptions levels;
    LevelFiles files;
};

void run(LodArgs& args, const Console& console) {
    args.files.check(args.solid.path, console);
    const Solid solid = read_solid(args.solid, console, Surfaces::wanted);
    const RecipeLod lod = args.levels.lod(solid.measure, level_set_box(*solid.grid).size().y);
    const std::string recipe = format_recipe(solid.node, solid.measure.voxel_m, 0, lod);
    console.result(write_levels(args.files, *solid.grid, solid.field.get(), lod, recipe, console));
}

} // namespace

void add_lod(CLI::App& app, Console& console) {
    auto args = std::make_shared<LodArgs>();
    auto* verb =
        console.verb(app, "lod", "Write levels of detail under error bounds as Draco GLB",
                     "  taihu lod rock.vdb -o rock.glb\n"
                     "  taihu lod rock.vdb --levels 3 --max-error 1mm --factor 3 -o rock.glb\n"
                     "  taihu lod rock.vdb --triangles 20000,5000,1000 -o rock.glb\n"
                     "  taihu lod rock.vdb --pixels 800,200,50 --split -o rock_levels");
    verb->add_option("solid", args->solid.path, "Level set to mesh (.vdb, or a mesh to remesh)")
        ->required();
    verb->add_option("-o,--output", args->files.out, "Where to write the levels (.glb)")
        ->required();
    args->levels.add_options(*verb);
    args->files.add_options(*verb);
    args->solid.add_voxel_options(*verb);
    verb->callback([args, &console] { console.within_limits([&] { run(*args, console); }); });
}

} // namespace taihu
