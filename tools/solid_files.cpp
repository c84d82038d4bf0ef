#include "tools/solid_files.h"

#include <map>

#include "mesh_out/extract.h"
#include "mesh_out/io/relief_file.h"
#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/of_file.h"
#include "stats/core/sha256.h"
#include "vdb_ops/estimate.h"
#include "vdb_ops/level_set_box.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/recipe.h"
#include "vdb_ops/vdb_file.h"
#include "vdb_ops/voxelize.h"

namespace taihu {
namespace {

double longest_m(const openvdb::FloatGrid& grid) {
    const Box box = level_set_box(grid);
    return box.empty() ? 0 : box.longest();
}

std::string lower_extension(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    for (char& c : extension)
        c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    return extension;
}

void refuse_large_surface(const openvdb::FloatGrid& solid, const Console& console) {
    refuse_if_over({.leaves = static_cast<double>(solid.tree().leafCount()), .meshed = true},
                   lattice_of(solid).voxel_m, memory_limit_bytes(console.memory_bytes()));
}

bool same_level_set(const openvdb::FloatGrid& a, const openvdb::FloatGrid& b) {
    if (!a.tree().hasSameTopology(b.tree()) || a.transform() != b.transform())
        return false;
    for (auto one = a.cbeginValueAll(), other = b.cbeginValueAll(); one; ++one, ++other)
        if (*one != *other)
            return false;
    return true;
}

/// Of a level set that its recipe makes again, from the files beside it; null when it does not.
std::shared_ptr<const Field> field_of(const openvdb::FloatGrid& grid, const std::string& recipe,
                                      const std::filesystem::path& path, const Console& console) {
    std::string why = "its recipe makes another solid with this version";
    try {
        const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
        const RecipeSolid again =
            make_recipe(recipe, base_name(path), recipe_assets({folder}, console),
                        {.memory_bytes = console.memory_bytes()}, console.progress);
        if (same_level_set(grid, *again.solid))
            return again.field;
    } catch (const Error& e) {
        if (e.fault() == Fault::cancelled)
            throw;
        why = e.what();
    }
    console.say("{}: surface from its voxels alone, rims not sharp: {}", path.string(), why);
    return nullptr;
}

} // namespace

bool is_vdb(const std::filesystem::path& path) {
    return lower_extension(path) == ".vdb";
}

void check_solid_path(const std::filesystem::path& path) {
    if (!is_vdb(path) && !mesh_format(path))
        throw Error(Fault::unsupported, path.string() + ": unknown extension '" +
                                            path.extension().string() +
                                            "'; use .vdb, .obj, .ply, .stl, .off, .glb or .drc");
}

void SolidOptions::add_mesh_options(CLI::App& verb) {
    static const std::map<std::string, std::string> kUnits = {{"um", "1e-6"},   {"mm", "1e-3"},
                                                              {"cm", "1e-2"},   {"m", "1"},
                                                              {"in", "0.0254"}, {"ft", "0.3048"}};
    verb.add_option("--unit,--units", unit_m,
                    "A mesh file's unit of length: um, mm, cm, m, in, ft, or so many metres [m]")
        ->transform(CLI::Transformer(kUnits).description(""))
        ->check(CLI::Range(1e-9, 1e9));
    verb.add_option("--up", up, "A mesh file's axis that points up [y]")
        ->check(CLI::IsMember({"y", "z"}));
}

void SolidOptions::add_voxel_options(CLI::App& verb) {
    auto* by_dim =
        verb.add_option("--dim", dim, "A mesh: voxels along its longest axis, 4..65536 [256]")
            ->check(CLI::Range(4, 65536));
    verb.add_option("--voxel", voxel, "or the size of a voxel, as 5mm")->excludes(by_dim);
    verb.add_option("--close", close,
                    "An open mesh: loops caps each boundary loop; winding fills what the faces "
                    "mostly surround, across gaps; plane builds a flat base, under terrain too; "
                    "none refuses it [loops]")
        ->check(CLI::IsMember({"loops", "winding", "plane", "none"}));
    verb.add_option("--shells", shells,
                    "A mesh of several closed surfaces: union of their insides (one turned inward "
                    "in another is a cavity), or parity: each inside another is hollow [union]")
        ->check(CLI::IsMember({"union", "parity"}));
    add_mesh_options(verb);
}

CloseSettings SolidOptions::close_settings() const {
    return taihu::close_settings(close.value_or("loops"), shells.value_or("union"));
}

MeshReadSettings SolidOptions::mesh_settings() const {
    return {unit_m.value_or(1), z_up() ? UpAxis::z : UpAxis::y};
}

RecipeAssets recipe_assets(std::vector<std::filesystem::path> folders, const Console& console) {
    return {std::move(folders),
            [&console](const std::filesystem::path& file, double unit_m, bool z_up) {
                return read_mesh(file, {unit_m, z_up ? UpAxis::z : UpAxis::y}, console.progress)
                    .levels.front();
            },
            [](const std::filesystem::path& path) { return read_relief(path); }};
}

Solid read_solid(const SolidOptions& options, const Console& console, Surfaces surfaces) {
    Solid solid;
    const std::string name = base_name(options.path), where = options.path.string();
    if (is_vdb(options.path)) {
        if (options.dim || !options.voxel.empty() || options.any_mesh_option())
            throw Error(Fault::bad_argument,
                        where +
                            ": a level set keeps its own voxels and units; drop --dim, --voxel, "
                            "--close, --shells, --unit and --up, or voxelize the mesh again");
        VdbFile file = read_solid_vdb(options.path, console.progress);
        solid.grid = file.solid;
        if (surfaces == Surfaces::wanted && recipe_solid(file.recipe))
            solid.field = field_of(*file.solid, file.recipe, options.path, console);
        const auto made = recipe_solid(file.recipe);
        solid.node = made ? *made : level_set_node(name, sha256_hex(read_file(options.path)));
    } else {
        const MeshFile file = read_mesh(options.path, options.mesh_settings(), console.progress);
        const TriMesh& mesh = file.levels.front();
        VoxelizeSettings settings;
        settings.close = options.close_settings();
        const Box box = bounds(mesh);
        settings.voxel_m =
            options.voxel.empty()
                ? of_file(where, [&] { return voxel_for(box, options.dim.value_or(kDefaultDim)); })
                : length_m("--voxel", options.voxel, {0, box.longest()});
        settings.memory_bytes = console.memory_bytes();
        report_stage(console.progress, "voxelizing");
        VoxelizeResult result =
            of_file(where, [&] { return voxelize(mesh, where, settings, console.progress); });
        solid.grid = result.solid;
        solid.field = result.field;
        solid.found = result.diagnosis.lines(settings.voxel_m);
        if (file.n_polygons > 0)
            solid.found.push_back(
                fmt::format("{} polygons of more than three corners split", file.n_polygons));
        if (file.n_degenerate_faces > 0)
            solid.found.push_back(fmt::format("{} faces without three different corners left out",
                                              file.n_degenerate_faces));
        if (file.levels.size() > 1)
            solid.found.push_back(fmt::format("the finest of {} levels taken", file.levels.size()));
        console.say_all(where, solid.found);
        solid.node = mesh_node(name, sha256_hex(read_file(options.path)),
                               options.mesh_settings().unit_m, options.z_up(), settings.close);
    }
    solid.measure = {lattice_of(*solid.grid).voxel_m, longest_m(*solid.grid)};
    if (surfaces == Surfaces::wanted)
        refuse_large_surface(*solid.grid, console);
    return solid;
}

openvdb::FloatGrid::Ptr read_level_set(const std::filesystem::path& path, const Console& console) {
    const openvdb::FloatGrid::Ptr solid = read_solid_vdb(path, console.progress).solid;
    refuse_large_surface(*solid, console);
    return solid;
}

void SurfaceOptions::add_options(CLI::App& verb) {
    auto* bound = verb.add_option(
        "--max-error", max_error,
        "A mesh: no point of it or of the solid's surface farther from the other [0.5vox]");
    auto* count = verb.add_option("--triangles", triangles,
                                  "A mesh: or as many as this, within 2 %, at the least error")
                      ->check(CLI::Range(4.0, 1e9))
                      ->excludes(bound);
    auto* how = verb.add_option("--method", method,
                                "A mesh: field, sharp and adaptive, or openvdb, its mesher [field]")
                    ->check(CLI::IsMember({"field", "openvdb"}))
                    ->excludes(bound)
                    ->excludes(count);
    auto* plain =
        verb.add_flag("--uniform", uniform, "A mesh: that of openvdb, two triangles a voxel")
            ->excludes(bound)
            ->excludes(count)
            ->excludes(how);
    verb.add_option("--adaptivity", adaptivity,
                    "with --method openvdb: larger polygons where it is flatter, 0..1 [0]")
        ->check(CLI::Range(0.0, 1.0))
        ->excludes(plain);
    verb.add_flag("--no-draco", no_draco, "A GLB: without Draco compression");
    verb.add_flag("--no-ao", no_ao, "A GLB: without ambient occlusion in its vertex colours");
    verb.add_option("--origin", origin,
                    "A mesh: world, or foot, the middle of the box's underside [world]")
        ->check(CLI::IsMember({"world", "foot"}));
}

std::optional<std::string> SurfaceOptions::any() const {
    const std::pair<bool, const char*> given[] = {{max_error.has_value(), "--max-error"},
                                                  {triangles.has_value(), "--triangles"},
                                                  {method.has_value(), "--method"},
                                                  {uniform, "--uniform"},
                                                  {adaptivity.has_value(), "--adaptivity"},
                                                  {no_draco, "--no-draco"},
                                                  {no_ao, "--no-ao"},
                                                  {origin.has_value(), "--origin"}};
    for (const auto& [is_given, name] : given)
        if (is_given)
            return name;
    return std::nullopt;
}

void SurfaceOptions::check(const std::filesystem::path& out) const {
    const auto refuse = [&](const std::string& why) {
        throw Error(Fault::bad_argument, out.string() + ": " + why);
    };
    if (const auto option = any(); option && is_vdb(out))
        refuse("a level set has no triangles; drop " + *option);
    const bool glb = mesh_format(out) == MeshFormat::glb;
    if (no_draco && !glb)
        refuse("only a .glb is Draco-compressed; drop --no-draco");
    if (no_ao && !glb)
        refuse("only a .glb has vertex colours; drop --no-ao");
    if (adaptivity && method != "openvdb")
        refuse("--adaptivity is of OpenVDB's mesher; add --method openvdb");
}

SurfaceSettings SurfaceOptions::settings(const Measure& measure) const {
    SurfaceSettings s;
    s.uniform = uniform || method == "openvdb";
    s.adaptivity = adaptivity.value_or(0);
    s.draco = !no_draco;
    s.openness = !no_ao;
    s.at_foot = origin == "foot";
    if (triangles)
        s.n_triangles = *triangles;
    else if (!s.uniform)
        s.max_error_m = length_m("--max-error", max_error.value_or(kDefaultMaxError), measure);
    return s;
}

std::optional<RecipeLod> SurfaceOptions::lod(const std::filesystem::path& out,
                                             const Measure& measure) const {
    if (is_vdb(out) || adaptivity.value_or(0) > 0)
        return std::nullopt;
    const SurfaceSettings s = settings(measure);
    RecipeLod lod;
    if (s.n_triangles > 0)
        lod.triangles = {s.n_triangles};
    else if (!s.uniform)
        lod.bounds_m = {s.max_error_m};
    lod.openness = s.openness;
    lod.at_foot = s.at_foot;
    return lod;
}

SurfaceSettings surface_settings(const RecipeLod& lod) {
    SurfaceSettings s;
    s.uniform = lod.uniform();
    if (!lod.bounds_m.empty())
        s.max_error_m = lod.bounds_m.front();
    else if (!s.uniform)
        s.n_triangles = lod.triangles.front();
    s.openness = lod.openness;
    s.at_foot = lod.at_foot;
    return s;
}

nlohmann::ordered_json certificate_json(const Certificate& c) {
    return {{"holds", c.holds()},
            {"vertices", c.n_vertices},
            {"triangles", c.n_triangles},
            {"boundary_edges", c.n_boundary_edges},
            {"nonmanifold_edges", c.n_nonmanifold_edges},
            {"nonmanifold_vertices", c.n_nonmanifold_vertices},
            {"misoriented_edges", c.n_misoriented_edges},
            {"degenerate_faces", c.n_degenerate_faces},
            {"duplicate_faces", c.n_duplicate_faces},
            {"components", c.n_components},
            {"cavities", c.n_cavities},
            {"genus", c.genus},
            {"self_intersections", c.n_self_intersections},
            {"volume_m3", c.volume_m3},
            {"area_m2", c.area_m2}};
}

std::string certificate_line(const Certificate& c) {
    if (!c.holds()) {
        std::string line;
        for (const std::string& fault : faults(c))
            line += (line.empty() ? "" : ", ") + fault;
        return line;
    }
    const auto some = [](std::size_t n, const char* what) {
        return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s");
    };
    return fmt::format("closed 2-manifold, outward: {}, {}{}, genus {}, {:.4g} m^3, {}",
                       some(c.n_triangles, "triangle"),
                       some(c.n_components - c.n_cavities, "piece"),
                       c.n_cavities == 0 ? "" : ", " + some(c.n_cavities, "sealed bubble"), c.genus,
                       c.volume_m3, some(c.n_self_intersections, "self-intersection"));
}

void say_unresolved(const std::string& where, std::size_t n, double error_m,
                    const Console& console) {
    if (n > 0 && error_m > 0)
        console.say("{}: but in {} place{} with walls or slits thinner than a voxel, {:.3g} m off "
                    "at most",
                    where, n, n == 1 ? "" : "s", error_m);
}

void say_unseen(const std::string& where, std::size_t n, const Console& console) {
    if (n > 0)
        console.say("{}: without {} bubble{} or speck{} narrower than a voxel", where, n,
                    n == 1 ? "" : "s", n == 1 ? "" : "s");
}

nlohmann::ordered_json write_solid(const std::filesystem::path& path,
                                   const openvdb::FloatGrid& grid, const Field* field,
                                   const std::string& recipe, const SurfaceSettings& surface,
                                   const Console& console) {
    console.may_write(path);
    const Measure measure{lattice_of(grid).voxel_m, longest_m(grid)};
    nlohmann::ordered_json json = {{"file", path.string()}};
    if (is_vdb(path)) {
        report_stage(console.progress, "writing");
        check_cancelled(console.progress);
        write_vdb(path, grid, recipe);
        json["leaves"] = grid.tree().leafCount();
        console.say("{}: level set, voxel {:.4g} m, {} leaves", path.string(), measure.voxel_m,
                    static_cast<std::size_t>(grid.tree().leafCount()));
    } else {
        const SurfaceFile file =
            format_surface(grid, field, *mesh_format(path), surface, recipe, console.progress);
        check_cancelled(console.progress);
        write_file(path, file.bytes);
        json["bytes"] = file.bytes.size();
        json["bound_m"] = file.bound_m;
        json["error_m"] = file.error_m;
        json["unresolved"] = file.n_unresolved;
        json["unseen"] = file.n_unseen;
        json["certificate"] = certificate_json(file.certificate);
        console.say("{}: {}", path.string(), certificate_line(file.certificate));
        console.say("{}: within {:.3g} m of the {} (bound {:.3g} m), {} bytes", path.string(),
                    file.error_m, surface.uniform ? "uniform surface" : "solid's surface",
                    file.bound_m, file.bytes.size());
        say_unresolved(path.string(), file.n_unresolved, file.unresolved_error_m, console);
        say_unseen(path.string(), file.n_unseen, console);
        if (!file.note.empty())
            console.say("{}: {}", path.string(), file.note);
    }
    return json;
}

} // namespace taihu
