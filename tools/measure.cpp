// taihu measure: numbers of a solid or a mesh.
#include "mesh_out/measure.h"

#include "mesh_out/certificate.h"
#include "mesh_out/extract.h"
#include "tools/solid_files.h"
#include "vdb_ops/vdb_file.h"

namespace taihu {
namespace {

struct MeasureArgs {
    SolidOptions file;
    std::filesystem::path base;
};

TriMesh surface_of(const SolidOptions& options, const std::filesystem::path& path,
                   const Console& console) {
    if (is_vdb(path))
        return extract_uniform(*read_vdb(path).solid, console.progress);
    return read_mesh(path, options.mesh_settings(), console.progress).levels.front();
}

void run(const MeasureArgs& args, const Console& console) {
    const std::string where = args.file.path.string();
    const TriMesh mesh = surface_of(args.file, args.file.path, console);
    report_stage(console.progress, "measuring");
    const Certificate c = certify(mesh, {.self_intersections = false});
    const double hull_m3 = hull_volume_m3(mesh);
    const Vec3 size = c.box.size();
    nlohmann::ordered_json json = {{"file", where},
                                   {"volume_m3", c.volume_m3},
                                   {"area_m2", c.area_m2},
                                   {"box_lo_m", {c.box.lo.x, c.box.lo.y, c.box.lo.z}},
                                   {"box_hi_m", {c.box.hi.x, c.box.hi.y, c.box.hi.z}},
                                   {"triangles", c.n_triangles},
                                   {"components", c.n_components},
                                   {"cavities", c.n_cavities},
                                   {"closed", c.closed()},
                                   {"genus", c.genus},
                                   {"hull_m3", hull_m3},
                                   {"porosity_hull", 1 - c.volume_m3 / hull_m3}};
    console.say("{}: volume {:.6g} m^3, area {:.6g} m^2, box {:.4g} x {:.4g} x {:.4g} m", where,
                c.volume_m3, c.area_m2, size.x, size.y, size.z);
    console.say("{}: {} pieces and {} cavities, genus {}, porosity {:.4f} of its hull", where,
                c.n_components - c.n_cavities, c.n_cavities, c.genus, 1 - c.volume_m3 / hull_m3);
    if (!c.closed())
        console.say("{}: open ({} boundary edges): volume, genus and porosity mean little", where,
                    c.n_boundary_edges);
    if (!args.base.empty()) {
        const double base_m3 = signed_volume_m3(surface_of(args.file, args.base, console));
        json["base_m3"] = base_m3;
        json["porosity_base"] = 1 - c.volume_m3 / base_m3;
        console.say("{}: porosity {:.4f} of {}", where, 1 - c.volume_m3 / base_m3,
                    args.base.string());
    }
    console.result(json);
}

} // namespace

void add_measure(CLI::App& app, Console& console) {
    auto args = std::make_shared<MeasureArgs>();
    auto* verb = console.verb(app, "measure",
                              "Print volume, area, box, pieces, genus and porosity of a solid",
                              "  taihu measure rock.vdb --base base.vdb\n"
                              "  taihu measure rock.glb --json | jq .porosity_hull");
    verb->add_option("file", args->file.path, "What to measure (.vdb .obj .ply .stl .off .glb)")
        ->required();
    verb->add_option("--base", args->base, "Solid before carving, for porosity (.vdb or a mesh)");
    args->file.add_mesh_options(*verb);
    verb->callback([args, &console] { run(*args, console); });
}

} // namespace taihu
