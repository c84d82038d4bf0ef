// taihu bake: levels of detail with maps of what they lost, or such maps for any low mesh.
#include "stats/core/error.h"
#include "tools/bake_pair.h"
#include "tools/baked_files.h"
#include "tools/level_files.h"
#include "tools/solid_files.h"
#include "vdb_ops/level_set_box.h"
#include "vdb_ops/recipe.h"

namespace taihu {
namespace {

constexpr double kTexel_bytes = 30, kMaps_bytes = 80; // at the peak, as measured

struct BakeArgs {
    SolidOptions solid;
    LevelOptions levels;
    BakedFiles files;
    std::filesystem::path low;
    RecipeMaps maps;
    std::string cage, grain;
    double crease_deg = BakePair{}.crease_deg;
};

/// Options of levels that are made here.
void refuse_with_low(const CLI::App& verb) {
    for (const char* option :
         {"--levels", "--max-error", "--factor", "--triangles", "--pixels", "--only"})
        if (verb.count(option) > 0)
            throw Error(Fault::bad_argument, std::string(option) + ": is of levels that are made "
                                                                   "here, and a low mesh is given; "
                                                                   "drop one of them");
}

nlohmann::ordered_json bake_pair(const BakeArgs& args, const Console& console) {
    return write_baked_pair({.high = args.solid,
                             .low = args.low,
                             .files = args.files,
                             .maps = args.maps,
                             .cage = args.cage,
                             .grain = args.grain,
                             .occlusion = !args.levels.no_ao,
                             .at_foot = args.levels.origin == "foot",
                             .crease_deg = args.crease_deg},
                            console);
}

nlohmann::ordered_json bake_levels(const BakeArgs& args, const Console& console) {
    const Solid solid = read_solid(args.solid, console, Surfaces::wanted);
    RecipeLod lod = args.levels.lod(solid.measure, level_set_box(*solid.grid).size().y);
    lod.maps = args.maps;
    if (!args.cage.empty())
        lod.maps->cage_m = length_m("--cage", args.cage, solid.measure);
    if (!args.grain.empty())
        lod.maps->grain_m = length_m("--grain", args.grain, solid.measure);
    return write_baked(args.files, solid.grid, solid.field, lod,
                       format_recipe(solid.node, solid.measure.voxel_m, 0, lod), console);
}

void run(const BakeArgs& args, const CLI::App& verb, const Console& console) {
    if (!args.low.empty())
        refuse_with_low(verb);
    else if (verb.count("--crease") > 0)
        throw Error(Fault::bad_argument, "--crease: is of a low mesh; name one behind the high");
    args.files.check({args.solid.path, args.low}, console);
    const double side_px = args.maps.side_px.value_or(2 * BakeSettings{}.side_px); // may be doubled
    console.require_memory(side_px * side_px, args.files.maps.empty() ? kTexel_bytes : kMaps_bytes,
                           "give a smaller --size");
    console.result(args.low.empty() ? bake_levels(args, console) : bake_pair(args, console));
}

} // namespace

void add_bake(CLI::App& app, Console& console) {
    auto args = std::make_shared<BakeArgs>();
    auto* verb = console.verb(
        app, "bake",
        "Write levels of detail, or a low mesh of yours, with normal and occlusion maps as Draco "
        "GLB",
        "  taihu bake rock.vdb -o rock.glb\n"
        "  taihu bake scan.ply low.obj --size 4096 --maps maps -o low.glb\n"
        "  taihu bake rock.vdb --triangles 8000,2000 --size 1024 --maps maps -o rock.glb\n"
        "  taihu bake rock.vdb --levels 1 --max-error 4vox --cage 10vox --size 4096 -o low.glb");
    verb->add_option("solid", args->solid.path,
                     "Level set to bake (.vdb, or a mesh; to remesh where no low one is given)")
        ->required();
    verb->add_option("low", args->low,
                     "Bake onto this mesh instead of levels made here: closed or open, it is "
                     "unwrapped, and its faces stay as they are");
    verb->add_option("-o,--output", args->files.out, "Where to write levels and maps (.glb)")
        ->required();
    verb->add_option("--size", args->maps.side_px,
                     "Side of the finest level's maps, 64..8192; others are halved as far as "
                     "their bounds allow [2048, 4096 where normals would be 5 degrees off; pixels]")
        ->check(CLI::Range(64, 8192));
    verb->add_option("--gutter", args->maps.gutter_px, "Filled pixels around each chart, 1..16")
        ->check(CLI::Range(1, 16))
        ->capture_default_str();
    verb->add_option("--cage", args->cage,
                     "How far along its normals a level looks for the fine surface, as 3mm or "
                     "10vox [a voxel and twice the level's bound; a low mesh: as far as the two "
                     "are measured to lie apart]");
    auto* grains = verb->add_option("--grain", args->grain,
                                    "Colour map with grains of this size, as 5mm [none]");
    verb->add_option("--grain-contrast", args->maps.grain_contrast,
                     "How much darker the darkest grain is than the brightest, 0..1")
        ->check(CLI::Range(0.0, 1.0))
        ->needs(grains)
        ->capture_default_str();
    verb->add_option("--only", args->maps.only, "Maps for this level alone, 0 is the finest")
        ->check(CLI::Range(0, 7));
    verb->add_flag("--vertices", args->maps.vertices,
                   "Curvature [1/m] and displacement [m] of each vertex, too, as _CURVATURE and "
                   "_DISPLACEMENT");
    verb->add_option("--crease", args->crease_deg,
                     "A low mesh: edges that turn by more are sharp, 0..180 [deg]")
        ->check(CLI::Range(0.0, 180.0))
        ->capture_default_str();
    verb->add_option("--maps", args->files.maps,
                     "Folder for all maps as EXR: normals in tangent and object space, "
                     "displacement, occlusion, curvature, parts, colour");
    verb->add_option("--ao-rays", args->maps.n_rays, "Rays for occlusion at each place, 1..4096")
        ->check(CLI::Range(1, 4096))
        ->capture_default_str();
    verb->add_option("--report", args->files.report, "Where to write the figures (.json)");
    args->levels.add_options(*verb);
    args->solid.add_voxel_options(*verb);
    verb->callback(
        [args, verb, &console] { console.within_limits([&] { run(*args, *verb, console); }); });
}

} // namespace taihu
