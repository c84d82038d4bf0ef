// taihu measure: numbers of a solid or a mesh.
#include "mesh_out/measure.h"

#include "mesh_out/certificate.h"
#include "mesh_out/extract.h"
#include "stats/boolean_model.h"
#include "stats/core/error.h"
#include "stats/io/law_file.h"
#include "tools/solid_files.h"
#include "vdb_ops/vdb_file.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

struct MeasureArgs {
    SolidOptions file;
    std::filesystem::path base, law;
    std::string scale;
    std::optional<double> density;
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

/// What holes of a law would make of the rock, thrown at random.
nlohmann::ordered_json predict(const MeasureArgs& args, const Console& console) {
    const LawFile file = read_law_file(args.law);
    const std::string where = args.law.string();
    if (args.scale.empty() && file.unit != LengthUnit::metre)
        throw Error(Fault::bad_argument, where + ": the law's unit is '" +
                                             std::string(unit_name(file.unit)) +
                                             "'; say how long one unit is, as --scale 0.4m");
    const double scale = args.scale.empty() ? 1 : length_m("--scale", args.scale);
    if (!args.density && !file.n_v)
        throw Error(Fault::bad_argument,
                    where + ": the law has no n_v; give --density, in holes per m^3");
    const double n_v = args.density ? *args.density : file.n_v->estimate / (scale * scale * scale);
    const Law law = scaled(file.law, scale);
    const BooleanModel model = boolean_model(law, n_v);
    const auto sponge = sponge_porosity(law);
    console.say("{}: predicted: porosity {:.4f}, hole surface {:.4g} m^2 per m^3, holes cover "
                "{:.4f} of a section and have outlines of {:.4g} m per m^2 there",
                where, model.porosity, model.s_v, model.a_a, model.l_a);
    if (sponge)
        console.say("{}: {} at a porosity of {:.3f}, where tunnels outnumber holes", where,
                    model.porosity > *sponge ? "a sponge; it became one" : "it becomes a sponge",
                    *sponge);
    return {{"n_v_m3", n_v},
            {"porosity", model.porosity},
            {"s_v_m1", model.s_v},
            {"m_v_m2", model.m_v},
            {"chi_v_m3", model.chi_v},
            {"a_a", model.a_a},
            {"l_a_m1", model.l_a},
            {"chi_a_m2", model.chi_a},
            {"sponge_porosity", sponge ? nlohmann::ordered_json(*sponge) : nullptr}};
}

/// Surface of the holes / volume of the base: what is left of the base's own surface is taken to be
/// as large a share as is left of its volume.
double hole_surface_m1(const Measured& rock, const Measured& base) {
    const double left = rock.volume_m3 / base.volume_m3;
    return (rock.certificate.area_m2 - left * base.certificate.area_m2) / base.volume_m3;
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
        if (base->volume_m3 > 0) {
            const double s_v = hole_surface_m1(it, *base);
            json["s_v_base_m1"] = s_v;
            console.say("{}: porosity {:.4f} of {}, hole surface {:.4g} m^2 per m^3", where,
                        1 - it.volume_m3 / base->volume_m3, args.base.string(), s_v);
        }
    }
    if (!args.law.empty())
        json["predicted"] = predict(args, console);
    console.result(json);
}

} // namespace

void add_measure(CLI::App& app, Console& console) {
    auto args = std::make_shared<MeasureArgs>();
    auto* verb = console.verb(app, "measure",
                              "Print volume, area, box, pieces, genus and porosity of a solid",
                              "  taihu measure rock.vdb --base base.vdb\n"
                              "  taihu measure rock.vdb --base base.vdb --law law.json\n"
                              "  taihu measure rock.glb --json | jq .porosity_hull");
    verb->add_option("file", args->file.path, "What to measure (.vdb .obj .ply .stl .off .glb)")
        ->required();
    verb->add_option("--base", args->base, "Solid before carving, for porosity (.vdb or a mesh)");
    auto* law = verb->add_option(
        "--law", args->law, "Say what holes of this law (.json), thrown at random, would make");
    verb->add_option("--scale", args->scale,
                     "Length of one unit of the law, 0.4m; needed unless it is in metres")
        ->needs(law);
    verb->add_option("--density", args->density, "Hole centres per m^3 [the law's own n_v]")
        ->check(CLI::PositiveNumber)
        ->needs(law);
    args->file.add_mesh_options(*verb);
    verb->callback([args, &console] { console.with_threads([&] { run(*args, console); }); });
}

} // namespace taihu
