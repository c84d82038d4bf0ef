#include "tools/level_files.h"

#include <cmath>
#include <numbers>

#include "mesh_out/io/mesh_file.h"
#include "mesh_out/lod.h"
#include "stats/core/error.h"
#include "stats/core/file_set.h"
#include "stats/core/sha256.h"
#include "tools/solid_files.h"

namespace taihu {
namespace {

constexpr double kScreenHeight_px = 1080;
constexpr const char* kManifest = "manifest.json";

template <class Number>
void require_falling(const std::string& option, const std::vector<Number>& numbers) {
    for (std::size_t j = 1; j < numbers.size(); ++j)
        if (!(numbers[j] < numbers[j - 1]))
            throw Error(Fault::bad_argument, option + ": " + fmt::format("{}", numbers[j]) +
                                                 " after " + fmt::format("{}", numbers[j - 1]) +
                                                 ", must fall; the finest level comes first");
}

std::string level_name(std::size_t j) {
    return fmt::format("level{}.glb", j);
}

nlohmann::ordered_json file_json(const std::string& name, const std::string& bytes) {
    return {{"file", name}, {"sha256", sha256_hex(bytes)}, {"bytes", bytes.size()}};
}

/// Where each level takes over: at the distance from which its error is below a pixel of a screen
/// of 1080 lines.
nlohmann::ordered_json manifest_level(const LodChain& chain, std::size_t j, double fov_deg) {
    const LodLevel& level = chain.levels[j];
    const double pixels_per_m = // of something 1 m high, 1 m away
        kScreenHeight_px / (2 * std::tan(fov_deg * std::numbers::pi / 360));
    return {{"triangles", level.certificate.n_triangles},
            {"bound_m", level.bound_m},
            {"error_m", level.error_m},
            {"from_m", j == 0 ? 0 : level.error_m * pixels_per_m}};
}

/// All in the folder, the manifest as the last; the report too, where that is its place.
void write_split(const LevelFiles& files, const LodChain& chain, const GlbSettings& settings,
                 const std::string& report, const Progress* progress) {
    nlohmann::ordered_json manifest = {{"taihu_manifest", 1},
                                       {"fov_deg", files.fov_deg},
                                       {"screen_height_px", kScreenHeight_px},
                                       {"levels", nlohmann::ordered_json::array()}};
    FileSet set(files.out);
    for (std::size_t j = 0; j < chain.levels.size(); ++j) {
        EncodedLevel level = chain.levels[j].encoded;
        level.screen_coverage = 1;
        const std::string glb = format_glb(std::span(&level, 1), settings);
        set.add(level_name(j), glb);
        manifest["levels"].push_back(file_json(level_name(j), glb));
        manifest["levels"].back().update(manifest_level(chain, j, files.fov_deg));
    }
    OutputFiles apart;
    if (files.report.parent_path() == files.out) {
        const std::string name = files.report.filename().string();
        set.add(name, report);
        manifest["report"] = file_json(name, report);
    } else {
        apart.add(files.report, report);
    }
    set.add(kManifest, manifest.dump(2) + "\n");
    const Publishing together;
    check_cancelled(progress);
    set.publish(kManifest);
    apart.publish();
}

void tell(const LodChain& chain, const std::string& where, const Console& console) {
    for (std::size_t j = 0; j < chain.levels.size(); ++j) {
        const LodLevel& level = chain.levels[j];
        const Certificate& c = level.certificate;
        console.say(
            "{}: level {}: {} triangles, {} bytes, error {:.3g} m (bound {:.3g} m), genus {}, {} "
            "self-intersections",
            where, j, c.n_triangles, level.encoded.draco.size(), level.error_m, level.bound_m,
            c.genus, c.n_self_intersections);
        if (!level.closed.empty())
            console.say("{}: {} holes and ways too narrow for its bound closed: genus {} to {}, {} "
                        "to {} pieces",
                        where, level.closed.size(), chain.levels[0].certificate.genus, c.genus,
                        chain.levels[0].certificate.n_components, c.n_components);
        say_unresolved(where, level.unresolved.size(), level.unresolved_error_m, console);
    }
    say_unseen(where, chain.unseen.size(), console);
    if (!chain.note.empty())
        console.say("{}: {}", where, chain.note);
}

} // namespace

void LevelOptions::add_options(CLI::App& verb) {
    auto* number = verb.add_option("--levels", n_levels, "How many, finest first, 1..8")
                       ->check(CLI::Range(1, 8))
                       ->capture_default_str();
    auto* bound = verb.add_option("--max-error", max_error, "Error bound of the finest level")
                      ->capture_default_str();
    auto* by = verb.add_option("--factor", factor, "Each level's bound over the one before, > 1")
                   ->check(CLI::Range(1.01, 100.0))
                   ->capture_default_str();
    auto* counts = verb.add_option("--triangles", triangles,
                                   "or how many triangles each level has, as 20000,5000,1000")
                       ->delimiter(',')
                       ->expected(1, 8)
                       ->check(CLI::Range(4.0, 1e9));
    auto* heights = verb.add_option("--pixels", pixels,
                                    "or how high each is shown, as 400,100,25: off by a pixel")
                        ->delimiter(',')
                        ->expected(1, 8)
                        ->check(CLI::Range(2.0, 65536.0));
    for (auto* list : {counts, heights})
        list->excludes(number)->excludes(bound)->excludes(by);
    counts->excludes(heights);
    verb.add_flag("--no-ao", no_ao, "Without ambient occlusion in the vertex colours");
    verb.add_option("--origin", origin, "world, or foot: the middle of the box's underside")
        ->check(CLI::IsMember({"world", "foot"}))
        ->capture_default_str();
}

RecipeLod LevelOptions::lod(const Measure& measure, double height_m) const {
    RecipeLod lod;
    lod.openness = !no_ao;
    lod.at_foot = origin == "foot";
    require_falling("--triangles", triangles);
    require_falling("--pixels", pixels);
    lod.triangles = triangles;
    for (const double height_px : pixels)
        lod.bounds_m.push_back(height_m / height_px);
    if (triangles.empty() && pixels.empty())
        for (const LodGoal& goal :
             bounds_by_factor(n_levels, length_m("--max-error", max_error, measure), factor))
            lod.bounds_m.push_back(goal.bound_m);
    return lod;
}

void LevelFiles::add_options(CLI::App& verb) {
    auto* apart =
        verb.add_flag("--split", split,
                      "-o is a folder: a .glb for each level, and manifest.json with distances");
    verb.add_option("--fov", fov_deg, "with --split: upright field of view of the camera [deg]")
        ->check(CLI::Range(1.0, 170.0))
        ->needs(apart)
        ->capture_default_str();
    verb.add_option("--report", report, "Where to write the figures [report.json beside it]");
}

void LevelFiles::check(const std::filesystem::path& input, const Console& console) {
    if (split) {
        if (out.empty())
            throw Error(Fault::bad_argument, "-o: is empty; name a folder");
        if (!out.has_filename()) // without the slash at its end
            out = out.parent_path();
        if (out.has_extension())
            throw Error(Fault::bad_argument,
                        out.string() + ": --split writes a folder; name one without extension");
        if (!std::filesystem::is_directory(out))
            console.may_write(out, {input});
        for (std::size_t j = 0; std::filesystem::is_directory(out) && j < 8; ++j)
            console.may_write(out / level_name(j), {input});
    } else {
        if (mesh_format(out) != MeshFormat::glb)
            throw Error(Fault::unsupported, out.string() + ": levels go into a .glb; name one, or "
                                                           "a folder with --split");
        console.may_write(out, {input});
    }
    if (report.empty())
        report = (split ? out : out.parent_path()) / "report.json";
    if (report.parent_path() != out || std::filesystem::is_directory(out))
        console.may_write(report, {input, out});
}

nlohmann::ordered_json write_levels(const LevelFiles& files, const openvdb::FloatGrid& grid,
                                    const Field* field, const RecipeLod& lod,
                                    const std::string& recipe, const Console& console) {
    LodSettings settings;
    for (const double bound_m : lod.bounds_m)
        settings.levels.push_back({bound_m, 0});
    for (const std::uint64_t n : lod.triangles)
        settings.levels.push_back({0, n});
    settings.openness = lod.openness;
    const LodChain chain = make_lods(grid, field, settings, console.progress);
    GlbSettings glb{.recipe = recipe};
    if (lod.at_foot)
        glb.shift = foot_shift(chain.levels.front().certificate.box);
    const std::string report = format_report(chain, base_name(files.out));
    if (files.split) {
        write_split(files, chain, glb, report, console.progress);
    } else {
        OutputFiles outputs;
        outputs.add(files.out, format_glb(chain, glb));
        outputs.add(files.report, report);
        check_cancelled(console.progress);
        outputs.publish();
    }
    tell(chain, files.out.string(), console);
    if (!files.report.empty())
        console.say("{}: the figures of each level", files.report.string());
    return nlohmann::ordered_json::parse(report);
}

} // namespace taihu
