// taihu shape: base shapes.
#include "mesh_out/certificate.h"
#include "stats/core/error.h"
#include "stats/core/file.h"
#include "tools/solid_files.h"
#include "vdb_ops/estimate.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/recipe.h"
#include "vdb_ops/shapes.h"
#include "vdb_ops/voxelize.h"

namespace taihu {
namespace {

struct ShapeArgs {
    std::string kind, size = "1m", tube, round, voxel, memory;
    std::filesystem::path out;
    ShapeSettings settings;
    std::vector<double> exponents;
    std::optional<int> dim;
};

/// Options that the kind does not read are mistakes, not decoration.
void refuse_unused(ShapeKind kind, const CLI::App& verb) {
    using enum ShapeKind;
    const std::pair<const char*, bool> uses[] = {
        {"--round", kind == rounded_box},      {"--tube", kind == torus},
        {"--exponents", kind == superquadric}, {"--relief", kind == boulder},
        {"--lumps", kind == boulder},          {"--seed", kind == boulder},
        {"--subdivisions", kind != box}};
    for (const auto& [option, used] : uses)
        if (!used && verb.get_option(option)->count() > 0)
            throw Error(Fault::bad_argument, std::string("shape: a ") +
                                                 std::string(shape_name(kind)) + " has no " +
                                                 option + "; drop it");
}

/// The shape as the file says: a mesh as it is, a level set by its exact distances.
void run(ShapeArgs& args, const CLI::App& verb, const Console& console) {
    args.settings.kind = shape_kind(args.kind);
    refuse_unused(args.settings.kind, verb);
    args.settings.size_m = parse_size("--size", args.size);
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
    const Box box = shape_box(args.settings);
    check_solid_path(args.out);
    console.may_write(args.out);
    const std::string node = shape_node(args.settings);
    nlohmann::ordered_json json = {{"file", args.out.string()}, {"kind", args.kind}};
    if (is_vdb(args.out)) {
        Lattice lattice;
        lattice.voxel_m = args.voxel.empty() ? voxel_for(box, args.dim.value_or(kDefaultDim))
                                             : length_m("--voxel", args.voxel, {0, box.longest()});
        refuse_if_too_large(0, box, lattice.voxel_m);
        const auto field = shape_field(args.settings);
        std::optional<double> asked;
        if (!args.memory.empty())
            asked = memory_bytes("--memory", args.memory);
        const double limit = memory_limit_bytes(asked);
        if (may_exceed(box, lattice.voxel_m, {}, limit))
            refuse_if_over({.leaves = estimate_size(*field, lattice).n_leaves}, lattice.voxel_m,
                           limit);
        report_stage(console.progress, "rasterizing");
        const auto grid = rasterize(*field, lattice, console.progress);
        json.update(write_solid(args.out, *grid,
                                format_recipe(node, lattice.voxel_m, args.settings.seed), {},
                                console));
    } else {
        if (args.dim || !args.voxel.empty() || !args.memory.empty())
            throw Error(Fault::bad_argument,
                        "shape: --dim, --voxel and --memory are for a .vdb; a mesh takes "
                        "--subdivisions");
        const MeshFormat format = *mesh_format(args.out);
        const std::string bytes =
            format_mesh(mesh, format, format_recipe(node, 0, args.settings.seed));
        require_certificate(certify(parse_mesh(bytes, format, args.out.string()).levels.at(0)),
                            args.out.string());
        write_file(args.out, bytes);
        json["triangles"] = mesh.triangles.size();
        json["volume_m3"] = signed_volume_m3(mesh);
        console.say("{}: {}, {} triangles, {:.4g} m^3", args.out.string(), args.kind,
                    mesh.triangles.size(), signed_volume_m3(mesh));
    }
    console.result(json);
}

} // namespace

void add_shape(CLI::App& app, Console& console) {
    auto args = std::make_shared<ShapeArgs>();
    auto* verb = console.verb(app, "shape", "Make a base shape as a level set or a mesh",
                              "  taihu shape boulder --size 0.7,1,0.6 --seed 7 -o base.ply\n"
                              "  taihu shape torus --size 1m --tube 30cm --dim 200 -o ring.vdb\n"
                              "  taihu shape rounded_box --size 1,2,0.5 --round 5cm -o slab.glb\n"
                              "  taihu shape superquadric --exponents 0.4,1 -o drum.obj\n"
                              "  taihu shape icosphere --subdivisions 4 -o ball.obj");
    ShapeSettings& s = args->settings;
    verb->add_option("kind", args->kind,
                     "sphere, ellipsoid, box, rounded_box, cylinder, capsule, torus, superquadric, "
                     "icosphere or boulder")
        ->required();
    verb->add_option("-o,--output", args->out, "Where to write it (.vdb .obj .ply .stl .off .glb)")
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
    verb->add_option("--seed", s.seed, "boulder: which of them")
        ->check(CLI::Range(0.0, 9.2e18))
        ->capture_default_str();
    auto* dim = verb->add_option("--dim", args->dim, "A .vdb: voxels along the longest axis [256]")
                    ->check(CLI::Range(4, 65536));
    verb->add_option("--voxel", args->voxel, "or the size of a voxel, as 5mm")->excludes(dim);
    verb->add_option("--memory", args->memory,
                     "A .vdb: refuse what would need more, as 4GB [what the machine has left]");
    verb->callback(
        [args, verb, &console] { console.with_threads([&] { run(*args, *verb, console); }); });
}

} // namespace taihu
