// taihu rock: a whole recipe, made.
#include "stats/core/error.h"
#include "stats/core/file_set.h"
#include "stats/core/text.h"
#include "stats/io/holes_file.h"
#include "tools/baked_files.h"
#include "tools/level_files.h"
#include "tools/presets.h"
#include "tools/solid_files.h"
#include "tools/tile_files.h"
#include "vdb_ops/level_set_box.h"
#include "vdb_ops/recipe_solid.h"
#include "vdb_ops/vdb_file.h"

namespace taihu {
namespace {

struct RockArgs {
    std::filesystem::path recipe, from, out, report, holes;
    std::string preset, voxel, height;
    std::optional<int> dim;
    std::optional<std::uint64_t> seed;
    std::vector<std::string> settings;
    std::vector<std::filesystem::path> assets;
    SurfaceOptions surface;
    TileOptions tiles;
    bool dry_run = false, list = false;
};

/// The recipe's text, a name for it, and the folders where its files may be.
struct Source {
    std::string text, where;
    std::vector<std::filesystem::path> folders;
};

/// The recipe that a solid or mesh carries.
std::string carried_recipe(const std::filesystem::path& path, const Console& console) {
    const std::string recipe =
        is_vdb(path) ? read_vdb(path).recipe : read_mesh(path, {}, console.progress).recipe;
    if (!recipe_solid(recipe))
        throw Error(Fault::bad_input,
                    path.string() + ": carries no recipe; only files that taihu wrote do");
    return recipe;
}

Source source_of(const RockArgs& args, const Console& console) {
    const int n = !args.recipe.empty() + !args.from.empty() + !args.preset.empty();
    if (n != 1)
        throw Error(Fault::bad_argument,
                    "rock: say what to make: a recipe (.json), --preset NAME or --from FILE");
    Source source;
    if (!args.preset.empty())
        return {preset_recipe(args.preset), "preset " + args.preset, args.assets};
    const std::filesystem::path& file = args.recipe.empty() ? args.from : args.recipe;
    source.text = args.recipe.empty() ? carried_recipe(file, console)
                                      : read_file(file, std::size_t{16} << 20);
    source.where = base_name(file);
    source.folders = {file.has_parent_path() ? file.parent_path() : "."};
    source.folders.insert(source.folders.end(), args.assets.begin(), args.assets.end());
    return source;
}

void change(Source& source, const RockArgs& args) {
    for (const std::string& setting : args.settings) {
        const std::size_t equals = setting.find('=');
        if (equals == std::string::npos || equals == 0)
            throw Error(Fault::bad_argument, "--set: '" + printable(setting) +
                                                 "' must be a key and a value, as porosity=0.4");
        source.text = with_setting(source.text, source.where, setting.substr(0, equals),
                                   setting.substr(equals + 1));
    }
}

RecipeSettings recipe_settings(const RockArgs& args, const Console& console) {
    RecipeSettings s;
    s.dim = args.dim;
    s.seed = args.seed;
    if (!args.voxel.empty())
        s.voxel_m = length_m("--voxel", args.voxel);
    if (!args.height.empty())
        s.height_m = length_m("--height", args.height);
    s.memory_bytes = console.memory_bytes();
    s.meshed = !args.out.empty() && !args.tiles.tiles && !is_vdb(args.out);
    return s;
}

void list_presets(const Console& console) {
    nlohmann::ordered_json json;
    for (const Preset& p : presets()) {
        const auto recipe = nlohmann::ordered_json::parse(p.recipe);
        const std::string about = recipe.value("about", "");
        const auto set = recipe.value("set", nlohmann::ordered_json::object());
        std::string names;
        for (const auto& [name, path] : set.items())
            names += (names.empty() ? "" : ", ") + name;
        json[std::string(p.name)] = {{"about", about}, {"set", names}};
        if (!console.json)
            fmt::print("{:<18} {}{}\n", p.name, about,
                       names.empty() ? "" : " (--set " + names + ")");
    }
    console.result(json);
}

/// How much a run will need.
void estimate(const Source& source, const RecipeAssets& assets, const RecipeSettings& settings,
              const Console& console) {
    const RecipeEstimate e =
        estimate_recipe(source.text, source.where, assets, settings, console.progress);
    const double bytes = e.memory.bytes();
    console.say("{}: voxel {:.4g} m, about {:.0f} leaves, {} of memory at the peak, {:.1f} s to "
                "rasterize it on this machine",
                source.where, e.voxel_m, e.size.n_leaves, human_bytes(bytes), e.size.seconds);
    if (bytes > e.limit_bytes)
        console.say("{}: more than the {} there are; use a larger voxel, or --tiles", source.where,
                    human_bytes(e.limit_bytes));
    console.result({{"voxel_m", e.voxel_m},
                    {"leaves", e.size.n_leaves},
                    {"bytes", bytes},
                    {"seconds", e.size.seconds},
                    {"fits", bytes <= e.limit_bytes}});
}

/// The table of holes, which comes into view after the rock.
void add_holes(const RockArgs& args, const std::vector<Sphere>& holes, const std::string& where,
               OutputFiles& files, const Console& console) {
    if (args.holes.empty())
        return;
    const std::vector<std::string> comments = {"holes of " + where};
    files.add(args.holes, format_holes(holes, comments));
    console.say("{}: {} holes", args.holes.string(), holes.size());
}

/// Where the output may go.
void check_output(const RockArgs& args, const Console& console) {
    if (args.out.empty() && !args.dry_run)
        throw Error(Fault::bad_argument,
                    "rock: say where to write it, as -o rock.glb, or --dry-run");
    const auto option = args.report.empty() ? args.surface.any() : "--report";
    if (args.tiles.tiles && option)
        throw Error(Fault::bad_argument, "--tiles: are level sets; drop " + *option);
    if (!args.out.empty() && args.tiles.tiles) {
        console.may_write_tiles(args.out);
    } else if (!args.out.empty()) {
        check_solid_path(args.out);
        console.may_write(args.out, {args.recipe, args.from});
        args.surface.check(args.out);
    }
    if (!args.holes.empty())
        console.may_write(args.holes, {args.recipe, args.from, args.out});
}

/// As the recipe's `lod` says unless an option does.
nlohmann::ordered_json write_rock(const RockArgs& args, const RecipeSolid& made,
                                  const Console& console) {
    const bool by_recipe = made.lod && !args.surface.any() && !is_vdb(args.out);
    if (by_recipe && !made.lod->uniform() && mesh_format(args.out) == MeshFormat::glb) {
        if (made.lod->maps)
            return write_baked({.out = args.out, .maps = {}, .report = args.report}, made.solid,
                               made.field, *made.lod, made.recipe, console);
        LevelFiles files{.out = args.out, .report = args.report};
        return write_levels(files, *made.solid, made.field.get(), *made.lod, made.recipe, console);
    }
    if (!args.report.empty())
        throw Error(Fault::bad_argument, "--report: is of levels of detail; write a .glb of a "
                                         "recipe that has 'lod'");
    const Measure measure{made.voxel_m, level_set_box(*made.solid).longest()};
    return write_solid(args.out, *made.solid, made.field.get(), made.recipe,
                       by_recipe ? surface_settings(*made.lod) : args.surface.settings(measure),
                       console);
}

void run(const RockArgs& args, const Console& console) {
    if (args.list)
        return list_presets(console);
    check_output(args, console);
    Source source = source_of(args, console);
    change(source, args);
    const RecipeAssets assets = recipe_assets(source.folders, console);
    if (args.dry_run)
        return estimate(source, assets, recipe_settings(args, console), console);
    OutputFiles holes;
    if (args.tiles.tiles) {
        const RecipeTiles made =
            make_recipe_tiles(source.text, source.where, assets, recipe_settings(args, console),
                              args.out, *args.tiles.tiles, console.progress);
        console.say_all(args.out.string(), made.found);
        add_holes(args, made.holes, source.where, holes, console);
        holes.publish();
        return console.result(tiles_result(args.out, made.tiles, console));
    }
    const RecipeSolid made = make_recipe(source.text, source.where, assets,
                                         recipe_settings(args, console), console.progress);
    console.say_all(args.out.string(), made.found);
    add_holes(args, made.holes, source.where, holes, console);
    const auto json = write_rock(args, made, console);
    holes.publish();
    console.result(json);
}

} // namespace

void add_rock(CLI::App& app, Console& console) {
    auto args = std::make_shared<RockArgs>();
    auto* verb = console.verb(
        app, "rock", "Make a rock by a recipe: a preset, a file, or what another file carries",
        "  taihu rock --preset taihu --height 1.8m --seed 7 -o rock.glb\n"
        "  taihu rock --preset sponge --set porosity=0.6 --dim 200 -o sponge.vdb\n"
        "  taihu rock my_recipe.json --dry-run\n"
        "  taihu rock my_recipe.json --dim 4096 --tiles 512 -o tiles\n"
        "  taihu rock --from rock.glb --assets meshes -o again.glb");
    verb->add_option("recipe", args->recipe, "Recipe (.json)");
    verb->add_option("--preset", args->preset, "or one that comes with taihu: see --list");
    verb->add_option("--from", args->from, "or that of a solid or mesh that taihu wrote");
    verb->add_flag("--list", args->list, "Print the presets and what --set changes in them");
    verb->add_option("-o,--output", args->out,
                     "Where to write it (.vdb .obj .ply .stl .off .glb .drc)");
    verb->add_option("--report", args->report, "Where to write the figures of the levels (.json)");
    verb->add_option("--holes", args->holes, "Where to write the holes that were carved (.csv)");
    verb->add_option("--height", args->height, "Scale all of it to this height: 1.8m");
    verb->add_option("--seed", args->seed,
                     "Of all that has no seed of its own [the recipe's, or 0]")
        ->check(CLI::Range(0.0, 9.2e18));
    verb->add_option("--set", args->settings,
                     "KEY=VALUE, a name from --list or a path in the recipe; may be repeated")
        ->take_all();
    auto* dim = verb->add_option("--dim", args->dim,
                                 "Voxels along the longest axis, 4..65536 [the recipe's, or 256]")
                    ->check(CLI::Range(4, 65536));
    verb->add_option("--voxel", args->voxel, "or the size of a voxel, as 5mm")->excludes(dim);
    verb->add_option("--assets", args->assets, "More folders with the recipe's files");
    args->tiles.add_option(*verb);
    verb->add_flag("--dry-run", args->dry_run, "Say what it will need, and make nothing");
    args->surface.add_options(*verb);
    verb->callback([args, &console] { console.within_limits([&] { run(*args, console); }); });
}

} // namespace taihu
