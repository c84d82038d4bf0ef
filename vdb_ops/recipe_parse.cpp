#include "vdb_ops/recipe_parse_detail.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

#include <nlohmann/json.hpp>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/folder_file.h"
#include "stats/core/rng.h"
#include "stats/core/sha256.h"
#include "stats/core/text.h"
#include "stats/io/holes_file.h"
#include "stats/io/json_detail.h"
#include "stats/io/law_file.h"
#include "vdb_ops/estimate.h"
#include "vdb_ops/recipe_keys_detail.h"
#include "vdb_ops/vdb_file.h"

namespace taihu {
namespace {

using nlohmann::json;
using Node = std::unique_ptr<RecipeNode>;

constexpr std::uint32_t kSeedStream = 0x72637065;
constexpr double kMost_m = kMostLength_m;
constexpr double kMostSeed = 1.8446744073709551e19;
constexpr double kTriangle_bytes = 300; // of a closed mesh and its field at the peak, as measured

[[noreturn]] void refuse_unknown(const std::string& where, const char* what,
                                 const std::string& name, std::span<const std::string_view> known) {
    const std::string nearest = did_you_mean(name, known);
    refuse(where, "unknown " + std::string(what) + " '" + printable(name) + "'" +
                      (nearest.empty() ? "; use one of the recipe's schema" : nearest));
}

FractalSettings fractal_of(const Keys& keys) {
    FractalSettings f;
    if (keys.has("base"))
        f.base = static_cast<int>(keys.whole("base", 5));
    if (keys.has("iterations"))
        f.iterations = static_cast<int>(keys.whole("iterations", 8));
    f.damping = damping_from_name(keys.word("damping", damping_name(f.damping).data(), "none",
                                            "interpolating", "approximating"));
    f.along = along_from_name(keys.word("along", along_name(f.along).data(), "radius", "normal"));
    f.amplitude = keys.number_or("amplitude", f.amplitude, 0, 1);
    if (keys.has("hurst"))
        std::tie(f.hurst_up, f.hurst_down) = keys.pair("hurst", 0.05, 2);
    f.corners = keys.number_or("corners", f.corners, 0, 1);
    f.roundness = keys.number_or("roundness", f.roundness, 0, 1);
    return f;
}

/// Of the mesh that a shape's field is made of; 0 where it is a formula.
double n_triangles(const ShapeSettings& s) {
    if (s.kind == ShapeKind::icosphere || s.kind == ShapeKind::boulder)
        return 20 * std::exp2(2 * s.subdivisions);
    if (s.kind == ShapeKind::fractal_rock)
        return 20 * std::exp2(2 * s.fractal.base +
                              (s.fractal.damping == Damping::none ? 2 : 4) * s.fractal.iterations);
    return 0;
}

Node parse_shape(ShapeKind kind, const json& body, const std::string& where, RecipeParser& parser) {
    ShapeSettings s;
    s.kind = kind;
    const bool seeded = kind == ShapeKind::boulder || kind == ShapeKind::fractal_rock;
    const Keys keys = [&]() -> Keys {
        switch (kind) {
        case ShapeKind::torus:
            return {body, where, {"size_m"}, {"tube_m"}};
        case ShapeKind::icosphere:
            return {body, where, {"size_m"}, {"subdivisions"}};
        case ShapeKind::boulder:
            return {body, where, {"size_m"}, {"subdivisions", "relief", "lumps", "seed"}};
        case ShapeKind::fractal_rock:
            return {body,
                    where,
                    {"size_m"},
                    {"base", "iterations", "damping", "along", "amplitude", "hurst", "corners",
                     "roundness", "seed"}};
        case ShapeKind::rounded_box:
            return {body, where, {"size_m"}, {"round_m"}};
        case ShapeKind::superquadric:
            return {body, where, {"size_m"}, {"exponents"}};
        default:
            return {body, where, {"size_m"}};
        }
    }();
    s.size_m = keys.vector("size_m", 1e-9, kMost_m);
    s.tube_m = keys.number_or("tube_m", 0.25 * s.size_m.x, 1e-9, kMost_m);
    s.round_m = keys.number_or("round_m", 0.2 * std::min({s.size_m.x, s.size_m.y, s.size_m.z}),
                               1e-9, kMost_m);
    if (keys.has("exponents"))
        std::tie(s.vertical, s.around) = keys.pair("exponents", 0.1, 2);
    if (keys.has("subdivisions"))
        s.subdivisions = static_cast<int>(keys.whole("subdivisions", 8));
    s.relief = keys.number_or("relief", s.relief, 0, 0.9);
    s.lumps = keys.number_or("lumps", s.lumps, 0.1, 16);
    if (kind == ShapeKind::fractal_rock)
        s.fractal = fractal_of(keys);
    if (seeded)
        s.seed = seed_of(keys, parser);
    parser.charge(kTriangle_bytes * n_triangles(s), where);
    return make_shape_node(s);
}

/// The half space below a plane: what its normal points away from.
Node parse_plane(const json& body, const std::string& where, RecipeParser&) {
    const Keys keys(body, where, {}, {"normal", "point_m"});
    const Vec3 normal = keys.has("normal") ? keys.vector("normal", -1e6, 1e6) : Vec3{0, 1, 0};
    const Vec3 point = keys.has("point_m") ? keys.vector("point_m", -kMost_m, kMost_m) : Vec3{};
    const double n = length(normal);
    if (!(n > 1e-9))
        refuse(where, "'normal' has no length; give a direction");
    // Turn +Y into the normal, about the axis across both.
    const Vec3 axis = cross({0, 1, 0}, normal);
    const double angle = std::atan2(length(axis), normal.y);
    const Similarity turn = length(axis) > 1e-12 * n ? Similarity::rotation(axis, angle)
                            : normal.y > 0           ? Similarity()
                                           : Similarity::rotation({1, 0, 0}, std::numbers::pi);
    return make_plane_node(Similarity::translation(point) * turn);
}

Node parse_mesh(const json& body, const std::string& where, RecipeParser& parser) {
    const Keys keys(body, where, {"file", "sha256"}, {"unit_m", "up", "close", "shells"});
    const auto path = file_of(keys, "file", parser);
    const double unit_m = keys.number_or("unit_m", 1, 1e-9, 1e9);
    const bool z_up = keys.word("up", "y", "y", "z") == "z";
    const std::string rule = keys.word("close", "loops", "loops", "winding", "plane", "none");
    const std::string shells = keys.word("shells", "union", "union", "parity");
    if (rule == "winding" && keys.has("shells"))
        refuse(where, "'shells' is for shells taken one by one, and 'close' \"winding\" takes them "
                      "all at once; drop one of them");
    if (!parser.assets.read_mesh)
        refuse(where, "nothing here reads mesh files; voxelize it first");
    TriMesh mesh = parser.assets.read_mesh(path, unit_m, z_up);
    parser.charge(kTriangle_bytes * static_cast<double>(mesh.triangles.size()), where);
    return make_mesh_node(std::move(mesh), where, close_settings(rule, shells));
}

Node parse_level_set(const json& body, const std::string& where, RecipeParser& parser) {
    const Keys keys(body, where, {"file", "sha256"});
    const auto solid = read_vdb(file_of(keys, "file", parser)).solid;
    parser.charge(static_cast<double>(solid->memUsage()), where);
    return make_level_set_node(solid);
}

Node parse_combined(Combine how, const json& body, const std::string& where, RecipeParser& parser) {
    const Keys keys(body, where, {"of"}, {"blend_m"});
    const double blend_m = keys.number_or("blend_m", 0, 0, kMost_m);
    return make_combined_node(how, parse_children(keys, parser, 2), blend_m);
}

Node parse_transform(const json& body, const std::string& where, RecipeParser& parser) {
    const Keys keys(body, where, {"of"}, {"scale", "axis", "angle_deg", "move_m"});
    Similarity by = Similarity::scaling(keys.number_or("scale", 1, 1e-9, 1e9));
    if (keys.has("angle_deg") != keys.has("axis"))
        refuse(where, "a turn needs 'axis' and 'angle_deg'; give both or none");
    if (keys.has("axis"))
        by = Similarity::rotation(keys.vector("axis", -1e6, 1e6),
                                  keys.number("angle_deg", -3600, 3600) * std::numbers::pi / 180) *
             by;
    if (keys.has("move_m"))
        by = Similarity::translation(keys.vector("move_m", -kMost_m, kMost_m)) * by;
    return make_transform_node(std::move(parse_children(keys, parser, 1).front()), by);
}

Node parse_offset(const json& body, const std::string& where, RecipeParser& parser) {
    const Keys keys(body, where, {"of", "by_m"});
    return make_offset_node(std::move(parse_children(keys, parser, 1).front()),
                            keys.number("by_m", -kMost_m, kMost_m));
}

Node parse_shell(const json& body, const std::string& where, RecipeParser& parser) {
    const Keys keys(body, where, {"of"}, {"inwards_m", "outwards_m"});
    return make_shell_node(std::move(parse_children(keys, parser, 1).front()),
                           keys.number_or("inwards_m", 0, 0, kMost_m),
                           keys.number_or("outwards_m", 0, 0, kMost_m));
}

Node parse_embed(const json& body, const std::string& where, RecipeParser& parser) {
    const Keys keys(body, where, {"of"}, {"gap_m"});
    return make_embed_node(parse_children(keys, parser, 2), keys.number_or("gap_m", 0, 0, kMost_m));
}

Node parse_clean(const json& body, const std::string& where, RecipeParser& parser) {
    const Keys keys(body, where, {"of"}, {"pieces", "bubbles", "min_neck_m", "foot_deg"});
    CleanSettings settings;
    settings.min_neck_m = keys.number_or("min_neck_m", 0, 0, kMost_m);
    settings.foot_deg = keys.number_or("foot_deg", 0, 0, 60);
    if (keys.has("pieces") && keys.value("pieces") == "all")
        settings.n_pieces.reset();
    else if (keys.has("pieces"))
        settings.n_pieces = std::max<std::size_t>(1, keys.whole("pieces", 1e9));
    settings.fill_bubbles = keys.word("bubbles", "fill", "fill", "keep") == "fill";
    return make_clean_node(std::move(parse_children(keys, parser, 1).front()), settings, where);
}

/// A law in the recipe itself, or that of a file.
Law parse_hole_law(const Keys& keys, RecipeParser& parser) {
    const json& law = keys.value("law");
    if (law.is_object()) {
        const Keys body(law, keys.where() + ".law", {"family", "parameters"});
        const Family family = family_from_name(body.text("family"));
        const auto names = parameter_names(family);
        const json& parameters = body.value("parameters");
        check_keys(parameters, body.where() + ".parameters", names);
        std::vector<double> values;
        for (const std::string_view name : names)
            values.push_back(
                json_number(parameters, body.where() + ".parameters", name, -1e12, 1e12));
        return Law(family, values);
    }
    const LawFile file = read_law_file(file_of(keys, "law", parser));
    if (!keys.has("empirical") || keys.value("empirical") == false)
        return file.law;
    if (keys.value("empirical") != true)
        refuse(keys.where(), "'empirical' must be true or false");
    if (file.empirical.empty())
        refuse(keys.where(), "the law has no table for 'empirical'; fit it again, or drop the key");
    return Law::empirical(file.empirical);
}

Pattern parse_pattern(const json& pattern, const std::string& where) {
    if (!pattern.is_object() || pattern.size() != 1)
        refuse(where, "must be an object of one pattern");
    const std::string kind = pattern.begin().key();
    const json& body = pattern.begin().value();
    const std::string inside = where + "." + printable(kind);
    if (kind == "thomas" || kind == "matern") {
        const Keys keys(body, inside, {"clusters_m3", "spread_m"});
        return ClusterSettings{kind == "thomas" ? ClusterSettings::Shape::thomas
                                                : ClusterSettings::Shape::matern,
                               keys.number("clusters_m3", 1e-18, 1e18), keys.length("spread_m")};
    }
    if (kind == "joints") {
        const Keys keys(body, inside, {"n", "scatter_m"});
        return JointsPattern{static_cast<int>(keys.whole("n", 1000)), keys.length("scatter_m")};
    }
    if (kind == "hard_core") {
        const Keys keys(body, inside, {"gap_m"});
        return HardCorePattern{keys.number("gap_m", 0, kMost_m)};
    }
    if (kind == "lattice") {
        const Keys keys(body, inside, {"spacing_m"});
        return LatticePattern{keys.length("spacing_m")};
    }
    static constexpr std::string_view kKinds[] = {"thomas", "matern", "joints", "hard_core",
                                                  "lattice"};
    refuse_unknown(where, "pattern", kind, kKinds);
}

Box parse_box(const Keys& keys) {
    const json& v = keys.value("box_m");
    if (!v.is_array() || v.size() != 2)
        refuse(keys.where(), "'box_m' must be two corners");
    const json corners = {{"lo", v[0]}, {"hi", v[1]}};
    const Keys read(corners, keys.where() + ".box_m", {"lo", "hi"});
    Box box;
    box.include(read.vector("lo", -kMost_m, kMost_m));
    box.include(read.vector("hi", -kMost_m, kMost_m));
    return box;
}

Node parse_holes(const json& body, const std::string& where, RecipeParser& parser) {
    if (body.is_object() && body.contains("file")) {
        const Keys keys(body, where, {"file", "sha256"});
        return make_holes_node(read_holes(file_of(keys, "file", parser)));
    }
    const Keys keys(body, where, {"law"},
                    {"sha256", "empirical", "count", "porosity", "density_m3", "scale_m", "seed",
                     "pattern", "height", "where", "box_m"});
    if (keys.value("law").is_string() != keys.has("sha256"))
        refuse(where, "a law file has a 'sha256', a law in the recipe has none");
    Placement p;
    p.scale_m = keys.has("scale_m") ? keys.length("scale_m") : 1;
    if (keys.has("count"))
        p.count = keys.whole("count", 1e8);
    if (keys.has("porosity"))
        p.porosity = keys.number("porosity", 0, 0.95);
    if (keys.has("density_m3"))
        p.density_m3 = keys.number("density_m3", 1e-18, 1e18);
    p.seed = seed_of(keys, parser);
    if (keys.has("pattern"))
        p.pattern = parse_pattern(keys.value("pattern"), where + ".pattern");
    if (keys.has("height")) {
        const auto [bottom, top] = keys.pair("height", 0, 1);
        p.height = HeightShare{bottom, top};
    }
    if (keys.has("where")) {
        const Keys file(keys.value("where"), where + ".where", {"file", "sha256"});
        p.where = read_volume(file_of(file, "file", parser));
    }
    std::optional<Box> box;
    if (keys.has("box_m"))
        box = parse_box(keys);
    return make_holes_node(parse_hole_law(keys, parser), p, box, where);
}

using Parse = Node (*)(const json&, const std::string&, RecipeParser&);

template <Combine how>
Node parse_combine(const json& body, const std::string& where, RecipeParser& parser) {
    return parse_combined(how, body, where, parser);
}

Node parse_material(const json& body, const std::string& where, RecipeParser& parser) {
    const Keys keys(body, where, {});
    if (!parser.material)
        refuse(where, "the recipe has no 'material'; add one beside 'solid'");
    return parse_holes(*parser.material, where.substr(0, where.find(": solid")) + ": material",
                       parser);
}

constexpr std::pair<std::string_view, Parse> kNodes[] = {
    {"rough", parse_rough},
    {"relief", parse_relief_node},
    {"warp", parse_warp},
    {"weather", parse_weather},
    {"bites", parse_bites},
    {"plane", parse_plane},
    {"mesh", parse_mesh},
    {"level_set", parse_level_set},
    {"union", parse_combine<Combine::unite>},
    {"intersection", parse_combine<Combine::intersect>},
    {"difference", parse_combine<Combine::subtract>},
    {"transform", parse_transform},
    {"offset", parse_offset},
    {"shell", parse_shell},
    {"embed", parse_embed},
    {"clean", parse_clean},
    {"holes", parse_holes},
    {"material", parse_material}};

} // namespace

std::vector<Node> parse_children(const Keys& keys, RecipeParser& parser, std::size_t at_least) {
    const json& of = keys.value("of");
    std::vector<Node> nodes;
    if (!of.is_array()) {
        if (at_least > 1)
            refuse(keys.where(),
                   "'of' must be a list of " + std::to_string(at_least) + " nodes or more");
        nodes.push_back(parse_node(of, keys.where() + ".of", parser));
        return nodes;
    }
    for (std::size_t i = 0; i < of.size(); ++i)
        nodes.push_back(parse_node(of[i], keys.where() + ".of[" + std::to_string(i) + "]", parser));
    if (nodes.size() < at_least || (at_least == 1 && nodes.size() != 1))
        refuse(keys.where(), "'of' has " + std::to_string(nodes.size()) + " nodes; it needs " +
                                 (at_least == 1 ? "one" : std::to_string(at_least) + " or more"));
    return nodes;
}

std::filesystem::path file_of(const Keys& keys, const char* key, const RecipeParser& parser) {
    const std::string name = keys.text(key), sha256 = keys.text("sha256");
    if (!is_plain_name(name))
        refuse(keys.where(), "'" + std::string(key) + "' is '" + printable(name) +
                                 "'; must be a name without folders");
    for (const std::filesystem::path& folder : parser.assets.folders) {
        const auto path = file_in(folder, name);
        if (!path)
            continue;
        const std::string found = sha256_hex(read_file(*path));
        if (found != sha256)
            refuse(keys.where(), "'" + name +
                                     "' is another file than the one the recipe means "
                                     "(its SHA-256 begins with " +
                                     found.substr(0, 8) + ", not " +
                                     printable(sha256.substr(0, 8)) +
                                     "); find that one, or correct "
                                     "sha256");
        return *path;
    }
    throw Error(Fault::io, keys.where() + ": there is no file '" + name +
                               "' beside the recipe; put it there, or name its folder (--assets)");
}

std::uint64_t seed_of(const Keys& keys, RecipeParser& parser) {
    return keys.has("seed") ? keys.whole("seed", kMostSeed) : parser.next_seed();
}

void RecipeParser::charge(double bytes, const std::string& where) {
    n_bytes += bytes;
    if (n_bytes > most_bytes)
        throw Error(Fault::unsupported,
                    where + ": refused: the parts up to here would need about " +
                        human_bytes(n_bytes) + " (limit " + human_bytes(most_bytes) +
                        "); use fewer subdivisions, iterations or parts");
}

std::uint64_t RecipeParser::next_seed() {
    const auto w = Rng{seed, kSeedStream}.words(n_seeded++);
    return std::uint64_t{w[0]} << 32 | w[1];
}

std::unique_ptr<RecipeNode> parse_node(const json& node, const std::string& where,
                                       RecipeParser& parser) {
    if (!node.is_object() || node.size() != 1)
        refuse(where, "a node is an object with one key, its kind");
    const std::string kind = node.begin().key();
    const json& body = node.begin().value();
    const std::string inside = where + "." + printable(kind);
    try {
        for (const auto& [name, parse] : kNodes)
            if (name == kind)
                return parse(body, inside, parser);
        for (int i = 0; i <= static_cast<int>(ShapeKind::fractal_rock); ++i)
            if (const auto shape = static_cast<ShapeKind>(i); shape_name(shape) == kind)
                return parse_shape(shape, body, inside, parser);
    } catch (const Error& e) { // what would be an argument's fault is the file's here
        if (e.fault() != Fault::bad_argument)
            throw;
        std::string what = e.what();
        if (!what.starts_with(inside))
            what = inside + ": " + what;
        if (what.find(';') == std::string::npos)
            what += "; correct it";
        throw Error(Fault::bad_input, what);
    }
    std::vector<std::string_view> known;
    for (const auto& [name, parse] : kNodes)
        known.push_back(name);
    for (int i = 0; i <= static_cast<int>(ShapeKind::fractal_rock); ++i)
        known.push_back(shape_name(static_cast<ShapeKind>(i)));
    refuse_unknown(where, "kind", kind, known);
}

} // namespace taihu
