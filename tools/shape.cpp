// taihu shape: base shapes.
#include "mesh_out/certificate.h"
#include "stats/core/error.h"
#include "stats/core/file.h"
#include "tools/shape_cave.h"
#include "tools/shape_stages.h"
#include "tools/solid_files.h"
#include "vdb_ops/estimate.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/recipe.h"
#include "vdb_ops/shapes.h"
#include "vdb_ops/voxelize.h"

namespace taihu {
namespace {

struct ShapeArgs {
    std::string kind, size = "1m", tube, round, voxel, damping, along, bump;
    std::filesystem::path out, stages;
    ShapeSettings settings;
    CaveSettings cave;
    std::vector<double> exponents, hurst;
    std::optional<int> dim;
};

/// Options that the kind does not read are mistakes, not decoration.
/// \param kind  nothing: a cave.
void refuse_unused(std::optional<ShapeKind> kind, const CLI::App& verb) {
    using enum ShapeKind;
    const bool cave = !kind, fractal = cave || kind == fractal_rock;
    const std::pair<const char*, bool> uses[] = {{"--round", kind == rounded_box},
                                                 {"--tube", kind == torus},
                                                 {"--exponents", kind == superquadric},
                                                 {"--relief", kind == boulder},
                                                 {"--lumps", kind == boulder},
                                                 {"--seed", kind == boulder || fractal},
                                                 {"--subdivisions", kind != box && !fractal},
                                                 {"--rocks", cave},
                                                 {"--room", cave},
                                                 {"--wall", cave},
                                                 {"--stages", fractal && !cave},
                                                 {"--bump", fractal && !cave},
                                                 {"--base", fractal},
                                                 {"--iterations", fractal},
                                                 {"--damping", fractal},
                                                 {"--along", fractal},
                                                 {"--amplitude", fractal},
                                                 {"--hurst", fractal},
                                                 {"--corners", fractal},
                                                 {"--roundness", fractal}};
    for (const auto& [option, used] : uses)
        if (!used && verb.get_option(option)->count() > 0)
            throw Error(Fault::bad_argument, std::string("shape: a ") +
                                                 std::string(cave ? "cave" : shape_name(*kind)) +
                                                 " has no " + option + "; drop it");
}

/// What stands in words on the command line.
void read_fractal(ShapeArgs& args) {
    FractalSettings& f = args.settings.fractal;
    if (!args.damping.empty())
        f.damping = damping_from_name(args.damping);
    if (!args.along.empty())
        f.along = along_from_name(args.along);
    if (!args.hurst.empty()) {
        f.hurst_up = args.hurst.front();
        f.hurst_down = args.hurst.back();
    }
}

void add_fractal_options(ShapeArgs& args, CLI::App& verb) {
    FractalSettings& f = args.settings.fractal;
    verb.add_option("--base", f.base,
                    "fractal_rock, cave: the icosahedron in 20 * 4^N triangles, 0..5")
        ->check(CLI::Range(0, 5))
        ->capture_default_str();
    verb.add_option("--iterations", f.iterations,
                    "fractal_rock, cave: displacements, each of 16 times the triangles (4 "
                    "undamped), 0..8; cave: 2 unless given")
        ->check(CLI::Range(0, 8))
        ->capture_default_str();
    verb.add_option("--damping", args.damping,
                    fmt::format("fractal_rock, cave: none, interpolating or approximating [{}]",
                                damping_name(f.damping)));
    verb.add_option(
        "--along", args.along,
        fmt::format("fractal_rock, cave: midpoints move along the radius or the normal; "
                    "the second may cross itself [{}]",
                    along_name(f.along)));
    verb.add_option("--amplitude", f.amplitude,
                    "fractal_rock, cave: of the first displacement / radius, 0..1")
        ->check(CLI::Range(0.0, 1.0))
        ->capture_default_str();
    verb.add_option(
            "--hurst", args.hurst,
            fmt::format("fractal_rock, cave: exponents of what faces up and down, H or UP,DOWN, "
                        "0.05 rough .. 2 smooth [{},{}]",
                        f.hurst_up, f.hurst_down))
        ->delimiter(',')
        ->expected(1, 2)
        ->check(CLI::Range(0.05, 2.0));
    verb.add_option(
            "--corners", f.corners,
            "fractal_rock, cave: displacement of the base's own corners / that of midpoints, 0..1")
        ->check(CLI::Range(0.0, 1.0))
        ->capture_default_str();
    verb.add_option("--roundness", f.roundness,
                    "fractal_rock, cave: midpoints start on the edge (0) .. on the arc (1)")
        ->check(CLI::Range(0.0, 1.0))
        ->capture_default_str();
}

/// A cave is a recipe, not a shape with a mesh of its own.
void run_cave(ShapeArgs& args, const CLI::App& verb, const Console& console) {
    refuse_unused(std::nullopt, verb);
    check_solid_path(args.out);
    console.may_write(args.out);
    CaveSettings& cave = args.cave;
    const int iterations = cave.fractal.iterations;
    cave.fractal = args.settings.fractal;
    if (verb.get_option("--iterations")->count() == 0)
        cave.fractal.iterations = iterations;
    cave.size_m = args.settings.size_m;
    cave.seed = args.settings.seed;
    console.result(make_cave(cave, args.out, args.dim, args.voxel, console));
}

/// What displacement that folds over makes of a rock.
void say_crossings(const ShapeArgs& args, const TriMesh& mesh, const Console& console) {
    if (args.settings.kind != ShapeKind::fractal_rock)
        return;
    if (const std::size_t n = certify(mesh).n_self_intersections; n > 0)
        console.say("{}: {} pairs of triangles cross, {}", args.out.string(), n,
                    is_vdb(args.out) ? "so the solid is what the surface winds around"
                                     : "and do so in the mesh; a .vdb is the solid that the "
                                       "surface winds around");
}

/// The shape as the file says: a mesh as it is, a level set by its exact distances.
void run(ShapeArgs& args, const CLI::App& verb, const Console& console) {
    args.settings.size_m = parse_size("--size", args.size);
    read_fractal(args);
    if (args.kind == "cave")
        return run_cave(args, verb, console);
    args.settings.kind = shape_kind(args.kind);
    refuse_unused(args.settings.kind, verb);
    args.settings.tube_m = args.tube.empty()
                               ? 0.25 * args.settings.size_m.x
                               : length_m("--tube", args.tube, {0, args.settings.size_m.x});
    const Vec3& size = args.settings.size_m;
    const double shortest_m = std::min({size.x, size.y, size.z});
    args.settings.round_m =
        args.round.empty() ? 0.2 * shortest_m : length_m("--round", args.round, {0, shortest_m});
    if (!args.exponents.empty()) {
        args.settings.vertical = args.exponents.front();
        args.settings.around = args.exponents.back();
    }
    const TriMesh mesh = shape_mesh(args.settings); // refuses settings out of range
    check_cancelled(console.progress);
    check_solid_path(args.out);
    console.may_write(args.out);
    std::unique_ptr<FileSet> stages;
    if (!args.stages.empty())
        stages = make_stages(args.settings,
                             args.bump == "static" ? StageBump::static_map : StageBump::dynamic,
                             args.stages, console);
    const Box box = shape_box(args.settings);
    say_crossings(args, mesh, console);
    const std::string node = shape_node(args.settings);
    nlohmann::ordered_json json = {{"file", args.out.string()}, {"kind", args.kind}};
    if (is_vdb(args.out)) {
        Lattice lattice;
        lattice.voxel_m = args.voxel.empty() ? voxel_for(box, args.dim.value_or(kDefaultDim))
                                             : length_m("--voxel", args.voxel, {0, box.longest()});
        refuse_if_too_large(0, box, lattice.voxel_m);
        const auto field = shape_field(args.settings);
        const double limit = memory_limit_bytes(console.memory_bytes());
        if (may_exceed(box, lattice.voxel_m, {}, limit))
            refuse_if_over({.leaves = estimate_size(*field, lattice).n_leaves}, lattice.voxel_m,
                           limit);
        report_stage(console.progress, "rasterizing");
        const auto grid = rasterize(*field, lattice, console.progress);
        json.update(write_solid(args.out, *grid, nullptr,
                                format_recipe(node, lattice.voxel_m, args.settings.seed), {},
                                console));
    } else {
        if (args.dim || !args.voxel.empty())
            throw Error(Fault::bad_argument,
                        "shape: --dim and --voxel are for a .vdb; a mesh takes --subdivisions");
        const MeshFormat format = *mesh_format(args.out);
        const std::string bytes =
            format_mesh(mesh, format, format_recipe(node, 0, args.settings.seed));
        require_certificate(
            certify(parse_mesh(bytes, format, args.out.string(), {.is_own = true}).levels.at(0)),
            args.out.string());
        check_cancelled(console.progress);
        write_file(args.out, bytes);
        json["triangles"] = mesh.triangles.size();
        json["volume_m3"] = signed_volume_m3(mesh);
        console.say("{}: {}, {} triangles, {:.4g} m^3", args.out.string(), args.kind,
                    mesh.triangles.size(), signed_volume_m3(mesh));
    }
    if (stages)
        stages->publish(kFileListName);
    console.result(json);
}

} // namespace

void add_shape(CLI::App& app, Console& console) {
    auto args = std::make_shared<ShapeArgs>();
    auto* verb =
        console.verb(app, "shape", "Make a base shape as a level set or a mesh",
                     "  taihu shape boulder --size 0.7,1,0.6 --seed 7 -o base.ply\n"
                     "  taihu shape torus --size 1m --tube 30cm --dim 200 -o ring.vdb\n"
                     "  taihu shape rounded_box --size 1,2,0.5 --round 5cm -o slab.glb\n"
                     "  taihu shape superquadric --exponents 0.4,1 -o drum.obj\n"
                     "  taihu shape fractal-rock --size 1,0.8,0.9 --seed 4 -o rock.ply\n"
                     "  taihu shape cave --size 2,1,1.5 --rocks 14 --seed 2 --dim 200 -o cave.glb\n"
                     "  taihu shape icosphere --subdivisions 4 -o ball.obj");
    ShapeSettings& s = args->settings;
    verb->add_option("kind", args->kind,
                     "sphere, ellipsoid, box, rounded_box, cylinder, capsule, torus, superquadric, "
                     "icosphere, boulder, fractal-rock, or cave: a box without fractal rocks")
        ->required();
    verb->add_option("-o,--output", args->out,
                     "Where to write it (.vdb .obj .ply .stl .off .glb .drc)")
        ->required();
    verb->add_option("--size", args->size, "Extent: one length, or X,Y,Z; the centre is the origin")
        ->capture_default_str();
    verb->add_option("--round", args->round,
                     "rounded_box: radius of its edges [a fifth of its shortest side]");
    verb->add_option("--tube", args->tube, "torus: thickness of the ring [a quarter of its width]");
    verb->add_option(
            "--exponents", args->exponents,
            "superquadric: of upright and of level sections, E or E,E, each 0.1..2; towards "
            "0 boxes, 1 round, 2 diamonds [1]")
        ->delimiter(',')
        ->expected(1, 2)
        ->check(CLI::Range(0.1, 2.0));
    verb->add_option("--subdivisions", s.subdivisions,
                     "Meshes: 20 * 4^N triangles, or 2 * 2^N sides, 0..8")
        ->check(CLI::Range(0, 8))
        ->capture_default_str();
    verb->add_option("--relief", s.relief, "boulder: height of its lumps / radius, 0..0.9")
        ->check(CLI::Range(0.0, 0.9))
        ->capture_default_str();
    verb->add_option("--lumps", s.lumps, "boulder: lumps per radius, 0.1..16")
        ->check(CLI::Range(0.1, 16.0))
        ->capture_default_str();
    verb->add_option("--seed", s.seed, "boulder, fractal_rock, cave: which of them")
        ->check(CLI::Range(0.0, 9.2e18))
        ->capture_default_str();
    add_fractal_options(*args, *verb);
    verb->add_option("--stages", args->stages,
                     "fractal_rock: a folder for the nine steps to it, meshes and pictures; with "
                     "--base 0 those of the paper");
    verb->add_option("--bump", args->bump,
                     "with --stages: normals of the last from the finer model (dynamic), or from a "
                     "static bump map [dynamic]")
        ->check(CLI::IsMember({"dynamic", "static"}))
        ->needs("--stages");
    verb->add_option("--rocks", args->cave.n_rocks, "cave: fractal rocks taken from a box, 1..200")
        ->check(CLI::Range(1, 200))
        ->capture_default_str();
    verb->add_option("--room", args->cave.room,
                     "cave: mean width of a rock / shortest side of the box, 0.05..0.9")
        ->check(CLI::Range(0.05, 0.9))
        ->capture_default_str();
    verb->add_option("--wall", args->cave.wall,
                     "cave: least thickness of walls / shortest side of the box, 0..0.4")
        ->check(CLI::Range(0.0, 0.4))
        ->capture_default_str();
    auto* dim =
        verb->add_option("--dim", args->dim, "A .vdb, a cave: voxels along the longest axis [256]")
            ->check(CLI::Range(4, 65536));
    verb->add_option("--voxel", args->voxel, "or the size of a voxel, as 5mm")->excludes(dim);
    verb->callback(
        [args, verb, &console] { console.within_limits([&] { run(*args, *verb, console); }); });
}

} // namespace taihu
