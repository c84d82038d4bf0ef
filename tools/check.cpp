// taihu check: the certificate of a file, from the file itself.
#include "mesh_out/certificate.h"
#include "mesh_out/extract.h"
#include "mesh_out/field_distance.h"
#include "mesh_out/surface_distance.h"
#include "stats/core/error.h"
#include "stats/core/of_file.h"
#include "tools/solid_files.h"
#include "vdb_ops/placed_level_set_field.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

constexpr double kFar = 1e300; ///< nothing is beyond

struct CheckArgs {
    SolidOptions file;
    std::filesystem::path against;
    std::string within;
};

/// What distances are measured to.
struct Reference {
    TriMesh mesh;
    std::unique_ptr<const FieldProbe> probe = {}; ///< of a level set
    Solid solid = {};
    double spacing_m = 0;                ///< of the samples
    std::optional<double> within_m = {}; ///< farther is a no
};

MeshFile content(const SolidOptions& options, const Console& console) {
    if (!is_vdb(options.path))
        return read_mesh(options.path, options.mesh_settings(), console.progress);
    MeshFile file;
    file.levels = {extract_uniform(*read_level_set(options.path, console), console.progress)};
    return file;
}

/// The finest level of a mesh, or the surface of a level set.
std::optional<Reference> reference(const CheckArgs& args, const Console& console) {
    constexpr double kSamples = 1000; // along the longest side of a mesh, which has no voxels
    if (args.against.empty()) {
        if (!args.within.empty())
            throw Error(Fault::bad_argument, "--within: of what? name a file with --against");
        return std::nullopt;
    }
    check_solid_path(args.against);
    Reference to;
    Measure measure;
    if (is_vdb(args.against)) {
        SolidOptions options;
        options.path = args.against;
        to.solid = read_solid(options, console, Surfaces::wanted);
        if (!to.solid.field)
            to.solid.field = std::make_shared<PlacedLevelSetField>(to.solid.grid);
        const LabelledMesh sharp =
            extract(*to.solid.grid, to.solid.field.get(), {}, console.progress);
        to.mesh = {sharp.positions, sharp.triangles, {}};
        measure = to.solid.measure;
        to.spacing_m = measure.voxel_m / 2;
        const double reach_m = 8 * measure.voxel_m;
        to.probe = to.solid.field->probe(bounds(to.mesh).dilated(reach_m), reach_m);
    } else {
        MeshFile file = read_mesh(args.against, args.file.mesh_settings(), console.progress);
        to.mesh = std::move(file.levels.front());
        measure.longest_m = bounds(to.mesh).longest();
        to.spacing_m = measure.longest_m / kSamples;
    }
    if (!args.within.empty())
        to.within_m = length_m("--within", args.within, measure);
    return to;
}

FieldDistance as_field(const TwoSidedDistance& d) {
    FieldDistance out;
    out.max_m = d.max_m;
    out.max_to_field_m = d.max_a_to_b_m;
    out.max_from_field_m = d.max_b_to_a_m;
    out.rms_m = d.rms_m;
    out.n_samples = d.n_samples;
    return out;
}

/// Farther than --within is a no.
bool tell_distance(const TriMesh& level, const Reference& to, const std::string& where,
                   const std::filesystem::path& against, const Console& console,
                   nlohmann::ordered_json& json) {
    report_stage(console.progress, "measuring");
    const FieldDistance d = to.probe ? field_distance(level, *to.probe, to.mesh, to.spacing_m, kFar)
                                     : as_field(of_file(where, [&] {
                                           return two_sided_distance(level, to.mesh, to.spacing_m);
                                       }));
    const bool near = !to.within_m || d.max_m <= *to.within_m;
    json["distance"] = {{"against", against.string()},
                        {"max_m", d.max_m},
                        {"max_to_reference_m", d.max_to_field_m},
                        {"max_from_reference_m", d.max_from_field_m},
                        {"rms_m", d.rms_m},
                        {"samples", d.n_samples}};
    console.say("{}: {}{:.3g} m from {} at most ({:.3g} m there, {:.3g} m back), rms {:.3g} m",
                where, near ? "" : "NO: ", d.max_m, against.string(), d.max_to_field_m,
                d.max_from_field_m, d.rms_m);
    return near;
}

void run(const CheckArgs& args, const Console& console) {
    const std::string where = args.file.path.string();
    const std::optional<Reference> to = reference(args, console);
    const MeshFile file = content(args.file, console);
    const std::vector<TriMesh>& levels = file.levels;
    bool holds = file.n_degenerate_faces == 0;
    if (!holds)
        console.say("{}: NO: {} faces without three different corners", where,
                    file.n_degenerate_faces);
    nlohmann::ordered_json json = {{"file", where},
                                   {"holds", holds},
                                   {"faces_without_three_corners", file.n_degenerate_faces},
                                   {"levels", nlohmann::ordered_json::array()}};
    for (std::size_t j = 0; j < levels.size(); ++j) {
        report_stage(console.progress, "checking");
        const Certificate c = certify(levels[j]);
        holds = holds && c.holds();
        json["levels"].push_back(certificate_json(c));
        const std::string level =
            where + (levels.size() > 1 ? fmt::format(": level {}", j) : std::string());
        console.say("{}: {}{}", level, c.holds() ? "" : "NO: ", certificate_line(c));
        if (to)
            holds = tell_distance(levels[j], *to, level, args.against, console,
                                  json["levels"].back()) &&
                    holds;
    }
    json["holds"] = holds;
    console.result(json);
    if (!holds)
        throw CLI::RuntimeError(kSaysNo);
}

} // namespace

void add_check(CLI::App& app, Console& console) {
    auto args = std::make_shared<CheckArgs>();
    auto* verb = console.verb(
        app, "check", "Say whether a file holds closed, manifold, outward surfaces (exit 3 if not)",
        "  taihu check rock.glb\n"
        "  taihu check rock.glb --against rock.vdb --within 1vox\n"
        "  taihu check scan.stl --json | jq .levels[0].boundary_edges");
    verb->add_option("file", args->file.path, "File to check (.vdb .obj .ply .stl .off .glb .drc)")
        ->required();
    verb->add_option("--against", args->against,
                     "Measure the distance to this solid or mesh, both ways");
    verb->add_option("--within", args->within, "and say no when it is more: 0.5vox, 2mm, 1%");
    args->file.add_mesh_options(*verb);
    verb->callback([args, &console] { console.within_limits([&] { run(*args, console); }); });
}

} // namespace taihu
