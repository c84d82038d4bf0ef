// taihu sample: a law as a table of holes.
#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/of_file.h"
#include "stats/io/holes_file.h"
#include "tools/holes_options.h"
#include "tools/solid_files.h"

namespace taihu {
namespace {

constexpr double kHole_bytes = 180; // its line of text in it, at the peak, as measured

struct SampleArgs {
    std::filesystem::path law, out;
    SolidOptions solid;
    std::string box;
    PlacementOptions placement;
};

/// Holes inside a solid, or in a box that stands on the origin's corner.
LawHoles sample(const SampleArgs& args, const Console& console) {
    console.require_memory(static_cast<double>(args.placement.count.value_or(0)), kHole_bytes,
                           "ask for a smaller --count");
    if (args.box.empty() == args.solid.path.empty())
        throw Error(Fault::bad_argument,
                    "sample: say where the holes go: one of --in SOLID and --box X,Y,Z");
    if (!args.box.empty()) {
        if (args.solid.dim || !args.solid.voxel.empty() || args.solid.any_mesh_option())
            throw Error(Fault::bad_argument,
                        "sample: --dim, --voxel, --close, --shells, --unit and --up are for --in");
        const Box box{{0, 0, 0}, parse_size("--box", args.box)};
        return place_law(args.law, args.placement, {0, box.longest()},
                         [&](const Law& law, const Placement& p) {
                             return place_holes(law, p, box, console.progress);
                         });
    }
    const Solid solid = read_solid(args.solid, console);
    return place_law(args.law, args.placement, solid.measure,
                     [&](const Law& law, const Placement& p) {
                         return place_holes(law, p, *solid.grid, console.progress);
                     });
}

void run(const SampleArgs& args, const Console& console) {
    if (args.out.extension() != ".csv")
        throw Error(Fault::unsupported, args.out.string() + ": holes are a table; name a .csv");
    console.may_write(args.out, {args.law, args.solid.path, args.placement.where});
    const LawHoles holes = sample(args, console);
    check_cancelled(console.progress);
    write_file(args.out, of_file(base_name(args.law),
                                 [&] { return format_holes(holes.placed.holes, holes.comments); }));
    nlohmann::ordered_json json = {{"file", args.out.string()},
                                   {"holes", holes.placed.holes.size()},
                                   {"missed", holes.placed.n_missed}};
    if (holes.placed.porosity)
        json["porosity"] = *holes.placed.porosity;
    console.result(json);
    console.say("{}: {} holes", args.out.string(), holes.placed.holes.size());
    console.say_all(args.out.string(), holes.comments);
}

} // namespace

void add_sample(CLI::App& app, Console& console) {
    auto args = std::make_shared<SampleArgs>();
    auto* verb = console.verb(
        app, "sample", "Draw holes from a law, inside a solid or a box",
        "  taihu sample law.json --in base.vdb --scale 25% --porosity 0.3 -o holes.csv\n"
        "  taihu sample law.json --box 1,1,2 --scale 10cm --count 500 --seed 3 -o holes.csv\n"
        "  taihu sample law.json --box 1 --scale 10cm --count 500 --pattern thomas --height 0.2:1 "
        "-o holes.csv");
    verb->add_option("law", args->law, "Law of diameters (law.json)")->required();
    verb->add_option("-o,--output", args->out, "Table to write: x_m,y_m,z_m,radius_m (.csv)")
        ->required();
    verb->add_option("--in", args->solid.path, "Solid that the holes go into (.vdb or a mesh)");
    verb->add_option("--box", args->box, "or a box from the origin: X,Y,Z");
    args->placement.add_options(*verb);
    args->solid.add_voxel_options(*verb);
    verb->callback([args, &console] { console.within_limits([&] { run(*args, console); }); });
}

} // namespace taihu
