// taihu measure: numbers of a solid or a mesh.
#include "mesh_out/measure.h"

#include "mesh_out/certificate.h"
#include "mesh_out/extract.h"
#include "stats/boolean_model.h"
#include "stats/core/error.h"
#include "stats/core/of_file.h"
#include "stats/io/law_file.h"
#include "stats/number_detail.h"
#include "tools/measure_report.h"
#include "tools/solid_files.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

struct MeasureArgs {
    SolidOptions file;
    std::filesystem::path base, law;
    std::string scale;
    std::optional<double> density;
    bool pores = false, tradition = false;
    PoreSettings settings;
};

/// A file as a surface; a level set also has a volume of its own, which does not depend on a
/// mesher.
struct Measured {
    TriMesh mesh;
    Certificate certificate;
    double volume_m3 = 0;
    openvdb::FloatGrid::Ptr grid; ///< of a level set
};

Measured measured(const SolidOptions& options, const std::filesystem::path& path,
                  const Console& console) {
    Measured m;
    if (is_vdb(path)) {
        m.grid = read_level_set(path, console);
        m.mesh = extract_uniform(*m.grid, console.progress);
        m.volume_m3 = volume_m3(*m.grid);
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

Prediction predict(const MeasureArgs& args) {
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
    Prediction p;
    p.n_v_m3 = args.density ? *args.density : file.n_v->estimate / (scale * scale * scale);
    p.law = scaled(file.law, scale);
    p.model = boolean_model(p.law, p.n_v_m3);
    return p;
}

nlohmann::ordered_json prediction_json(const Prediction& p) {
    const auto sponge = sponge_porosity(p.law);
    return {{"n_v_m3", p.n_v_m3},
            {"porosity", p.model.porosity},
            {"s_v_m1", p.model.s_v},
            {"m_v_m2", p.model.m_v},
            {"chi_v_m3", p.model.chi_v},
            {"a_a", p.model.a_a},
            {"l_a_m1", p.model.l_a},
            {"chi_a_m2", p.model.chi_a},
            {"sponge_porosity", sponge ? nlohmann::ordered_json(*sponge) : nullptr}};
}

void say_prediction(const Prediction& p, const std::string& where, const Console& console) {
    console.say("{}: predicted: porosity {:.4f}, hole surface {:.4g} m^2 per m^3, holes cover "
                "{:.4f} of a section and have outlines of {:.4g} m per m^2 there",
                where, p.model.porosity, p.model.s_v, p.model.a_a, p.model.l_a);
    if (const auto sponge = sponge_porosity(p.law))
        console.say("{}: {} at a porosity of {:.3f}, where tunnels outnumber holes", where,
                    p.model.porosity > *sponge ? "a sponge; it became one" : "it becomes a sponge",
                    *sponge);
}

/// Surface of the holes / volume of the base: what is left of the base's own surface is taken to be
/// as large a share as is left of its volume.
double hole_surface_m1(const Measured& rock, const Measured& base) {
    const double left = rock.volume_m3 / base.volume_m3;
    return (rock.certificate.area_m2 - left * base.certificate.area_m2) / base.volume_m3;
}

/// A level set as it is, a mesh voxelized: as fine as the solid's when that is known.
openvdb::FloatGrid::Ptr level_set(const MeasureArgs& args, const std::filesystem::path& path,
                                  const Measured& known, const openvdb::FloatGrid* like,
                                  const Console& console) {
    if (known.grid)
        return known.grid;
    SolidOptions options = args.file;
    options.path = path;
    if (like) {
        options.dim.reset();
        options.voxel = shortest(lattice_of(*like).voxel_m) + "m";
    }
    return read_solid(options, console).grid;
}

/// What takes the solid as a level set.
void measure_inside(const MeasureArgs& args, const Measured& it, const Measured* base,
                    double hull_m3, const std::optional<Prediction>& prediction,
                    nlohmann::ordered_json& json, const Console& console) {
    const std::string where = args.file.path.string();
    const auto solid = level_set(args, args.file.path, it, nullptr, console);
    if (args.pores) {
        const auto whole = base ? level_set(args, args.base, *base, solid.get(), console) : nullptr;
        const PoreMeasures pores =
            measure_pores(*solid, whole.get(), args.settings, console.progress);
        json["pores"] = pores_json(pores);
        json["pores"]["lines"] = args.settings.n_lines;
        json["pores"]["seed"] = args.settings.seed;
        json["pores"]["euler_surface"] = it.certificate.euler;
        say_pores(pores, where, args.base.string(), console);
        console.say("{}: Euler characteristic of its surface mesh {}, half of which is the solid's",
                    where, it.certificate.euler);
        if (prediction) {
            json["compared"] = comparison_json(pores, *prediction);
            say_comparison(pores, *prediction, console);
        }
    }
    if (args.tradition) {
        const Tradition tradition = measure_tradition(*solid, hull_m3, console.progress);
        json["tradition"] = tradition_json(tradition);
        say_tradition(tradition, where, console);
    }
}

void check(const MeasureArgs& args) {
    const bool voxels = args.file.dim || !args.file.voxel.empty() || args.file.close;
    const bool mesh = !is_vdb(args.file.path);
    if (voxels && !(mesh && (args.pores || args.tradition)))
        throw Error(Fault::bad_argument,
                    args.file.path.string() +
                        ": nothing is voxelized here; drop --dim, --voxel and --close, or measure "
                        "a mesh with --pores or --tradition");
}

void run(const MeasureArgs& args, const Console& console) {
    check(args);
    const std::string where = args.file.path.string();
    std::optional<Prediction> prediction;
    if (!args.law.empty())
        prediction = predict(args);
    const Measured it = measured(args.file, args.file.path, console);
    std::optional<Measured> base;
    if (!args.base.empty())
        base = measured(args.file, args.base, console);
    report_stage(console.progress, "measuring");
    const Certificate& c = it.certificate;
    const double hull_m3 = of_file(where, [&] { return hull_volume_m3(it.mesh); });
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
    if (prediction) {
        json["predicted"] = prediction_json(*prediction);
        say_prediction(*prediction, args.law.string(), console);
    }
    if (args.pores || args.tradition)
        measure_inside(args, it, base ? &*base : nullptr, hull_m3, prediction, json, console);
    console.result(json);
}

} // namespace

void add_measure(CLI::App& app, Console& console) {
    auto args = std::make_shared<MeasureArgs>();
    auto* verb = console.verb(app, "measure",
                              "Print volume, area, box, pieces, genus and porosity of a solid",
                              "  taihu measure rock.vdb --base base.vdb\n"
                              "  taihu measure rock.vdb --base base.vdb --pores --law law.json\n"
                              "  taihu measure rock.vdb --tradition\n"
                              "  taihu measure rock.glb --json | jq .porosity_hull");
    verb->add_option("file", args->file.path,
                     "What to measure (.vdb .obj .ply .stl .off .glb .drc)")
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
    auto* pores = verb->add_flag(
        "--pores", args->pores,
        "Holes inside the base [the solid with its voids filled]: surface, chords, correlation, "
        "pore sizes, walls; beside what --law predicts");
    verb->add_option("--samples", args->settings.n_lines, "Random lines, 100..10000000")
        ->check(CLI::Range(100, 10'000'000))
        ->capture_default_str()
        ->needs(pores);
    verb->add_option("--seed", args->settings.seed, "Of the lines")
        ->capture_default_str()
        ->needs(pores);
    verb->add_flag("--tradition", args->tradition,
                   "How thin, seen through, leaky and wrinkled a garden rock is");
    args->file.add_voxel_options(*verb);
    verb->callback([args, &console] { console.within_limits([&] { run(*args, console); }); });
}

} // namespace taihu
