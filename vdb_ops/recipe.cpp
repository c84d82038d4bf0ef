#include "vdb_ops/recipe.h"

#include <nlohmann/json.hpp>

#include "stats/core/error.h"
#include "stats/io/json_detail.h"

namespace taihu {
namespace {

using Json = nlohmann::ordered_json; // keys stay as they were put in

constexpr int kVersion = 1;

Json parsed(const std::string& node) {
    return Json::parse(node);
}

std::string node(const char* kind, Json body) {
    Json out;
    out[kind] = std::move(body);
    return out.dump();
}

Json maps_json(const RecipeMaps& maps) {
    Json json = {{"gutter_px", maps.gutter_px}, {"rays", maps.n_rays}};
    if (maps.side_px)
        json["size_px"] = *maps.side_px;
    if (maps.cage_m)
        json["cage_m"] = *maps.cage_m;
    if (maps.grain_m > 0) {
        json["grain_m"] = maps.grain_m;
        json["grain_contrast"] = maps.grain_contrast;
    }
    if (maps.only)
        json["only"] = *maps.only;
    if (maps.vertices)
        json["vertices"] = true;
    return json;
}

Json lod_json(const RecipeLod& lod) {
    Json json;
    if (lod.uniform())
        json["uniform"] = true;
    else if (lod.bounds_m.empty())
        json["triangles"] = lod.triangles;
    else
        json["bounds_m"] = lod.bounds_m;
    if (!lod.openness)
        json["openness"] = false;
    if (lod.at_foot)
        json["origin"] = "foot";
    if (lod.maps)
        json["maps"] = maps_json(*lod.maps);
    return json;
}

/// Null for holes anywhere.
Json pattern_json(const Pattern& pattern) {
    Json json;
    if (const auto* clusters = std::get_if<ClusterSettings>(&pattern))
        json[std::string(pattern_name(pattern))] = {{"clusters_m3", clusters->parents_m3},
                                                    {"spread_m", clusters->spread_m}};
    else if (const auto* joints = std::get_if<JointsPattern>(&pattern))
        json["joints"] = {{"n", joints->n}, {"scatter_m", joints->scatter_m}};
    else if (const auto* apart = std::get_if<HardCorePattern>(&pattern))
        json["hard_core"] = {{"gap_m", apart->gap_m}};
    else if (const auto* lattice = std::get_if<LatticePattern>(&pattern))
        json["lattice"] = {{"spacing_m", lattice->spacing_m}};
    return json;
}

/// A recipe's text as JSON; null when it is not one. It may come from any file: depth and size are
/// limited.
Json recipe_json(const std::string& recipe) {
    Json json;
    try {
        json = parse_ordered_json(recipe, "recipe");
    } catch (const Error&) {
        return nullptr;
    }
    if (!json.is_object() || !json.contains("taihu_recipe") || !json.contains("solid") ||
        !json["solid"].is_object())
        return nullptr;
    return json;
}

} // namespace

std::string shape_node(const ShapeSettings& s) {
    Json body;
    body["size_m"] = {s.size_m.x, s.size_m.y, s.size_m.z};
    if (s.kind == ShapeKind::rounded_box)
        body["round_m"] = s.round_m;
    if (s.kind == ShapeKind::torus)
        body["tube_m"] = s.tube_m;
    if (s.kind == ShapeKind::superquadric)
        body["exponents"] = {s.vertical, s.around};
    if (s.kind == ShapeKind::icosphere || s.kind == ShapeKind::boulder)
        body["subdivisions"] = s.subdivisions;
    if (s.kind == ShapeKind::boulder) {
        body["relief"] = s.relief;
        body["lumps"] = s.lumps;
        body["seed"] = s.seed;
    }
    if (s.kind == ShapeKind::fractal_rock) {
        body["base"] = s.fractal.base;
        body["iterations"] = s.fractal.iterations;
        body["damping"] = damping_name(s.fractal.damping);
        body["along"] = along_name(s.fractal.along);
        body["amplitude"] = s.fractal.amplitude;
        body["hurst"] = {s.fractal.hurst_up, s.fractal.hurst_down};
        body["corners"] = s.fractal.corners;
        body["roundness"] = s.fractal.roundness;
        body["seed"] = s.seed;
    }
    return node(std::string(shape_name(s.kind)).c_str(), std::move(body));
}

std::string mesh_node(const std::string& name, const std::string& sha256, double unit_m, bool z_up,
                      const CloseSettings& close) {
    Json body = {{"file", name}, {"sha256", sha256}, {"unit_m", unit_m}};
    if (z_up)
        body["up"] = "z";
    if (close.rule != CloseRule::loops)
        body["close"] = close_rule_name(close.rule);
    if (close.shells != ShellRule::unite)
        body["shells"] = shell_rule_name(close.shells);
    return node("mesh", std::move(body));
}

std::string level_set_node(const std::string& name, const std::string& sha256) {
    return node("level_set", {{"file", name}, {"sha256", sha256}});
}

std::string holes_node(const std::string& name, const std::string& sha256) {
    return node("holes", {{"file", name}, {"sha256", sha256}});
}

std::string holes_node(const std::string& name, const std::string& sha256,
                       const Placement& placement, const HoleSources& sources) {
    Json body = {{"law", name}, {"sha256", sha256}};
    if (sources.empirical)
        body["empirical"] = true;
    if (placement.count)
        body["count"] = *placement.count;
    if (placement.porosity)
        body["porosity"] = *placement.porosity;
    if (placement.density_m3)
        body["density_m3"] = *placement.density_m3;
    body["scale_m"] = placement.scale_m;
    body["seed"] = placement.seed;
    if (Json pattern = pattern_json(placement.pattern); !pattern.is_null())
        body["pattern"] = std::move(pattern);
    if (placement.height)
        body["height"] = {placement.height->bottom, placement.height->top};
    if (sources.where)
        body["where"] = {{"file", sources.where->name}, {"sha256", sources.where->sha256}};
    return node("holes", std::move(body));
}

std::string difference_node(const std::string& of, const std::string& minus) {
    return node("difference", {{"of", {parsed(of), parsed(minus)}}});
}

std::string clean_node(const std::string& of, const CleanSettings& settings) {
    Json body = {{"of", parsed(of)}};
    if (settings.n_pieces)
        body["pieces"] = *settings.n_pieces;
    else
        body["pieces"] = "all";
    body["bubbles"] = settings.fill_bubbles ? "fill" : "keep";
    if (settings.min_neck_m > 0)
        body["min_neck_m"] = settings.min_neck_m;
    if (settings.foot_deg > 0)
        body["foot_deg"] = settings.foot_deg;
    return node("clean", std::move(body));
}

std::string format_recipe(const std::string& solid, double voxel_m, std::uint64_t seed,
                          const std::optional<RecipeLod>& lod) {
    Json json = {{"taihu_recipe", kVersion}, {"seed", seed}, {"voxel_m", voxel_m}};
    if (lod)
        json["lod"] = lod_json(*lod);
    json["solid"] = parsed(solid);
    return json.dump();
}

std::optional<std::string> recipe_solid(const std::string& recipe) {
    const Json json = recipe_json(recipe);
    if (json.is_null())
        return std::nullopt;
    return json["solid"].dump();
}

} // namespace taihu
