#include "vdb_ops/recipe_solid.h"

#include <cmath>

#include <nlohmann/json.hpp>

#include "stats/core/error.h"
#include "stats/core/of_file.h"
#include "stats/core/text.h"
#include "stats/io/json_detail.h"
#include "stats/io/utf_detail.h"
#include "stats/number_detail.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/recipe_parse_detail.h"
#include "vdb_ops/voxelize.h"

namespace taihu {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr int kVersion = 1, kDefaultDim = 256, kCoarseDim = 128;
constexpr std::size_t kMostLevels = 8, kMostBytes = std::size_t{16} << 20;
constexpr double kMostSeed = 1.8446744073709551e19;
constexpr std::string_view kRequired[] = {"taihu_recipe", "solid"};
constexpr std::string_view kOptional[] = {"seed", "voxel_m", "dim", "material",
                                          "lod",  "about",   "set"};

json read_recipe(const std::string& text, const std::string& where) {
    json recipe = parse_json(text, where, kMostBytes);
    if (!recipe.is_object() || !recipe.contains("taihu_recipe"))
        throw Error(Fault::bad_input,
                    where + ": no recipe; a recipe is an object with 'taihu_recipe' and 'solid'");
    if (recipe["taihu_recipe"] != kVersion)
        throw Error(Fault::bad_input, where + ": 'taihu_recipe' is " +
                                          printable(recipe["taihu_recipe"].dump()) +
                                          ", this program reads 1; use a later taihu");
    check_keys(recipe, where, kRequired, kOptional);
    if (recipe.contains("voxel_m") && recipe.contains("dim"))
        throw Error(Fault::bad_input, where + ": has 'voxel_m' and 'dim'; give one of them");
    return recipe;
}

std::uint64_t seed_of(const json& recipe, const std::string& where,
                      const RecipeSettings& settings) {
    if (settings.seed)
        return *settings.seed;
    if (!recipe.contains("seed"))
        return 0;
    json_number(recipe, where, "seed", 0, kMostSeed);
    if (!recipe["seed"].is_number_unsigned())
        throw Error(Fault::bad_input, where + ": 'seed' must be a whole number; correct it");
    return recipe["seed"].get<std::uint64_t>();
}

/// Two numbers or more of one kind, rising or falling.
template <class Number>
std::vector<Number> level_list(const json& lod, const std::string& where, std::string_view key,
                               double lo, double hi, bool rising) {
    const json& list = lod[std::string(key)];
    if (!list.is_array() || list.empty() || list.size() > kMostLevels)
        throw Error(Fault::bad_input,
                    where + ": '" + std::string(key) + "' must be a list of 1 to 8 numbers");
    std::vector<Number> out;
    for (const json& number : list) {
        const double value = json_number({{std::string(key), number}}, where, key, lo, hi);
        if (!out.empty() && (value > static_cast<double>(out.back())) != rising)
            throw Error(Fault::bad_input, where + ": '" + std::string(key) + "' must " +
                                              (rising ? "rise" : "fall") + ", finest level first");
        out.push_back(static_cast<Number>(value));
    }
    return out;
}

bool json_flag(const json& object, const std::string& where, const std::string& key,
               bool otherwise) {
    if (!object.contains(key))
        return otherwise;
    if (!object[key].is_boolean())
        throw Error(Fault::bad_input, where + ": '" + key + "' must be true or false");
    return object[key].get<bool>();
}

RecipeMaps maps_of(const json& own, const std::string& where, double scale) {
    static constexpr std::string_view kKeys[] = {"size_px", "gutter_px",      "rays", "cage_m",
                                                 "grain_m", "grain_contrast", "only", "vertices"};
    check_keys(own, where, {}, kKeys);
    RecipeMaps maps;
    const auto whole = [&](const char* key, double lo, double hi, int otherwise) {
        if (!own.contains(key))
            return otherwise;
        const double value = json_number(own, where, key, lo, hi);
        if (value != std::floor(value))
            throw Error(Fault::bad_input, where + ": '" + key + "' must be a whole number");
        return static_cast<int>(value);
    };
    if (own.contains("size_px"))
        maps.side_px = whole("size_px", 64, 8192, 0);
    maps.gutter_px = whole("gutter_px", 1, 16, maps.gutter_px);
    maps.n_rays = whole("rays", 1, 4096, maps.n_rays);
    if (own.contains("cage_m"))
        maps.cage_m = json_number(own, where, "cage_m", 1e-9, 1e6) * scale;
    if (own.contains("grain_m"))
        maps.grain_m = json_number(own, where, "grain_m", 1e-9, 1e6) * scale;
    if (own.contains("grain_contrast"))
        maps.grain_contrast = json_number(own, where, "grain_contrast", 0, 1);
    if (own.contains("only"))
        maps.only = whole("only", 0, kMostLevels - 1, 0);
    maps.vertices = json_flag(own, where, "vertices", false);
    return maps;
}

/// Exactly one of: `levels` with `bound_m` or `bound_vox` and `factor`, `bounds_m`, `triangles`,
/// `uniform`.
std::optional<RecipeLod> lod_of(const json& recipe, const std::string& where, double scale,
                                double voxel_m) {
    if (!recipe.contains("lod"))
        return std::nullopt;
    static constexpr std::string_view kKeys[] = {"levels",   "bound_m",   "bound_vox", "factor",
                                                 "bounds_m", "triangles", "uniform",   "openness",
                                                 "origin",   "maps"};
    const std::string inside = where + ": lod";
    const json& own = recipe["lod"];
    check_keys(own, inside, {}, kKeys);
    RecipeLod lod;
    const auto kinds = own.contains("levels") + own.contains("bounds_m") +
                       own.contains("triangles") + json_flag(own, inside, "uniform", false);
    if (kinds != 1)
        throw Error(Fault::bad_input,
                    inside + ": give 'levels', 'bounds_m', 'triangles' or 'uniform'");
    if (own.contains("levels")) {
        const double n = json_number(own, inside, "levels", 1, kMostLevels),
                     bound_m = own.contains("bound_vox")
                                   ? json_number(own, inside, "bound_vox", 1e-3, 1e3) * voxel_m
                                   : json_number(own, inside, "bound_m", 1e-9, 1e6) * scale,
                     factor = json_number(own, inside, "factor", 1.01, 100);
        for (int j = 0; j < static_cast<int>(n); ++j)
            lod.bounds_m.push_back(bound_m * std::pow(factor, j));
    } else if (own.contains("bounds_m")) {
        lod.bounds_m = level_list<double>(own, inside, "bounds_m", 1e-9, 1e6, true);
        for (double& bound_m : lod.bounds_m)
            bound_m *= scale;
    } else if (own.contains("triangles")) {
        lod.triangles = level_list<std::uint64_t>(own, inside, "triangles", 4, 1e9, false);
    }
    lod.openness = json_flag(own, inside, "openness", true);
    if (own.contains("origin")) {
        const std::string origin = json_text(own, inside, "origin");
        if (origin != "foot" && origin != "world")
            throw Error(Fault::bad_input, inside + ": 'origin' must be foot or world; correct it");
        lod.at_foot = origin == "foot";
    }
    if (own.contains("maps")) {
        if (lod.uniform())
            throw Error(Fault::bad_input,
                        inside + ": 'maps' are of levels; give 'levels', 'bounds_m' or "
                                 "'triangles' instead of 'uniform'");
        lod.maps = maps_of(own["maps"], inside + ".maps", scale);
    }
    return lod;
}

/// The box of the solid before it is scaled.
Box solid_box(const RecipeNode& root, const std::string& where) {
    const Box box = root.box({});
    if (!is_finite(box.lo) || !is_finite(box.hi))
        throw Error(Fault::bad_input,
                    where + ": solid: has no bounds; intersect it with something that has");
    if (box.empty() || !(box.volume() > 0))
        throw Error(Fault::bad_input,
                    where + ": solid: is empty; its parts do not meet, or are holes alone");
    return box;
}

double voxel_of(const json& recipe, const std::string& where, const RecipeSettings& settings,
                const Box& box, double scale) {
    if (settings.voxel_m)
        return *settings.voxel_m;
    if (settings.dim)
        return voxel_for(box, *settings.dim);
    if (recipe.contains("voxel_m")) // 0: of a mesh that needed none
        if (const double v = json_number(recipe, where, "voxel_m", 0, 1e6); v > 0)
            return v * scale;
    if (recipe.contains("dim"))
        return voxel_for(box, static_cast<int>(json_number(recipe, where, "dim", 4, 65536)));
    return voxel_for(box, kDefaultDim);
}

/// What makes the solid again: the recipe with the settings in it, keys as they stood.
std::string settled(const std::string& text, const std::string& where, const RecipeReport& made,
                    std::uint64_t seed, double scale) {
    const ordered_json given = parse_ordered_json(text, where, kMostBytes);
    ordered_json solid = given["solid"];
    if (scale != 1) {
        ordered_json node = {{"transform", {{"of", std::move(solid)}, {"scale", scale}}}};
        solid = std::move(node);
    }
    ordered_json out =
        ordered_json::parse(format_recipe(solid.dump(), made.voxel_m, seed, made.lod));
    if (given.contains("material")) {
        ordered_json whole;
        for (const auto& [key, value] : out.items()) {
            if (key == "solid")
                whole["material"] = given["material"];
            whole[key] = value;
        }
        out = std::move(whole);
    }
    return out.dump();
}

void check_settings(const RecipeSettings& settings) {
    if (settings.height_m && !(*settings.height_m > 0 && std::isfinite(*settings.height_m)))
        throw Error(Fault::bad_argument,
                    "height: " + shortest(*settings.height_m) + " m; must be > 0");
}

/// A recipe read and placed; what it says of itself goes into `made`.
struct ReadyRecipe {
    std::unique_ptr<RecipeNode> root;
    Similarity at;
    Box box;
    Lattice lattice;

