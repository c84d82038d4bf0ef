// taihu bake: levels of detail with maps of what they lost.
#include <algorithm>
#include <optional>

#include "mesh_out/bake_level.h"
#include "stats/core/error.h"
#include "stats/core/file.h"
#include "tools/level_files.h"
#include "tools/solid_files.h"
#include "vdb_ops/level_set_box.h"
#include "vdb_ops/placed_level_set_field.h"
#include "vdb_ops/recipe.h"

namespace taihu {
namespace {

struct BakeArgs {
    SolidOptions solid;
    LevelOptions levels;
    std::filesystem::path out, maps, report;
    std::string cage, grain;
    double grain_contrast = BakeLevelSettings{}.grain_contrast;
    int size_px = 2048, gutter_px = 3, ao_rays = 64;
    std::optional<int> only;
};

void check(const BakeArgs& args, const Console& console) {
    if (mesh_format(args.out) != MeshFormat::glb)
        throw Error(Fault::unsupported,
                    args.out.string() + ": levels with maps go into a .glb; name one");
    console.may_write(args.out, {args.solid.path});
    if (!args.report.empty())
        console.may_write(args.report, {args.solid.path, args.out});
    if (!args.maps.empty() && !std::filesystem::is_directory(args.maps))
        console.may_write(args.maps, {args.solid.path, args.out});
    for (int j = 0; std::filesystem::is_directory(args.maps) && j < 8; ++j)
        console.may_write(args.maps / fmt::format("level{}_normal.exr", j));
}

LodChain make_chain(const BakeArgs& args, const Solid& solid, const RecipeLod& lod,
                    const Console& console) {
    LodSettings settings;
    for (const double bound_m : lod.bounds_m)
        settings.levels.push_back({bound_m, 0});
    for (const std::uint64_t n : lod.triangles)
        settings.levels.push_back({0, n});
    settings.openness = lod.openness && args.only.has_value(); // baked ones have a texture for it
    LodChain chain = make_lods(*solid.grid, solid.field.get(), settings, console.progress);
    if (args.only && static_cast<std::size_t>(*args.only) >= chain.levels.size())
        throw Error(Fault::bad_argument, "--only: there is no level " + std::to_string(*args.only) +
                                             " of " + std::to_string(chain.levels.size()) +
                                             "; levels are counted from 0, the finest");
    return chain;
}

/// The lengths of the options, read before any long work.
struct Lengths {
    double voxel_m = 0, grain_m = 0;
    std::optional<double> fixed_cage_m;

