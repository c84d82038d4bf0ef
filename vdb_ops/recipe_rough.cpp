#include <functional>
#include <tuple>
#include <utility>

#include "vdb_ops/bites.h"
#include "vdb_ops/placed_level_set_field.h"
#include "vdb_ops/recipe_keys_detail.h"
#include "vdb_ops/recipe_node_detail.h"
#include "vdb_ops/relief.h"
#include "vdb_ops/roughen.h"
#include "vdb_ops/weather.h"

// Nodes that work on the level set of what they are of: rough, relief, warp, weather, bites.

namespace taihu {
namespace {

using nlohmann::json;
using Node = std::unique_ptr<RecipeNode>;

/// What such a node does to a level set; its lines for people are put behind those of the scene.
/// \param box  of the solid, before it was put at `at`.
using Operation =
    std::function<openvdb::FloatGrid::Ptr(const openvdb::FloatGrid& solid, const Box& box,
                                          const Similarity& at, const RecipeScene& scene)>;

class LevelSetOperationNode final : public RecipeNode {
public:
    /// \param growth_m  of the solid, about: its box decides the voxel and the height alone.
    LevelSetOperationNode(Node of, Operation operation, double growth_m, const char* stage,
                          std::string where)
        : of_(std::move(of)), operation_(std::move(operation)), growth_m_(growth_m), stage_(stage),
          where_(std::move(where)) {}

