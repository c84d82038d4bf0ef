// taihu measure: numbers of a solid or a mesh.
#include "mesh_out/measure.h"

#include "mesh_out/certificate.h"
#include "mesh_out/extract.h"
#include "tools/solid_files.h"
#include "vdb_ops/vdb_file.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

struct MeasureArgs {
    SolidOptions file;
    std::filesystem::path base;
};

/// A file as a surface; a level set also has a volume of its own, which does not depend on a
/// mesher.
struct Measured {
    TriMesh mesh;
    Certificate certificate;
    double volume_m3 = 0;
};

Measured measured(const SolidOptions& options, const std::filesystem::path& path,
                  const Console& console) {
    Measured m;
    if (is_vdb(path)) {
        const VdbFile file = read_vdb(path);
        m.mesh = extract_uniform(*file.solid, console.progress);
        m.volume_m3 = volume_m3(*file.solid);
    } else {
        m.mesh = read_mesh(path, options.mesh_settings(), console.progress).levels.front();
        m.volume_m3 = signed_volume_m3(m.mesh);
    }
    m.certificate = certify(m.mesh, {.self_intersections = false});
    if (!m.certificate.holds())
        console.say("{}: {}: volume, genus and porosity mean little", path.string(),
                    certificate_line(m.certificate));
    return m;
}

/// 1 - part / whole, or nothing where there is no whole.
nlohmann::ordered_json porosity(double part_m3, double whole_m3) {
    return whole_m3 > 0 ? nlohmann::ordered_json(1 - part_m3 / whole_m3) : nullptr;
}

void run(const MeasureArgs& args, const Console& console) {
    const std::string where = args.file.path.string();
    const Measured it = measured(args.file, args.file.path, console);
    std::optional<Measured> base;
    if (!args.base.empty())
        base = measured(args.file, args.base, console);
    report_stage(console.progress, "measuring");
    const Certificate& c = it.certificate;
    const double hull_m3 = hull_volume_m3(it.mesh);
    const Vec3 size = c.box.size();
    nlohmann::ordered_json json = {{"file", where},
                                   {"volume_m3", it.volume_m3},
                                   {"area_m2", c.area_m2},
                                   {"box_lo_m", {c.box.lo.x, c.box.lo.y, c.box.lo.z}},
                                   {"box_hi_m", {c.box.hi.x, c.box.hi.y, c.box.hi.z}},
                                   {"triangles", c.n_triangles},
                                   {"pieces", c.n_components - c.n_cavities},
                                   {"cavities", c.n_cavities},
                                   {"certified", c.holds()},
                                   {"genus", c.genus},
                                   {"hull_m3", hull_m3},
                                   {"porosity_hull", porosity(it.volume_m3, hull_m3)}};
    console.say("{}: volume {:.6g} m^3, area {:.6g} m^2, box {:.4g} x {:.4g} x {:.4g} m", where,
                it.volume_m3, c.area_m2, size.x, size.y, size.z);
    console.say("{}: pieces {}, sealed bubbles {}, genus {}", where, c.n_components - c.n_cavities,
                c.n_cavities, c.genus);
    if (hull_m3 > 0)
        console.say("{}: porosity {:.4f} of its hull", where, 1 - it.volume_m3 / hull_m3);
    if (base) {
        json["base_m3"] = base->volume_m3;
        json["porosity_base"] = porosity(it.volume_m3, base->volume_m3);
        if (base->volume_m3 > 0)
            console.say("{}: porosity {:.4f} of {}", where, 1 - it.volume_m3 / base->volume_m3,
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
    verb->callback([args, &console] { console.with_threads([&] { run(*args, console); }); });
}

} // namespace taihu