    ReadyRecipe(const std::string& recipe, const std::string& where, const RecipeAssets& assets,
                const RecipeSettings& settings, RecipeReport& made, Progress* progress) {
        const json text = read_recipe(recipe, where);
        const std::uint64_t seed = seed_of(text, where, settings);
        RecipeParser parser{assets, seed};
        parser.most_bytes = memory_limit_bytes(settings.memory_bytes);
        if (text.contains("material"))
            parser.material = &text["material"];
        report_stage(progress, "reading the recipe");
        root = parse_node(text["solid"], where + ": solid", parser);
        const Box own = solid_box(*root, where);
        const double scale = settings.height_m ? *settings.height_m / own.size().y : 1;
        at = Similarity::scaling(scale);
        box = placed(own, at);
        made.voxel_m = voxel_of(text, where, settings, box, scale);
        made.lod = lod_of(text, where, scale, made.voxel_m);
        lattice.voxel_m = made.voxel_m;
        if (const openvdb::FloatGrid* giver = root->lattice_giver()) {
            const Lattice given = lattice_of(*giver);
            if (std::fabs(given.voxel_m - made.voxel_m) <= 1e-9 * made.voxel_m)
                lattice = given;
        }
        made.recipe = settled(recipe, where, made, seed, scale);
    }
};

RecipeEstimate memory_of(const ReadyRecipe& ready, const RecipeSettings& settings,
                         Progress* progress) {
    report_stage(progress, "estimating");
    // Where holes of a law lie in a coarser solid is as good as where they will be.
    Lattice coarse = ready.lattice;
    coarse.voxel_m = std::max(coarse.voxel_m, ready.box.longest() / kCoarseDim);
    std::vector<std::string> found;
    std::vector<Sphere> holes;
    const RecipeScene scene{coarse, found, holes, progress};
    const auto cleaning = ready.root->cleaning();
    const auto field = cleaning ? cleaning->of->field(scene, ready.at * cleaning->by)
                                : ready.root->field(scene, ready.at);
    RecipeEstimate estimate;
    estimate.voxel_m = ready.lattice.voxel_m;
    estimate.size = estimate_size(*field, ready.lattice);
    estimate.memory = {.leaves = estimate.size.n_leaves,
                       .cleaned = cleaning.has_value(),
                       .meshed = settings.meshed};
    estimate.limit_bytes = memory_limit_bytes(settings.memory_bytes);
    return estimate;
}

} // namespace

