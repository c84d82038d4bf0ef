// taihu lod: levels of detail in one GLB.
#include "mesh_out/lod.h"
#include "stats/core/error.h"
#include "stats/core/file.h"
#include "tools/solid_files.h"
#include "vdb_ops/recipe.h"

namespace taihu {
namespace {

struct LodArgs {
    SolidOptions solid;
    std::filesystem::path out, report;
    std::string max_error = "0.5vox";
    LodSettings settings;
};

void tell(const LodChain& chain, const std::string& where, const Console& console) {
    for (std::size_t j = 0; j < chain.levels.size(); ++j) {
        const LodLevel& level = chain.levels[j];
        console.say(
            "{}: level {}: {} triangles, {} bytes, error {:.3g} m (bound {:.3g} m), genus {}, {} "
            "self-intersections",
            where, j, level.certificate.n_triangles, level.encoded.draco.size(), level.error_m,
            level.bound_m, level.certificate.genus, level.certificate.n_self_intersections);
    }
    if (!chain.note.empty())
        console.say("{}: {}", where, chain.note);
}

void run(LodArgs& args, const Console& console) {
    if (mesh_format(args.out) != MeshFormat::glb)
        throw Error(Fault::unsupported, args.out.string() + ": levels go into a .glb; name one");
    console.may_write(args.out, {args.solid.path});
    if (args.report.empty())
        args.report = args.out.parent_path() / "report.json";
    console.may_write(args.report, {args.solid.path, args.out});
    const Solid solid = read_solid(args.solid, console);
    args.settings.bound_m = length_m("--max-error", args.max_error, solid.measure);
    const LodChain chain = make_lods(*solid.grid, args.settings, console.progress);
    const RecipeLod lod{args.settings.n_levels, args.settings.bound_m, args.settings.factor};
    const std::string recipe = format_recipe(solid.node, solid.measure.voxel_m, 0, lod);
    const std::string report = format_report(chain, base_name(args.out));
    write_file(args.out, format_glb(chain, {.recipe = recipe}));
    write_file(args.report, report);
    tell(chain, args.out.string(), console);
    console.say("{}: the figures of each level", args.report.string());
    console.result(nlohmann::ordered_json::parse(report));
}

} // namespace

void add_lod(CLI::App& app, Console& console) {
    auto args = std::make_shared<LodArgs>();
    auto* verb =
        console.verb(app, "lod", "Write levels of detail under error bounds as one Draco GLB",
                     "  taihu lod rock.vdb -o rock.glb\n"
                     "  taihu lod rock.vdb --levels 3 --max-error 1mm --factor 3 -o rock.glb");
    verb->add_option("solid", args->solid.path, "Level set to mesh (.vdb, or a mesh to remesh)")
        ->required();
    verb->add_option("-o,--output", args->out, "Where to write the levels (.glb)")->required();
    verb->add_option("--levels", args->settings.n_levels, "How many, finest first, 1..8")
        ->check(CLI::Range(1, 8))
        ->capture_default_str();
    verb->add_option("--max-error", args->max_error, "Error bound of the finest level")
        ->capture_default_str();
    verb->add_option("--factor", args->settings.factor,
                     "Each level's bound over the one before, > 1")
        ->check(CLI::Range(1.01, 100.0))
        ->capture_default_str();
    verb->add_option("--report", args->report,
                     "Where to write the figures [report.json beside it]");
    args->solid.add_voxel_options(*verb);
    verb->callback([args, &console] { console.with_threads([&] { run(*args, console); }); });
}

} // namespace taihu
