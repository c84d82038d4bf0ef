// taihu carve: a base minus holes.
#include <cmath>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/sha256.h"
#include "stats/core/text.h"
#include "stats/io/holes_file.h"
#include "tools/holes_options.h"
#include "tools/solid_files.h"
#include "tools/tile_files.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/carve.h"
#include "vdb_ops/clean.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/estimate.h"
#include "vdb_ops/level_set_box.h"
#include "vdb_ops/level_set_field.h"
#include "vdb_ops/placed_level_set_field.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/recipe.h"

namespace taihu {
namespace {

struct CarveArgs {
    SolidOptions base;
    std::filesystem::path holes, out;
    PlacementOptions placement;
    double foot_deg = 0;
    std::string pieces = "largest", bubbles = "fill", min_neck;
    SurfaceOptions surface;
    TileOptions tiles;
};

/// The holes of a table, or of a law placed in the base.
LawHoles read_or_place(const CarveArgs& args, const Solid& base, const Console& console) {
    if (args.holes.extension() == ".json")
        return place_law(args.holes, args.placement, base.measure,
                         [&](const Law& law, const Placement& p) {
                             return place_holes(law, p, *base.grid, console.progress);
                         });
    if (const auto option = args.placement.any())
        throw Error(Fault::bad_argument, args.holes.string() +
                                             ": a table says where its holes are; drop " + *option +
                                             ", it is for a law.json");
    LawHoles holes;
    holes.placed.holes = read_holes(args.holes);
    if (holes.placed.holes.empty())
        throw Error(Fault::bad_input, args.holes.string() +
                                          ": a header without holes: nothing would be carved; name "
                                          "a table that has some");
    holes.node = holes_node(base_name(args.holes), sha256_hex(read_file(args.holes)));
    return holes;
}

CleanSettings clean_settings(const CarveArgs& args) {
    CleanSettings settings;
    settings.fill_bubbles = args.bubbles == "fill";
    if (args.pieces == "all") {
        settings.n_pieces.reset();
    } else if (args.pieces != "largest") {
        const auto n = parse_integer(args.pieces);
        if (!n || *n < 1)
            throw Error(Fault::bad_argument, "--pieces: '" + printable(args.pieces) +
                                                 "' must be largest, all, or a number >= 1");
        settings.n_pieces = static_cast<std::size_t>(*n);
    }
    return settings;
}

/// Share of the base that is gone in the end: holes and pieces away, bubbles filled again.
double final_porosity(const CarvedVolume& carved, const CleanResult& cleaned) {
    return (carved.removed_m3 + cleaned.necked_m3 + cleaned.removed_m3 - cleaned.filled_m3) /
           carved.base_m3;
}

void tell(const CarveArgs& args, const LawHoles& holes, std::size_t n_unresolved,
          const CarvedVolume& carved, const CleanResult& cleaned, std::size_t n_missed,
          const Console& console) {
    const std::string where = args.out.string();
    const std::size_t n = holes.placed.holes.size();
    console.say_all(where, holes.comments);
    console.say("{}: carved {} hole{} ({} below 1.5 voxels), removed {:.4g} m^3", where, n,
                n == 1 ? "" : "s", n_unresolved, carved.removed_m3);
    if (n_missed > 0)
        console.say("{}: {} of {} holes do not touch the base; check their unit and place", where,
                    n_missed, n);
    if (cleaned.n_necked > 0)
        console.say("{}: {} part{} on thin necks cut off ({:.3g} m^3)", where, cleaned.n_necked,
                    cleaned.n_necked == 1 ? "" : "s", cleaned.necked_m3);
    console.say(
        "{}: voxel pieces: {} found, {} removed ({:.3g} m^3); sealed bubbles: {} found, {} filled "
        "({:.3g} m^3)",
        where, cleaned.n_pieces, cleaned.n_pieces_removed, cleaned.removed_m3, cleaned.n_bubbles,
        cleaned.n_bubbles_filled, cleaned.filled_m3);
    if (const auto line = crumbled_line(cleaned))
        console.say("{}: {}", where, *line);
    if (cleaned.foot)
        console.say("{}: {}", where, foot_line(cleaned));
    console.say("{}: porosity {:.4f} as carved, {:.4f} once cleaned", where, carved.porosity(),
                final_porosity(carved, cleaned));
    if (args.placement.porosity && std::fabs(carved.porosity() - *args.placement.porosity) > 0.005)
        console.say("{}: the voxel is too large for these holes to make {:.4g}; use a smaller one",
                    where, *args.placement.porosity);
}

/// The level set of the base without the holes, as carve() makes it.
DifferenceField carved_level_set(const Solid& base, const LawHoles& holes) {
    return {std::make_shared<LevelSetField>(base.grid),
            std::make_shared<BallsField>(holes.placed.holes)};
}

/// What its surface is made of.
std::shared_ptr<const Field> carved_field(const Solid& base, const LawHoles& holes) {
    std::shared_ptr<const Field> of = base.field;
    if (!of)
        of = std::make_shared<PlacedLevelSetField>(base.grid);
    return std::make_shared<DifferenceField>(std::move(of),
                                             std::make_shared<BallsField>(holes.placed.holes));
}

/// The holes taken away tile by tile: only the base is in memory.
void write_carved_tiles(const CarveArgs& args, const Solid& base, const LawHoles& holes,
                        const TileSettings& settings, const std::string& recipe,
                        const Console& console) {
    const TilesResult made =
        write_tiles(args.out, carved_level_set(base, holes), lattice_of(*base.grid), settings,
                    recipe, console.progress);
    const std::string where = args.out.string();
    console.say_all(where, holes.comments);
    console.say("{}: carved {} holes", where, holes.placed.holes.size());
    console.say_all(where, cleaning_lines(*made.cleaned));
    auto json = tiles_result(args.out, made, console);
    json["holes"] = holes.placed.holes.size();
    json["found"] = base.found;
    console.result(json);
}

/// Before the work: whether base, rock and what is made of it fit into memory.
void refuse_if_too_much(const CarveArgs& args, const Solid& base, const LawHoles& holes,
                        const Console& console) {
    const double limit = memory_limit_bytes(console.memory_bytes());
    MemoryUse use{.base_leaves = static_cast<double>(base.grid->tree().leafCount()),
                  .cleaned = true,
                  .meshed = !is_vdb(args.out)};
    if (!may_exceed(level_set_box(*base.grid), base.measure.voxel_m, use, limit))
        return;
    use.leaves = estimate_size(carved_level_set(base, holes), lattice_of(*base.grid)).n_leaves;
    refuse_if_over(use, base.measure.voxel_m, limit);
}

/// Where the output may go.
void check_output(const CarveArgs& args, const Console& console) {
    if (!args.tiles.tiles) {
        check_solid_path(args.out);
        console.may_write(args.out, {args.base.path, args.holes, args.placement.where});
        return args.surface.check(args.out);
    }
    if (const auto option = args.surface.any())
        throw Error(Fault::bad_argument, "--tiles: are level sets; drop " + *option);
    console.may_write_tiles(args.out);
}

void run(const CarveArgs& args, const Console& console) {
    check_output(args, console);
    CleanSettings cleaning = clean_settings(args);
    const bool meshed = !args.tiles.tiles && !is_vdb(args.out);
    const Solid base = read_solid(args.base, console, meshed ? Surfaces::wanted : Surfaces::none);
    if (!args.min_neck.empty())
        cleaning.min_neck_m = length_m("--min-neck", args.min_neck, base.measure);
    cleaning.foot_deg = args.foot_deg;
    check_clean_settings(cleaning);
    const LawHoles holes = read_or_place(args, base, console);
    const std::string recipe =
        format_recipe(clean_node(difference_node(base.node, holes.node), cleaning),
                      base.measure.voxel_m, args.placement.seed.value_or(0),
                      meshed ? args.surface.lod(args.out, base.measure) : std::nullopt);
    if (args.tiles.tiles)
        return write_carved_tiles(args, base, holes, {*args.tiles.tiles, cleaning}, recipe,
                                  console);
    refuse_if_too_much(args, base, holes, console);
    report_stage(console.progress, "carving");
    const CarveResult rock = carve(*base.grid, holes.placed.holes, console.progress);
    const CarvedVolume carved = carved_volume(*base.grid, *rock.rock);
    report_stage(console.progress, "cleaning");
    const CleanResult cleaned = clean(*rock.rock, cleaning, console.progress);
    const std::size_t n_missed = count_missing(holes.placed.holes, *base.grid);
    tell(args, holes, rock.n_unresolved, carved, cleaned, n_missed, console);
    const auto field = cleaned_field(carved_field(base, holes), cleaned);
    auto json = write_solid(args.out, *cleaned.solid, field.get(), recipe,
                            args.surface.settings(base.measure), console);
    json["holes"] = holes.placed.holes.size();
    json["unresolved"] = rock.n_unresolved;
    json["base_m3"] = carved.base_m3;
    json["removed_m3"] = carved.removed_m3;
    json["missed"] = n_missed;
    json["porosity"] = carved.porosity();
    json["porosity_cleaned"] = final_porosity(carved, cleaned);
    json["necked"] = cleaned.n_necked;
    json["necked_m3"] = cleaned.necked_m3;
    if (cleaned.foot)
        json["foot"] = {{"cut_m", cleaned.foot->cut_m},
                        {"cut_m3", cleaned.foot_m3},
                        {"contact_m2", cleaned.foot->contact_m2},
                        {"tilt_deg", cleaned.foot->tilt_deg}};
    json["pieces"] = cleaned.n_pieces;
    json["pieces_removed"] = cleaned.n_pieces_removed;
    json["pieces_removed_m3"] = cleaned.removed_m3;
    json["bubbles"] = cleaned.n_bubbles;
    json["bubbles_filled"] = cleaned.n_bubbles_filled;
    json["bubbles_filled_m3"] = cleaned.filled_m3;
    json["found"] = base.found;
    console.result(json);
}

} // namespace

void add_carve(CLI::App& app, Console& console) {
    auto args = std::make_shared<CarveArgs>();
    auto* verb = console.verb(
        app, "carve", "Subtract holes from a base: a table of them, or a law placed in it",
        "  taihu carve base.vdb --holes holes.csv -o rock.vdb\n"
        "  taihu carve bunny.obj --holes law.json --scale 25% --porosity 0.25 --dim 256 -o "
        "rock.glb\n"
        "  taihu carve base.vdb --holes law.json --scale 20% --porosity 0.2 --pattern joints -o "
        "rock.glb\n"
        "  taihu carve base.vdb --holes holes.csv --pieces all -o rock.ply --json");
    verb->add_option("base", args->base.path, "Solid to carve (.vdb, or a mesh to voxelize)")
        ->required();
    verb->add_option("--holes", args->holes, "Table x_m,y_m,z_m,radius_m (.csv) or a law (.json)")
        ->required();
    verb->add_option("-o,--output", args->out,
                     "Where to write it (.vdb .obj .ply .stl .off .glb .drc)")
        ->required();
    args->placement.add_options(*verb);
    verb->add_option("--pieces", args->pieces, "Keep the largest, all, or this many pieces")
        ->capture_default_str();
    verb->add_option("--bubbles", args->bubbles, "Voids that no way leads to: fill or keep")
        ->check(CLI::IsMember({"fill", "keep"}))
        ->capture_default_str();
    verb->add_option("--min-neck", args->min_neck,
                     "Parts that hang on by thinner necks alone are pieces of their own: 5mm, "
                     "3vox or 2% [off]");
    verb->add_option("--foot", args->foot_deg,
                     "Cut flat below, so that it stands tilted by up to this many degrees, 0..60 "
                     "[not cut]")
        ->check(CLI::Range(0.0, 60.0));
    args->base.add_voxel_options(*verb);
    args->surface.add_options(*verb);
    args->tiles.add_option(*verb);
    verb->callback([args, &console] { console.within_limits([&] { run(*args, console); }); });
}

} // namespace taihu