    /// Far enough to reach what a level lost, and not the next wall.
    double cage_m(const LodLevel& level) const {
        return fixed_cage_m.value_or(voxel_m + 2 * level.bound_m);
    }
};

Lengths lengths(const BakeArgs& args, const Measure& measure) {
    Lengths out{.voxel_m = measure.voxel_m, .grain_m = 0, .fixed_cage_m = {}};
    if (!args.grain.empty())
        out.grain_m = length_m("--grain", args.grain, measure);
    if (!args.cage.empty())
        out.fixed_cage_m = length_m("--cage", args.cage, measure);
    return out;
}

nlohmann::ordered_json maps_json(const BakedLevel& baked) {
    return {{"size_px", baked.maps.normal.width},
            {"charts", baked.n_charts},
            {"texel_m", baked.texel_m},
            {"used", baked.used_rel},
            {"most_stretch", baked.most_stretch},
            {"stretched_area", baked.stretched_area_rel},
            {"texels", baked.maps.n_texels},
            {"nearest_texels", baked.maps.n_nearest},
            {"rms_displacement_m", baked.maps.rms_displacement_m},
            {"most_displacement_m", baked.maps.most_displacement_m},
            {"normal_error_deg", baked.relit.mean_deg},
            {"normal_error_without_deg", baked.relit.plain_mean_deg}};
}

void tell(const BakeArgs& args, std::size_t j, const LodLevel& level, const BakedLevel& baked,
          const Console& console) {
    console.say("{}: level {}: {} triangles, error {:.3g} m; {} charts, {} x {} texels of {:.3g} m "
                "({:.0f} % used), normals {:.2f} degrees off, {:.2f} without the map",
                args.out.string(), j, level.certificate.n_triangles, level.error_m, baked.n_charts,
                baked.maps.normal.width, baked.maps.normal.height, baked.texel_m,
                100 * baked.used_rel, baked.relit.mean_deg, baked.relit.plain_mean_deg);
}

/// The levels as they go into the file, and their figures into the report.
std::vector<EncodedLevel> bake_levels(const BakeArgs& args, const LodChain& chain,
                                      const BakeSource& source, const Lengths& sizes,
                                      const Console& console, nlohmann::ordered_json& report) {
    const std::vector<double> coverages = screen_coverages(chain);
    std::vector<EncodedLevel> out;
    double texel_per_bound = 0; // of the first level with maps: others are seen from farther
    for (std::size_t j = 0; j < chain.levels.size(); ++j) {
        const LodLevel& level = chain.levels[j];
        out.push_back(level.encoded);
        if (!args.only || static_cast<std::size_t>(*args.only) == j) {
            BakedLevel baked = bake_level(level, source,
                                          {.reach_m = sizes.cage_m(level),
                                           .side_px = args.size_px,
                                           .texel_m = texel_per_bound * level.bound_m,
                                           .gutter_px = args.gutter_px,
                                           .grain_m = sizes.grain_m,
                                           .grain_contrast = args.grain_contrast,
                                           .occlusion = !args.levels.no_ao,
                                           .masters = !args.maps.empty()},
                                          console.progress);
            if (texel_per_bound == 0)
                texel_per_bound = baked.texel_m / level.bound_m;
            tell(args, j, level, baked, console);
            report["levels"][j]["bytes"] = baked.encoded.draco.size();
            report["levels"][j]["maps"] = maps_json(baked);
            if (!args.maps.empty())
                write_maps(args.maps, fmt::format("level{}", j), baked.maps);
            out.back() = std::move(baked.encoded);
        }
        out.back().screen_coverage = coverages[j];
    }
    return out;
}

void run(const BakeArgs& args, const Console& console) {
    check(args, console);
    const Solid solid = read_solid(args.solid, console, Surfaces::wanted);
    const RecipeLod lod = args.levels.lod(solid.measure, level_set_box(*solid.grid).size().y);
    const Lengths sizes = lengths(args, solid.measure);
    const LodChain chain = make_chain(args, solid, lod, console);
    std::shared_ptr<const Field> field = solid.field;
    if (!field)
        field = std::make_shared<PlacedLevelSetField>(solid.grid);
    double reach_m = 0;
    for (const LodLevel& level : chain.levels)
        reach_m = std::max(reach_m, sizes.cage_m(level));
    const BakeSource source = bake_source(*solid.grid, *field, reach_m,
                                          lod.openness ? args.ao_rays : 0, console.progress);
    if (!args.maps.empty())
        std::filesystem::create_directories(args.maps);
    auto report = nlohmann::ordered_json::parse(format_report(chain, base_name(args.out)));
    const auto levels = bake_levels(args, chain, source, sizes, console, report);
    GlbSettings glb{.recipe = format_recipe(solid.node, solid.measure.voxel_m, 0, lod)};
    if (lod.at_foot)
        glb.shift = foot_shift(chain.levels.front().certificate.box);
    const std::string bytes = format_glb(levels, glb);
    write_file(args.out, bytes);
    console.say("{}: {} levels, {} bytes", args.out.string(), levels.size(), bytes.size());
    if (!chain.note.empty())
        console.say("{}: {}", args.out.string(), chain.note);
    if (!args.report.empty())
        write_file(args.report, report.dump(2) + "\n");
    console.result(report);
}

} // namespace

void add_bake(CLI::App& app, Console& console) {
    auto args = std::make_shared<BakeArgs>();
    auto* verb = console.verb(
        app, "bake", "Write levels of detail with normal and occlusion maps as Draco GLB",
        "  taihu bake rock.vdb -o rock.glb\n"
        "  taihu bake rock.vdb --triangles 8000,2000 --size 1024 --maps maps -o rock.glb\n"
        "  taihu bake rock.vdb --levels 1 --max-error 4vox --cage 10vox --size 4096 -o low.glb");
    verb->add_option("solid", args->solid.path, "Level set to bake (.vdb, or a mesh to remesh)")
        ->required();
    verb->add_option("-o,--output", args->out, "Where to write levels and maps (.glb)")->required();
    verb->add_option("--size", args->size_px,
                     "Side of the finest level's maps, 64..8192; others are halved as far as "
                     "their bounds allow [pixels]")
        ->check(CLI::Range(64, 8192))
        ->capture_default_str();
    verb->add_option("--gutter", args->gutter_px, "Filled pixels around each chart, 1..16")
        ->check(CLI::Range(1, 16))
        ->capture_default_str();
    verb->add_option("--cage", args->cage,
                     "How far along its normals a level looks for the fine surface, as 3mm or "
                     "10vox [a voxel and twice the level's bound]");
    auto* grains = verb->add_option("--grain", args->grain,
                                    "Colour map with grains of this size, as 5mm [none]");
    verb->add_option("--grain-contrast", args->grain_contrast,
                     "How much darker the darkest grain is than the brightest, 0..1")
        ->check(CLI::Range(0.0, 1.0))
        ->needs(grains)
        ->capture_default_str();
    verb->add_option("--only", args->only, "Maps for this level alone, 0 is the finest")
        ->check(CLI::Range(0, 7));
    verb->add_option("--maps", args->maps,
                     "Folder for all maps as EXR: normals in tangent and object space, "
                     "displacement, occlusion, curvature, parts, colour");
    verb->add_option("--ao-rays", args->ao_rays, "Rays for occlusion at each place, 1..4096")
        ->check(CLI::Range(1, 4096))
        ->capture_default_str();
    verb->add_option("--report", args->report, "Where to write the figures (.json)");
    args->levels.add_options(*verb);
    args->solid.add_voxel_options(*verb);
    verb->callback([args, &console] { console.with_threads([&] { run(*args, console); }); });
}

} // namespace taihu
