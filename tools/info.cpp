// taihu info: what is in a file, and the recipe that made it.
#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/text.h"
#include "stats/io/holes_file.h"
#include "stats/io/json_detail.h"
#include "stats/io/law_file.h"
#include "stats/io/measurements.h"
#include "tools/solid_files.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/recipe.h"
#include "vdb_ops/tiles.h"
#include "vdb_ops/vdb_file.h"

namespace taihu {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostJsonBytes = std::size_t{16} << 20,
                      kMostTableBytes = std::size_t{1} << 30;

Json vdb_info(const std::filesystem::path& path, Progress* progress) {
    const VdbFile file = read_vdb(path, progress);
    const Lattice lattice = lattice_of(*file.solid);
    const openvdb::CoordBBox box = file.solid->evalActiveVoxelBoundingBox();
    Json json = {{"kind", file.tile.empty() ? "level set" : "tile of a level set"}};
    if (!file.tile.empty())
        json["tile"] = parse_ordered_json(file.tile, base_name(path) + ": taihu_tile");
    json.update({{"voxel_m", lattice.voxel_m},
                 {"half_width_vox", lattice.half_width_vox},
                 {"voxels", {box.dim().x(), box.dim().y(), box.dim().z()}},
                 {"active_voxels", file.solid->activeVoxelCount()},
                 {"leaves", file.solid->tree().leafCount()},
                 {"recipe", file.recipe}});
    return json;
}

Json mesh_info(const SolidOptions& options, const Console& console) {
    const MeshFile file = read_mesh(options.path, options.mesh_settings(), console.progress);
    Json json = {{"kind", "mesh"}, {"levels", Json::array()}};
    for (std::size_t j = 0; j < file.levels.size(); ++j) {
        const Box box = bounds(file.levels[j]);
        Json level = {{"vertices", file.levels[j].positions.size()},
                      {"triangles", file.levels[j].triangles.size()},
                      {"size_m", {box.size().x, box.size().y, box.size().z}}};
        if (j < file.coverages.size())
            level["screen_coverage"] = file.coverages[j];
        json["levels"].push_back(level);
    }
    if (file.format == MeshFormat::glb) {
        json["draco"] = file.draco;
        json["generator"] = file.generator;
    }
    if (file.n_polygons > 0)
        json["polygons"] = file.n_polygons;
    json["recipe"] = file.recipe;
    return json;
}

/// A law or a report as it stands in its file, or what a list of tiles comes to.
Json json_info(const std::filesystem::path& path) {
    const Json text =
        parse_ordered_json(read_file(path, kMostJsonBytes), base_name(path), kMostJsonBytes);
    if (text.is_object() && text.contains("taihu_report")) {
        Json json = {{"kind", "report of levels of detail"}};
        json.update(text);
        return json;
    }
    if (text.is_object() && text.contains("taihu_tiles")) {
        const TileSet set = read_tile_set(path);
        std::size_t n_leaves = 0, n_bytes = 0;
        for (const Tile& t : set.tiles) {
            n_leaves += t.n_leaves;
            n_bytes += t.n_bytes;
        }
        return {{"kind", "level set in tiles"},
                {"voxel_m", set.lattice.voxel_m},
                {"tile_voxels", set.tile_voxels},
                {"tiles", set.tiles.size()},
                {"leaves", n_leaves},
                {"bytes", n_bytes},
                {"recipe", set.recipe}};
    }
    read_law_file(path); // refuses what is none
    Json json = {{"kind", "law of hole diameters"}};
    json.update(text);
    return json;
}

Json table_info(const std::filesystem::path& path) {
    if (read_file(path, kMostTableBytes).find("x_m") == std::string::npos) {
        const Measurements m = read_measurements(std::span(&path, 1));
        return {{"kind", "hole diameters measured on pictures"},
                {"profiles", n_profiles(m.sample)},
                {"unit", unit_name(m.sample.unit)},
                {"segments", m.segments.size()}};
    }
    const std::vector<Sphere> holes = read_holes(path);
    Box box;
    double smallest = holes.empty() ? 0 : 1e300, largest = 0;
    for (const Sphere& h : holes) {
        box.include(h.center);
        smallest = std::min(smallest, h.radius_m);
        largest = std::max(largest, h.radius_m);
    }
    return {{"kind", "holes"},
            {"holes", holes.size()},
            {"radius_m", {smallest, largest}},
            {"box_m", {box.size().x, box.size().y, box.size().z}}};
}

void run(const SolidOptions& options, const Console& console) {
    const std::string extension = options.path.extension().string();
    Json json = {{"file", options.path.string()}};
    if (is_vdb(options.path))
        json.update(vdb_info(options.path, console.progress));
    else if (extension == ".json")
        json.update(json_info(options.path));
    else if (extension == ".csv")
        json.update(table_info(options.path));
    else if (mesh_format(options.path))
        json.update(mesh_info(options, console));
    else
        throw Error(Fault::unsupported,
                    options.path.string() + ": unknown extension '" + extension +
                        "'; use .vdb, .obj, .ply, .stl, .off, .glb, .drc, .json or .csv");
    if (json.contains("recipe") &&
        json["recipe"].is_string()) { // text in the file, an object for people and programs
        const std::string text = json["recipe"].get<std::string>();
        json["recipe"] = recipe_solid(text) ? parse_ordered_json(text, "recipe") : Json(nullptr);
    }
    if (console.json)
        return console.result(json);
    const auto text = [](const Json& value) {
        return value.is_string() ? printable(value.get<std::string>(), 1000)
                                 : value.dump(-1, ' ', false, Json::error_handler_t::replace);
    };
    for (const auto& [key, value] : json.items()) { // the answer itself, so on stdout
        if (!value.is_array() || value.empty() || !value[0].is_object()) {
            fmt::print("{}: {}\n", key, text(value));
            continue;
        }
        for (std::size_t i = 0; i < value.size(); ++i) // a line for each level
            fmt::print("{} {}: {}\n", key, i, text(value[i]));
    }
}

} // namespace

void add_info(CLI::App& app, Console& console) {
    auto args = std::make_shared<SolidOptions>();
    auto* verb = console.verb(app, "info", "Say what is in a file and which recipe made it",
                              "  taihu info rock.glb\n"
                              "  taihu info rock.vdb --json | jq .recipe");
    verb->add_option(
            "file", args->path,
            "A solid or mesh (.vdb .obj .ply .stl .off .glb .drc), a law, report or list of tiles "
            "(.json), or a table (.csv)")
        ->required();
    args->add_mesh_options(*verb);
    verb->callback([args, &console] { console.within_limits([&] { run(*args, console); }); });
}

} // namespace taihu