    Box box(const Similarity& at) const override {
        return of_->box(at).dilated(growth_m_ * at.scale());
    }
    std::shared_ptr<const Field> field(const RecipeScene& scene,
                                       const Similarity& at) const override {
        return std::make_shared<PlacedLevelSetField>(solid(scene, at).grid);
    }
    NodeSolid solid(const RecipeScene& scene, const Similarity& at) const override {
        openvdb::FloatGrid::Ptr grid = made_.lock();
        if (grid && made_on_ == scene.lattice && made_at_ == at)
            return {grid, nullptr};
        const NodeSolid of = of_->solid(scene, at);
        report_stage(scene.progress, stage_);
        grid = operation_(*of.grid, of_->box({}), at, scene);
        made_ = grid;
        made_on_ = scene.lattice;
        made_at_ = at;
        return {grid, nullptr};
    }
    std::shared_ptr<const Field> tile_field(const RecipeScene&, const Similarity&) const override {
        throw Error(Fault::unsupported, where_ + ": needs the whole solid in memory, and tiles are "
                                                 "made one by one; make it without --tiles, or "
                                                 "with a larger voxel");
    }
    const openvdb::FloatGrid* lattice_giver() const override { return of_->lattice_giver(); }

private:
    Node of_;
    Operation operation_;
    double growth_m_;
    const char* stage_;
    std::string where_;
    /// The last solid, while anyone holds it: nodes around may ask for it more than once.
    mutable std::weak_ptr<openvdb::FloatGrid> made_;
    mutable Lattice made_on_;
    mutable Similarity made_at_;
};

Node only_child(const Keys& keys, RecipeParser& parser) {
    return std::move(parse_children(keys, parser, 1).front());
}

double meters(const Keys& keys, const char* key, double otherwise) {
    return keys.has(key) ? keys.length(key) : otherwise;
}

/// `largest_m` and what there is of the rest.
NoiseSettings parse_noise(const Keys& keys, RecipeParser& parser) {
    NoiseSettings noise;
    noise.largest_m = keys.length("largest_m");
    noise.smallest_m = meters(keys, "smallest_m", noise.largest_m / 16);
    if (keys.has("hurst") && !keys.value("hurst").is_array())
        noise.hurst = keys.number("hurst", 0.05, 2);
    if (keys.has("along"))
        noise.along = keys.vector("along", -1e6, 1e6);
    noise.stretch = keys.number_or("stretch", 1, 0.01, 100);
    noise.seed = seed_of(keys, parser);
    check_noise(noise, keys.where());
    return noise;
}

bool flag(const Keys& keys, const char* key) {
    if (!keys.has(key))
        return false;
    if (!keys.value(key).is_boolean())
        refuse(keys.where(), "'" + std::string(key) + "' must be true or false");
    return keys.value(key).get<bool>();
}

/// Keys that a kind of relief takes; others would have no effect.
void check_relief_keys(const json& body, const std::string& where, Relief relief) {
    switch (relief) {
    case Relief::fractal:
        Keys(body, where, {"of", "amplitude_m", "largest_m"},
             {"relief", "smallest_m", "hurst", "along", "stretch", "removes", "facing", "inside",
              "height", "seed"});
        break;
    case Relief::furrows:
        Keys(body, where, {"of", "amplitude_m", "largest_m"},
             {"relief", "smallest_m", "hurst", "along", "stretch", "sharpness", "facing", "inside",
              "height", "seed"});
        break;
    case Relief::facets:
        Keys(body, where, {"of", "amplitude_m", "largest_m"},
             {"relief", "along", "stretch", "crack", "removes", "facing", "inside", "height",
              "seed"});
        break;
    case Relief::beds:
        Keys(body, where, {"of", "amplitude_m", "largest_m"},
             {"relief", "along", "removes", "facing", "inside", "height", "seed"});
        break;
    case Relief::tile: // a node of its own
        break;
    }
}

/// Where there is more of it and where less. Heights of the solid are known later.
void parse_shares(const Keys& keys, RoughenSettings& s) {
    if (keys.has("facing")) {
        const Vec3 f = keys.vector("facing", 0, 10);
        s.facing = {f.x, f.y, f.z};
    }
    if (keys.has("inside")) {
        const Keys in(keys.value("inside"), keys.where() + ".inside", {"mouth_m", "share"});
        s.inside = InsideShare{in.number("mouth_m", 1e-9, 1e5), in.number("share", 0, 10)};
    }
    if (keys.has("height")) {
        const auto [bottom, top] = keys.pair("height", 0, 10);
        s.height = HeightShares{0, 1, bottom, top};
    }
}

Node roughening(const Keys& keys, RecipeParser& parser, const RoughenSettings& s) {
    return std::make_unique<LevelSetOperationNode>(
        only_child(keys, parser),
        [s](const openvdb::FloatGrid& solid, const Box& box, const Similarity& at,
            const RecipeScene& scene) {
            RoughenSettings own = s;
            own.tile.frame = box;
            if (own.height) {
                own.height->bottom_m = box.lo.y;
                own.height->top_m = box.hi.y;
            }
            return roughen(solid, own, at, scene.progress);
        },
        usual_growth_m(s), "roughening", keys.where());
}

/// Refuses more points than a recipe's tiles may have together: files are hostile.
void count_points(std::uint64_t side_px, const Keys& keys, RecipeParser& parser) {
    constexpr std::uint64_t kMostPoints = std::uint64_t{1} << 26;
    parser.n_tile_points += side_px * side_px;
    if (parser.n_tile_points > kMostPoints)
        refuse(keys.where(), "the tiles of the recipe have more than 2^26 points; use smaller or "
                             "fewer ones");
}

/// That of a file, or one made here.
ReliefTile parse_tile(const Keys& keys, RecipeParser& parser) {
    json body = keys.value("tile");
    const std::string where = keys.where() + ".tile";
    ReliefTile tile;
    if (body.is_object() && body.contains("file")) {
        const Keys file(body, where, {"file", "sha256"});
        const auto path = file_of(file, "file", parser);
        if (!parser.assets.read_relief)
            refuse(where, "nothing here reads tiles; give what makes one, as {\"taihu_relief\": 1, "
                          "\"law\": \"fractal\"}");
        tile = parser.assets.read_relief(path);
        count_points(static_cast<std::uint64_t>(std::max(tile.heights.width, tile.heights.height)),
                     keys, parser);
    } else {
        if (body.is_object() && !body.contains("seed"))
            body["seed"] = parser.next_seed();
        ReliefSettings made = parse_relief(body.dump(), where);
        made.n_colors = 0; // heights are all that is laid around
        count_points(static_cast<std::uint64_t>(made.size_px), keys, parser);
        tile = make_relief(made);
    }
    if (keys.has("side_m"))
        tile.pixel_m = keys.length("side_m") / std::max(1, tile.heights.width - !tile.tileable);
    if (!(tile.pixel_m > 0))
        refuse(keys.where(), "the tile does not say how large it is; give 'side_m'");
    return tile;
}

Relief parse_relief_name(const Keys& keys) {
    const std::string name = keys.word("relief", "fractal", "fractal", "furrows", "facets", "beds");
    return name == "furrows"  ? Relief::furrows
           : name == "facets" ? Relief::facets
           : name == "beds"   ? Relief::beds
                              : Relief::fractal;
}

} // namespace

Node parse_rough(const json& body, const std::string& where, RecipeParser& parser) {
    const Keys keys(body, where, {"of", "amplitude_m", "largest_m"},
                    {"relief", "smallest_m", "hurst", "along", "stretch", "removes", "sharpness",
                     "crack", "facing", "inside", "height", "seed"});
    RoughenSettings s;
    s.relief = parse_relief_name(keys);
    check_relief_keys(body, where, s.relief);
    s.amplitude_m = keys.number("amplitude_m", 0, 1e5);
    s.noise = parse_noise(keys, parser);
    if (keys.has("hurst") && keys.value("hurst").is_array()) {
        if (s.relief != Relief::fractal)
            refuse(where, "'hurst' is a pair; only a fractal has one for up and one for down");
        const auto [up, down] = keys.pair("hurst", 0.05, 2);
        s.noise.hurst = up;
        s.hurst_down = down;
    }
    s.removes = flag(keys, "removes");
    s.sharpness = keys.number_or("sharpness", s.sharpness, 0.25, 16);
    s.crack = keys.number_or("crack", s.crack, 0, 2);
    parse_shares(keys, s);
    return roughening(keys, parser, s);
}

Node parse_relief_node(const json& body, const std::string& where, RecipeParser& parser) {
    const Keys keys(
        body, where, {"of", "tile"},
        {"amplitude_m", "side_m", "sharpness", "removes", "facing", "inside", "height"});
    ReliefTile tile = parse_tile(keys, parser);
    std::vector<float>& heights = tile.heights.pixels;
    double most_m = 0;
    for (const float h : heights)
        most_m = std::max(most_m, std::fabs(static_cast<double>(h)));
    for (float& h : heights)
        h = most_m > 0 ? static_cast<float>(static_cast<double>(h) / most_m) : 0;
    RoughenSettings s;
    s.relief = Relief::tile;
    s.amplitude_m = keys.number_or("amplitude_m", most_m, 0, 1e5);
    s.tile.sharpness = keys.number_or("sharpness", s.tile.sharpness, 1, 64);
    s.tile.tile = std::make_shared<const ReliefTile>(std::move(tile));
    s.removes = flag(keys, "removes");
    parse_shares(keys, s);
    return roughening(keys, parser, s);
}

Node parse_warp(const json& body, const std::string& where, RecipeParser& parser) {
    const Keys keys(body, where, {"of", "amplitude_m", "largest_m"},
                    {"smallest_m", "hurst", "along", "stretch", "seed"});
    WarpSettings s;
    s.amplitude_m = keys.number("amplitude_m", 0, 1e5);
    if (keys.has("hurst"))
        keys.number("hurst", 0.05, 2); // a pair is for rough
    s.noise = parse_noise(keys, parser);
    return std::make_unique<LevelSetOperationNode>(
        only_child(keys, parser),
        [s](const openvdb::FloatGrid& solid, const Box&, const Similarity& at,
            const RecipeScene& scene) { return warp(solid, s, at, scene.progress); },
        usual_growth_m(s), "warping", where);
}

Node parse_weather(const json& body, const std::string& where, RecipeParser& parser) {
    const Keys keys(body, where, {"of", "sigma_m"},
                    {"steps", "rounding", "hollowing", "durability"});
    WeatherSettings s;
    s.sigma_m = keys.number("sigma_m", 1e-9, 1e5);
    if (keys.has("steps"))
        s.steps = static_cast<int>(keys.whole("steps", 1000));
    s.rounding = keys.number_or("rounding", s.rounding, 0, 1);
    s.hollowing = keys.number_or("hollowing", s.hollowing, -1, 1);
    if (keys.has("durability")) {
        const Keys d(keys.value("durability"), where + ".durability", {"contrast", "largest_m"},
                     {"smallest_m", "hurst", "along", "stretch", "seed"});
        s.durability = Durability{d.number("contrast", 0, 2), parse_noise(d, parser)};
    }
    check_weather_settings(s);
    return std::make_unique<LevelSetOperationNode>(
        only_child(keys, parser),
        [s, where](const openvdb::FloatGrid& solid, const Box&, const Similarity& at,
                   const RecipeScene& scene) {
            const WeatherResult r = weather(solid, s, at, scene.progress);
            const auto change = [](double before, double after) {
                const double percent = before > 0 ? 100 * (after - before) / before : 0;
                return (percent > 0 ? "+" : "") + rounded(percent) + " %";
            };
            scene.found.push_back(where + ": volume " +
                                  change(r.volume_before_m3, r.volume_after_m3) + ", area " +
                                  change(r.area_before_m2, r.area_after_m2));
            return r.solid;
        },
        0, "weathering", where);
}

Node parse_bites(const json& body, const std::string& where, RecipeParser& parser) {
    const Keys keys(body, where, {"of", "count", "mean_m", "least_m", "most_m"},
                    {"aspect", "aspect_spread", "along", "jitter", "begin", "offset",
                     "offset_spread", "rim", "chain", "height", "clusters", "seed"});
    BiteSettings s;
    s.count = keys.whole("count", 1e6);
    s.mean_m = keys.length("mean_m");
    s.least_m = keys.length("least_m");
    s.most_m = keys.length("most_m");
    s.aspect = keys.number_or("aspect", s.aspect, 0.1, 10);
    s.aspect_spread = keys.number_or("aspect_spread", s.aspect_spread, 0, 1);
    if (keys.has("along"))
        s.along = keys.vector("along", -1e6, 1e6);
    s.jitter = keys.number_or("jitter", s.jitter, 0, 10);
    s.inside = keys.word("begin", "surface", "surface", "inside") == "inside";
    if (s.inside && (keys.has("offset") || keys.has("offset_spread")))
        refuse(where, "'offset' is from the surface, and they begin inside; drop one of them");
    s.offset = keys.number_or("offset", s.offset, -2, 2);
    s.offset_spread = keys.number_or("offset_spread", s.offset_spread, 0, 2);
    s.rim = keys.number_or("rim", s.rim, 0, 2);
    if (keys.has("chain"))
        s.chain = static_cast<int>(keys.whole("chain", 100));
    if (keys.has("height"))
        std::tie(s.bottom, s.top) = keys.pair("height", 0, 1);
    if (keys.has("clusters")) {
        const Keys c(keys.value("clusters"), where + ".clusters", {"count", "spread_m"});
        s.clusters = BiteSettings::Clusters{c.whole("count", 1e5), c.length("spread_m")};
    }
    s.seed = seed_of(keys, parser);
    check_bite_settings(s);
    return std::make_unique<LevelSetOperationNode>(
        only_child(keys, parser),
        [s, where](const openvdb::FloatGrid& solid, const Box& box, const Similarity& at,
                   const RecipeScene& scene) {
            const auto bites = place_bites(solid, box, s, at, scene.progress);
            scene.found.push_back(where + ": " + std::to_string(bites.size()) + " bites");
            return bitten(solid, bites, scene.progress);
        },
        0, "biting", where);
}

} // namespace taihu