RecipeEstimate estimate_recipe(const std::string& recipe, const std::string& where,
                               const RecipeAssets& assets, const RecipeSettings& settings,
                               Progress* progress) {
    check_settings(settings);
    return of_file(where, [&] {
        RecipeReport made;
        const ReadyRecipe ready(recipe, where, assets, settings, made, progress);
        refuse_if_too_large(0, ready.box, made.voxel_m);
        return memory_of(ready, settings, progress);
    });
}

RecipeSolid make_recipe(const std::string& recipe, const std::string& where,
                        const RecipeAssets& assets, const RecipeSettings& settings,
                        Progress* progress) {
    check_settings(settings);
    RecipeSolid made;
    of_file(where, [&] {
        const ReadyRecipe ready(recipe, where, assets, settings, made, progress);
        refuse_if_too_large(0, ready.box, made.voxel_m);
        MemoryUse least{.leaves = 0, .cleaned = true, .meshed = settings.meshed};
        const double limit = memory_limit_bytes(settings.memory_bytes);
        if (may_exceed(ready.box, made.voxel_m, least, limit))
            refuse_if_over(memory_of(ready, settings, progress).memory, made.voxel_m, limit);
        NodeSolid solid =
            ready.root->solid({ready.lattice, made.found, made.holes, progress}, ready.at);
        made.solid = std::move(solid.grid);
        made.field = std::move(solid.field);
    });
    return made;
}

