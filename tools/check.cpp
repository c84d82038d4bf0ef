// taihu check: the certificate of a file, from the file itself.
#include "mesh_out/certificate.h"
#include "mesh_out/extract.h"
#include "stats/core/error.h"
#include "tools/solid_files.h"
#include "vdb_ops/vdb_file.h"

namespace taihu {
namespace {

MeshFile content(const SolidOptions& options, const Console& console) {
    if (!is_vdb(options.path))
        return read_mesh(options.path, options.mesh_settings(), console.progress);
    MeshFile file;
    file.levels = {extract_uniform(*read_solid_vdb(options.path).solid, console.progress)};
    return file;
}

void run(const SolidOptions& options, const Console& console) {
    const std::string where = options.path.string();
    const MeshFile file = content(options, console);
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
        console.say("{}: {}{}{}", where, levels.size() > 1 ? fmt::format("level {}: ", j) : "",
                    c.holds() ? "" : "NO: ", certificate_line(c));
    }
    json["holds"] = holds;
    console.result(json);
    if (!holds)
        throw CLI::RuntimeError(kSaysNo);
}

} // namespace

void add_check(CLI::App& app, Console& console) {
    auto args = std::make_shared<SolidOptions>();
    auto* verb = console.verb(
        app, "check", "Say whether a file holds closed, manifold, outward surfaces (exit 3 if not)",
        "  taihu check rock.glb\n"
        "  taihu check scan.stl --json | jq .levels[0].boundary_edges");
    verb->add_option("file", args->path, "File to check (.vdb .obj .ply .stl .off .glb)")
        ->required();
    args->add_mesh_options(*verb);
    verb->callback([args, &console] { console.with_threads([&] { run(*args, console); }); });
}

} // namespace taihu
