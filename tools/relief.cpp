// taihu relief: height tiles of rough surfaces, and the roughness of photographs.
#include "vdb_ops/relief.h"

#include <algorithm>

#include "mesh_out/io/exr_file.h"
#include "mesh_out/io/image_file.h"
#include "stats/core/error.h"
#include "stats/core/file_set.h"
#include "stats/core/of_file.h"
#include "stats/core/text.h"
#include "stats/number_detail.h"
#include "tools/bump_files.h"
#include "tools/console.h"
#include "tools/units.h"
#include "vdb_ops/roughness.h"

namespace taihu {
namespace {

constexpr double kPresetSide = 0.512; // m: lengths of a preset are those of a tile of this side
constexpr double kMidpoint_bytes = 13, kRegions_bytes = 31; // a point, at the peak, as measured
constexpr const char* kRecipe = "taihu_relief";

struct ReliefArgs {
    std::string kind, pixel = "1mm", amplitude, radius, wavelength, phase, draws;
    std::string light_azimuth, light_elevation, as;
    std::optional<int> size, patches, regions, arms, colors;
    std::optional<double> hurst;
    std::optional<std::uint64_t> color_seed;
    std::uint64_t seed = 0;
    std::vector<std::string> corners;
    std::vector<int> patch;
    double ambient = 0;
    bool tileable = false;
    std::filesystem::path from, out, preview;
};

/// What is made, and how the preview lights it.
struct Plan {
    ReliefSettings settings;
    ReliefMaterial material;
    std::optional<double> departure_m; ///< of the photo at a lag of 8 pixels: what to scale to
};

/// Options that the law does not read are mistakes, not decoration.
void refuse_unused(ReliefLaw law, const std::string& kind, const CLI::App& verb) {
    const bool midpoint = is_midpoint(law);
    const bool spheres = law == ReliefLaw::convex || law == ReliefLaw::concave;
    const std::pair<const char*, bool> uses[] = {{"--hurst", midpoint},
                                                 {"--draws", law == ReliefLaw::fractal},
                                                 {"--patches", midpoint},
                                                 {"--corners", midpoint},
                                                 {"--regions", !midpoint},
                                                 {"--radius", spheres},
                                                 {"--wavelength", !midpoint && !spheres},
                                                 {"--phase", !midpoint && !spheres},
                                                 {"--arms", !midpoint && !spheres}};
    for (const auto& [option, used] : uses)
        if (!used && verb.get_option(option)->count() > 0)
            throw Error(Fault::bad_argument, "relief: " + kind + " has no " + option + "; drop it");
}

/// A preset at the size that was asked for, changed by the options that were given.
Plan plan_of(const ReliefArgs& args, const CLI::App& verb) {
    const ReliefPreset& preset = relief_preset(args.kind);
    Plan plan{preset.settings, preset.material, std::nullopt};
    ReliefSettings& s = plan.settings;
    refuse_unused(s.law, args.kind, verb);
    s.tileable = args.tileable;
    s.patches = args.patches.value_or(s.patches);
    s.size_px = args.size.value_or(args.tileable ? 512 : 513);
    s.pixel_m = length_m("--pixel", args.pixel);
    const double side_m = (s.size_px - !s.tileable) * s.pixel_m;
    const auto length = [&](const char* option, const std::string& text, double preset_m) {
        return text.empty() ? preset_m * side_m / kPresetSide
                            : length_m(option, text, {s.pixel_m, side_m});
    };
    s.amplitude_m = length("--amplitude", args.amplitude, s.amplitude_m);
    s.radius_m = length("--radius", args.radius, s.radius_m);
    s.wavelength_m = length("--wavelength", args.wavelength, s.wavelength_m);
    if (!args.phase.empty())
        s.phase_turns = angle_deg("--phase", args.phase) / 360;
    if (args.draws == "gaussian")
        s.draws = MidpointDraws::gaussian;
    for (const std::string& corner : args.corners) {
        const auto height = parse_number(corner);
        if (!height)
            throw Error(Fault::bad_argument, "--corners: '" + printable(corner) +
                                                 "' is no number; give heights in metres");
        s.corners_m.push_back(*height);
    }
    s.hurst = args.hurst.value_or(s.hurst);
    s.n_regions = args.regions.value_or(s.n_regions);
    s.arms = args.arms.value_or(s.arms);
    s.n_colors = args.colors.value_or(0);
    s.seed = args.seed;
    s.color_seed = args.color_seed.value_or(args.seed);
    return plan;
}

bool has_extension(const std::filesystem::path& path, const char* extension) {
    return path.extension() == extension;
}

/// Options beside those that a replay reads.
void refuse_beside(const CLI::App& verb, const std::string& what,
                   std::initializer_list<const char*> allowed) {
    for (const CLI::Option* option : verb.get_options())
        if (option->count() > 0 && option->get_group() != "Common options" &&
            std::none_of(allowed.begin(), allowed.end(),
                         [&](const char* name) { return option->check_name(name); }))
            throw Error(Fault::bad_argument,
                        "relief: " + option->get_name() + " is not for " + what + "; drop it");
}

/// The recipe in a tile's header or in a file of its own.
Plan replayed(const ReliefArgs& args, const CLI::App& verb) {
    refuse_beside(verb, "a tile made again", {"--from", "--output", "--preview"});
    std::string text;
    if (has_extension(args.from, ".json")) {
        text = read_file(args.from, std::size_t{1} << 24);
    } else {
        const std::vector<std::string> heights = {"Y"};
        for (const auto& [key, value] : read_exr(args.from, heights).attributes)
            if (key == kRecipe)
                text = value;
        if (text.empty())
            throw Error(Fault::bad_input, args.from.string() +
                                              ": carries no recipe of a relief; only tiles that "
                                              "taihu relief wrote do");
    }
    const ReliefSettings s = parse_relief(text, base_name(args.from));
    for (const ReliefPreset& p : relief_presets())
        if (p.settings.law == s.law)
            return {s, p.material, std::nullopt};
    return {s, {}, std::nullopt};
}

nlohmann::ordered_json json_of(const Bracketed& b) {
    return {{"estimate", b.value}, {"lo", b.lo}, {"hi", b.hi}};
}

nlohmann::ordered_json json_of(const Roughness& r) {
    return {{"hurst", json_of(r.hurst)},
            {"departure_m", json_of(r.departure_m)},
            {"lags_px", {r.first_lag_px, r.last_lag_px}}};
}

void tell(const std::string& where, const Roughness& r, const Console& console) {
    console.say(
        "{}: H {} (95 % interval {}..{}); a point departs by {} mm ({}..{}) from the mean of "
        "its neighbours a pixel of {} mm away, fitted at {} to {} pixels",
        where, rounded(r.hurst.value), rounded(r.hurst.lo), rounded(r.hurst.hi),
        rounded(1e3 * r.departure_m.value), rounded(1e3 * r.departure_m.lo),
        rounded(1e3 * r.departure_m.hi), rounded(1e3 * r.pixel_m), r.first_lag_px, r.last_lag_px);
}

PhotoRoughness look_at(const ReliefArgs& args, const Console& console) {
    Image photo = read_png(args.from);
    if (!args.patch.empty())
        photo = image_part(photo, args.patch[0], args.patch[1], args.patch[2], args.patch[3]);
    PhotoRoughnessSettings s;
    s.pixel_m = length_m("--pixel", args.pixel);
    s.ambient_share = args.ambient;
    if (!args.light_azimuth.empty())
        s.azimuth_deg = angle_deg("--light-azimuth", args.light_azimuth);
    if (!args.light_elevation.empty())
        s.elevation_deg = angle_deg("--light-elevation", args.light_elevation);
    const PhotoRoughness seen =
        of_file(args.from.string(), [&] { return photo_roughness(photo, s); });
    tell(args.from.string(), seen.roughness, console);
    console.say("{}: light from {} deg ({}) and {} deg above the stone; contrast along it {} times "
                "that across",
                args.from.string(), rounded(seen.azimuth_deg),
                s.azimuth_deg ? "given" : "or from the opposite side, estimated",
                rounded(s.elevation_deg), rounded(seen.one_sidedness));
    console.say("{}: assumes even colour, a matt surface, one light, a view from straight above, "
                "gentle slopes, no direction in the stone, and that pixel and elevation are right",
                args.from.string());
    console.say_all(args.from.string(), seen.doubts);
    return seen;
}

nlohmann::ordered_json photo_json(const ReliefArgs& args, const PhotoRoughness& seen) {
    nlohmann::ordered_json out = {{"file", base_name(args.from)}};
    out.update(json_of(seen.roughness));
    out["pixel_m"] = seen.roughness.pixel_m;
    out["light_azimuth_deg"] = seen.azimuth_deg;
    out["one_sidedness"] = seen.one_sidedness;
    out["clipped_share"] = seen.clipped_share;
    out["doubts"] = seen.doubts;
    return out;
}

/// A tile by Procedure 1 that is as rough as the photo.
Plan like_photo(const ReliefArgs& args, const PhotoRoughness& seen, const CLI::App& verb) {
    ReliefArgs copy = args;
    copy.kind = "fractal";
    copy.hurst = std::clamp(seen.roughness.hurst.value, 0.0, 2.0);
    copy.amplitude = "1m"; // and then scaled
    Plan plan = plan_of(copy, verb);
    plan.departure_m = seen.roughness.departure_at_m(8);
    return plan;
}

/// Tiles are linear in their amplitude when their corners are drawn.
void scale_to(double departure_m, ReliefSettings& settings, ReliefTile& tile,
              const Console& console) {
    const Roughness made = fit_roughness(tile.heights, tile.pixel_m, scale_px(settings));
    settings.amplitude_m *= departure_m / made.departure_at_m(8);
    tile = make_relief(settings, console.progress);
}

void write_tile(const std::filesystem::path& path, const ReliefSettings& settings,
                const ReliefTile& tile) {
    std::vector<const Image*> parts = {&tile.heights};
    ExrImage exr;
    exr.channels = {"Y"};
    if (tile.ids.width > 0) {
        parts.push_back(&tile.ids);
        exr.channels.push_back("region");
    }
    if (tile.color_ids.width > 0) {
        parts.push_back(&tile.color_ids);
        exr.channels.push_back("color_region");
    }
    const auto n = parts.size();
    exr.image = Image(tile.heights.width, tile.heights.height, static_cast<int>(n));
    for (std::size_t i = 0; i < tile.heights.pixels.size(); ++i)
        for (std::size_t c = 0; c < n; ++c)
            exr.image.pixels[n * i + c] = parts[c]->pixels[i];
    exr.attributes = {{kRecipe, format_relief(settings)},
                      {"Y_unit", "m"},
                      {"pixel_m", shortest(settings.pixel_m)},
                      {"wrap", settings.tileable ? "periodic" : "none"}};
    write_exr(path, exr);
}

nlohmann::ordered_json make_tile(const ReliefArgs& args, Plan plan, const Console& console) {
    const double side_px = plan.settings.size_px;
    console.require_memory(side_px * side_px,
                           is_midpoint(plan.settings.law) ? kMidpoint_bytes : kRegions_bytes,
                           "give a smaller --size");
    ReliefTile tile = make_relief(plan.settings, console.progress);
    if (plan.departure_m)
        scale_to(*plan.departure_m, plan.settings, tile, console);
    const ReliefSettings& s = plan.settings;
    FileSet output(args.out.parent_path()); // of one file, whatever else is in its folder
    output.add_by([&](const std::filesystem::path& folder) {
        write_tile(folder / args.out.filename(), s, tile);
    });
    std::optional<FileSet> preview;
    if (!args.preview.empty()) {
        preview.emplace(args.preview.parent_path());
        preview->add_by([&](const std::filesystem::path& folder) {
            write_image(folder / args.preview.filename(), relief_picture(tile, plan.material));
        });
    }
    const Publishing together;
    check_cancelled(console.progress);
    output.publish(args.out.filename());
    if (preview)
        preview->publish(args.preview.filename());
    const auto [lo, hi] =
        std::minmax_element(tile.heights.pixels.begin(), tile.heights.pixels.end());
    const std::string where = args.out.string();
    console.say("{}: {} x {} points every {} mm{}, heights {} to {} mm", where, s.size_px,
                s.size_px, rounded(1e3 * s.pixel_m), s.tileable ? ", tileable" : "",
                rounded(1e3 * *lo), rounded(1e3 * *hi));
    nlohmann::ordered_json json = {{"file", where},
                                   {"size_px", s.size_px},
                                   {"pixel_m", s.pixel_m},
                                   {"tileable", s.tileable},
                                   {"seed", s.seed},
                                   {"lowest_m", *lo},
                                   {"highest_m", *hi},
                                   {"roughness", nullptr},
                                   {"recipe", nlohmann::ordered_json::parse(format_relief(s))}};
    if (scale_px(s) >= 32 && *hi > *lo) {
        const Roughness fitted = fit_roughness(tile.heights, s.pixel_m, scale_px(s));
        tell(where, fitted, console);
        json["roughness"] = json_of(fitted);
    }
    if (!args.preview.empty()) {
        console.say("{}: lit from the upper left", args.preview.string());
        json["preview"] = args.preview.string();
    }
    return json;
}

void run(const ReliefArgs& args, const CLI::App& verb, const Console& console) {
    if (args.kind.empty() == args.from.empty())
        throw Error(Fault::bad_argument,
                    "relief: say what to make: a kind, as broken-rock, or --from FILE, not both");
    const bool photo = has_extension(args.from, ".png");
    if (!args.from.empty() && !photo && !has_extension(args.from, ".exr") &&
        !has_extension(args.from, ".json"))
        throw Error(Fault::unsupported,
                    args.from.string() + ": --from takes a photo (.png), or a tile (.exr) or its "
                                         "recipe (.json) to make again");
    if (args.out.empty() && (!photo || !args.preview.empty()))
        throw Error(Fault::bad_argument, "relief: nothing to write; give -o tile.exr");
    if (!photo)
        for (const char* option : {"--patch", "--light-azimuth", "--light-elevation", "--ambient"})
            if (verb.get_option(option)->count() > 0)
                throw Error(Fault::bad_argument,
                            std::string("relief: ") + option + " is for --from PHOTO.png; drop it");
    if (!args.out.empty()) {
        if (!has_extension(args.out, ".exr"))
            throw Error(Fault::unsupported,
                        args.out.string() + ": tiles are 32-bit .exr; --preview writes a .png");
        console.may_write(args.out, {args.from});
    }
    if (!args.preview.empty())
        console.may_write(args.preview, {args.out, args.from});
    if (!args.as.empty()) {
        if (!has_extension(args.from, ".exr"))
            throw Error(Fault::bad_argument, "relief: --as is for --from TILE.exr; drop it");
        refuse_beside(verb, "a map written the other way", {"--from", "--output", "--as"});
        return console.result(
            convert_bumps(args.from, args.out,
                          args.as == "offsets" ? BumpForm::offsets : BumpForm::heights, console));
    }
    if (!photo)
        return console.result(make_tile(
            args, args.from.empty() ? plan_of(args, verb) : replayed(args, verb), console));
    refuse_beside(verb, "a photo",
                  {"--from", "--output", "--preview", "--size", "--pixel", "--tileable",
                   "--patches", "--seed", "--patch", "--light-azimuth", "--light-elevation",
                   "--ambient"});
    const PhotoRoughness seen = look_at(args, console);
    nlohmann::ordered_json json = {{"photo", photo_json(args, seen)}};
    if (!args.out.empty())
        json.update(make_tile(args, like_photo(args, seen, verb), console));
    console.result(json);
}

void add_tile_options(CLI::App& verb, ReliefArgs& args) {
    verb.add_option("--size", args.size,
                    "Points along each side, 2..8193 [513; 512 with --tileable]")
        ->check(CLI::Range(2, 8193));
    verb.add_option("--pixel", args.pixel, "Distance of two points, or a pixel on the photo")
        ->capture_default_str();
    verb.add_option("--amplitude", args.amplitude,
                    "Height: of the first displacement (fractals), by which corners differ "
                    "(casting), of half spheres or crests: 2mm, or 5% of the side [by kind]");
    verb.add_flag("--tileable", args.tileable,
                  "Without seams: the right edge continues at the left");
    verb.add_option("--seed", args.seed, "Which of them")
        ->check(CLI::Range(0.0, 9.2e18))
        ->capture_default_str();
    verb.add_option("--hurst", args.hurst,
                    "fractals, casting: h, 0..2; the smaller the rougher [by kind]")
        ->check(CLI::Range(0.0, 2.0));
    verb.add_option("--draws", args.draws, "fractals: uniform or gaussian [uniform]")
        ->check(CLI::IsMember({"uniform", "gaussian"}));
    verb.add_option("--patches", args.patches,
                    "fractals, casting: patches along each side, 1..4096 [by kind]")
        ->check(CLI::Range(1, 4096));
    verb.add_option("--corners", args.corners,
                    "fractals, casting: heights of the corners of patches, row by row [m] [random]")
        ->delimiter(',')
        ->allow_extra_args(false);
    verb.add_option("--regions", args.regions, "Other kinds: number of subregions, 1..100000 [60]")
        ->check(CLI::Range(1, 100'000));
    verb.add_option("--radius", args.radius,
                    "convex, concave: of half spheres [such that they cover the tile]");
    verb.add_option("--wavelength", args.wavelength,
                    "sinusoids: from crest to crest [4% of the side]");
    verb.add_option("--phase", args.phase, "sinusoids: in the centres: 90deg [0deg]");
    verb.add_option("--arms", args.arms, "sinusoids: 0 rings, else spirals, -64..64 [0]")
        ->check(CLI::Range(-64, 64));
    auto* colors = verb.add_option("--colors", args.colors,
                                   "Colour subregions of their own, up to 100000 [none]")
                       ->check(CLI::Range(1, 100'000));
    verb.add_option("--color-seed", args.color_seed, "Of the colour subregions [that of --seed]")
        ->check(CLI::Range(0.0, 9.2e18))
        ->needs(colors);
}

void add_photo_options(CLI::App& verb, ReliefArgs& args) {
    const std::string group = "Photos";
    verb.add_option("--patch", args.patch, "The part to look at, X,Y,WIDTH,HEIGHT [pixels] [all]")
        ->delimiter(',')
        ->expected(4)
        ->group(group);
    verb.add_option("--light-azimuth", args.light_azimuth,
                    "Where the light comes from, from the right anticlockwise: 135deg [estimated]")
        ->group(group);
    verb.add_option("--light-elevation", args.light_elevation,
                    "Of the light above the stone, 5..85 [45deg]")
        ->group(group);
    verb.add_option("--ambient", args.ambient,
                    "Share of the brightness that does not come from that light, 0..0.9")
        ->check(CLI::Range(0.0, 0.9))
        ->capture_default_str()
        ->group(group);
}

} // namespace

void add_relief(CLI::App& app, Console& console) {
    auto args = std::make_shared<ReliefArgs>();
    auto* verb = console.verb(
        app, "relief", "Make a height tile of a rough surface, or measure roughness on a photo",
        "  taihu relief broken-rock --hurst 0.3 --seed 7 -o rock.exr --preview rock.png\n"
        "  taihu relief casting --tileable --size 1024 --pixel 0.2mm -o cast.exr\n"
        "  taihu relief sinusoid --arms 2 --colors 30 -o waves.exr --preview waves.png\n"
        "  taihu relief --from photo.png --patch 400,300,512,512 --pixel 0.1mm --json\n"
        "  taihu relief --from photo.png --pixel 0.1mm -o alike.exr\n"
        "  taihu relief --from rock.exr -o again.exr\n"
        "  taihu relief --from rock.exr --as offsets -o bumps.exr");
    verb->add_option("kind", args->kind,
                     "fractal, broken-rock, unglazed-china, casting, convex, concave, sinusoid or "
                     "modified-sinusoid");
    verb->add_option("-o,--output", args->out, "Tile to write: heights in metres (.exr)");
    verb->add_option("--preview", args->preview, "Picture of the lit tile (.png or .exr)");
    verb->add_option("--from", args->from,
                     "A photo (.png): its roughness, and with -o a tile as rough; or a tile (.exr) "
                     "or its recipe (.json), made again");
    verb->add_option("--as", args->as,
                     "With --from TILE.exr: offsets, its heights (channel Y) as differences to the "
                     "right and up (u, v), or heights, those back")
        ->check(CLI::IsMember({"heights", "offsets"}));
    add_tile_options(*verb, *args);
    add_photo_options(*verb, *args);
    verb->callback(
        [args, verb, &console] { console.within_limits([&] { run(*args, *verb, console); }); });
}

} // namespace taihu