RecipeTiles make_recipe_tiles(const std::string& recipe, const std::string& where,
                              const RecipeAssets& assets, const RecipeSettings& settings,
                              const std::filesystem::path& folder, int tile_voxels,
                              Progress* progress) {
    check_settings(settings);
    RecipeTiles made;
    of_file(where, [&] {
        const ReadyRecipe ready(recipe, where, assets, settings, made, progress);
        refuse_if_too_large(0, ready.box, made.voxel_m); // tiles are of any size
        const RecipeScene scene{ready.lattice, made.found, made.holes, progress};
        const auto cleaning = ready.root->cleaning();
        TileSettings tiles{tile_voxels, {}};
        if (cleaning)
            tiles.clean = cleaning->settings;
        const auto field = cleaning ? cleaning->of->tile_field(scene, ready.at * cleaning->by)
                                    : ready.root->tile_field(scene, ready.at);
        made.tiles = write_tiles(folder, *field, ready.lattice, tiles, made.recipe, progress);
        if (made.tiles.cleaned)
            for (const std::string& line : cleaning_lines(*made.tiles.cleaned))
                made.found.push_back(where + ": " + line);
    });
    return made;
}

std::string with_setting(const std::string& recipe, const std::string& where,
                         const std::string& key, const std::string& value) {
    read_recipe(recipe, where);
    ordered_json text = parse_ordered_json(recipe, where, kMostBytes);
    std::string path = key;
    if (!key.starts_with('/')) {
        const ordered_json names = text.value("set", ordered_json::object());
        std::vector<std::string> known{"seed", "dim", "voxel_m"};
        for (const auto& [name, to] : names.items())
            if (to.is_string())
                known.push_back(name);
        const std::vector<std::string_view> views(known.begin(), known.end());
        if (std::find(known.begin(), known.end(), key) == known.end())
            throw Error(Fault::bad_argument, where + ": there is no setting '" + printable(key) +
                                                 "'" + did_you_mean(key, views));
        path = names.contains(key) ? names[key].get<std::string>() : "/" + key;
    }
    ordered_json parsed;
    try {
        parsed = parse_ordered_json(value, where);
    } catch (const Error&) { // no JSON, or none of ours: a text
        if (!is_utf8(value))
            throw Error(Fault::bad_argument, where + ": '" + printable(key) + "' is '" +
                                                 printable(value) +
                                                 "', which is not UTF-8; write it as UTF-8");
        parsed = value;
    }
    try {
        const ordered_json::json_pointer pointer(path);
        if (!text.contains(pointer) && path.find('/', 1) != std::string::npos)
            throw Error(Fault::bad_argument,
                        where + ": there is nothing at '" + printable(path) + "'; see the recipe");
        if (path == "/dim")
            text.erase("voxel_m");
        if (path == "/voxel_m")
            text.erase("dim");
        text[pointer] = std::move(parsed);
    } catch (const ordered_json::exception&) {
        throw Error(Fault::bad_argument, where + ": '" + printable(path) +
                                             "' is no path; write "
                                             "it as /solid/sphere/size_m/0");
    }
    return text.dump();
}

} // namespace taihu
