#include "tests/support/random_recipe.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "vdb_ops/combine_field.h"
#include "vdb_ops/place.h"
#include "vdb_ops/similarity.h"
#include "vdb_ops/solids.h"

namespace taihu {
namespace {

using Json = nlohmann::ordered_json;
using Distance = std::function<double(const Vec3&)>;

struct Made {
    Json node;
    Distance distance;
};

class Maker {
public:
    Maker(std::uint64_t seed, double voxel_m) : rng_{seed, 0x72656369}, voxel_m_(voxel_m) {
        awkward_ = seed % 5 == 0;
    }

    RandomRecipe make() {
        Made solid = tree(4);
        // Cut to a box, so that all of it is bounded and near the origin.
        Made box = named("box", {{"size_m", {2.0, 2.0, 2.0}}}, primitive(BoxSolid{{1, 1, 1}, 0}));
        Made all = intersection({std::move(solid), std::move(box)}, 0);
        Json recipe = {{"taihu_recipe", 1}, {"voxel_m", voxel_m_}, {"solid", all.node}};
        return {recipe.dump(), all.distance, kinds_, awkward_};
    }

private:
    double uniform(double lo, double hi) { return lo + (hi - lo) * rng_.uniform(0, n_draws_++); }
    int pick(int n) { return std::min(n - 1, static_cast<int>(uniform(0, n))); }
    /// A length; in awkward recipes whole voxels, halves of them, or less than one.
    double size(double lo, double hi) {
        const double v = uniform(lo, hi);
        if (!awkward_)
            return v;
        switch (pick(4)) {
        case 0:
            return uniform(0.1, 0.9) * voxel_m_;
        case 1:
            return std::max(1.0, std::round(v / voxel_m_)) * voxel_m_;
        default:
            return std::max(1.0, std::round(4 * v)) / 4;
        }
    }
    /// A place; in awkward recipes on a coarse lattice, where surfaces touch and coincide.
    Vec3 place() {
        Vec3 p{uniform(-0.6, 0.6), uniform(-0.6, 0.6), uniform(-0.6, 0.6)};
        if (awkward_)
            p = {std::round(4 * p.x) / 4, std::round(4 * p.y) / 4, std::round(4 * p.z) / 4};
        return p;
    }
    static Json vector(const Vec3& v) { return {v.x, v.y, v.z}; }
    static Distance primitive(const PrimitiveSolid& shape) {
        return [solid = AnalyticSolid{shape, {}}](const Vec3& p) { return distance_m(solid, p); };
    }
    Made named(const char* kind, Json body, Distance distance) {
        kinds_.insert(kind);
        Json node;
        node[kind] = std::move(body);
        return {std::move(node), std::move(distance)};
    }

    Made shape() {
        const double a = size(0.3, 1.2), b = size(0.3, 1.2), c = size(0.3, 1.2);
        const Json size_m = {a, b, c}, round = {a, b, a};
        switch (pick(7)) {
        case 0:
            return named("sphere", {{"size_m", {a, a, a}}}, primitive(BallSolid{a / 2}));
        case 1:
            return named("ellipsoid", {{"size_m", size_m}},
                         primitive(EllipsoidSolid{{a / 2, b / 2, c / 2}}));
        case 2:
            return named("box", {{"size_m", size_m}},
                         primitive(BoxSolid{{a / 2, b / 2, c / 2}, 0}));
        case 3: {
            const double edge = 0.3 * std::min({a, b, c});
            return named("rounded_box", {{"size_m", size_m}, {"round_m", edge}},
                         primitive(BoxSolid{{a / 2, b / 2, c / 2}, edge}));
        }
        case 4:
            return named("cylinder", {{"size_m", round}},
                         primitive(CylinderSolid{a / 2, b / 2, 0}));
        case 5:
            return named("capsule", {{"size_m", {a, a + b, a}}},
                         primitive(CapsuleSolid{a / 2, b / 2}));
        default: {
            const double tube = 0.3 * a;
            return named("torus", {{"size_m", {a, tube, a}}, {"tube_m", tube}},
                         primitive(TorusSolid{(a - tube) / 2, tube / 2}));
        }
        }
    }
    Made transformed(Made of) {
        const Vec3 axis{uniform(-1, 1), uniform(-1, 1), 1}, move = place();
        const double scale = awkward_ ? 1 : uniform(0.6, 1.5);
        const double angle = awkward_ ? 90.0 * pick(4) : uniform(-180, 180);
        const Vec3 about = awkward_ ? Vec3{0, 1, 0} : axis;
        const Similarity by = Similarity::translation(move) *
                              (Similarity::rotation(about, angle * std::numbers::pi / 180) *
                               Similarity::scaling(scale));
        Json body = {{"of", of.node},
                     {"scale", scale},
                     {"axis", vector(about)},
                     {"angle_deg", angle},
                     {"move_m", vector(move)}};
        return named("transform", std::move(body),
                     [back = by.inverse(), s = by.scale(),
                      d = std::move(of.distance)](const Vec3& p) { return s * d(back.point(p)); });
    }

    static Json nodes(const std::vector<Made>& of) {
        Json list = Json::array();
        for (const Made& m : of)
            list.push_back(m.node);
        return list;
    }
    static std::vector<Distance> distances(const std::vector<Made>& of) {
        std::vector<Distance> list;
        for (const Made& m : of)
            list.push_back(m.distance);
        return list;
    }
    /// The least of the distances times their signs, blended, times `sign`.
    static Distance least(std::vector<Distance> of, std::vector<double> signs, double sign,
                          double blend_m) {
        return [of = std::move(of), signs = std::move(signs), sign, blend_m](const Vec3& p) {
            std::vector<double> values;
            for (std::size_t i = 0; i < of.size(); ++i)
                values.push_back(signs[i] * of[i](p));
            return sign * (blend_m > 0 ? smooth_min(values, blend_m)
                                       : *std::min_element(values.begin(), values.end()));
        };
    }
    Json combined_body(const std::vector<Made>& of, double blend_m) {
        Json body = {{"of", nodes(of)}};
        if (blend_m > 0) {
            body["blend_m"] = blend_m;
            kinds_.insert("blend");
        }
        return body;
    }
    Made unite(const std::vector<Made>& of, double blend_m) {
        return named("union", combined_body(of, blend_m),
                     least(distances(of), std::vector<double>(of.size(), 1), 1, blend_m));
    }
    Made intersection(const std::vector<Made>& of, double blend_m) {
        return named("intersection", combined_body(of, blend_m),
                     least(distances(of), std::vector<double>(of.size(), -1), -1, blend_m));
    }
    Made difference(const std::vector<Made>& of, double blend_m) {
        std::vector<double> signs(of.size(), 1);
        signs[0] = -1;
        return named("difference", combined_body(of, blend_m),
                     least(distances(of), signs, -1, blend_m));
    }
    Made holes() {
        const std::uint64_t seed = static_cast<std::uint64_t>(pick(1000));
        const double mean = uniform(0.1, 0.3);
        Placement placement;
        placement.count = static_cast<std::uint64_t>(1 + pick(12));
        placement.seed = seed;
        Box box;
        box.include({-1, -1, -1});
        box.include({1, 1, 1});
        const auto spheres = place_holes(Law::exponential(1 / mean), placement, box).holes;
        Json body = {{"law", {{"family", "exponential"}, {"parameters", {{"rate", 1 / mean}}}}},
                     {"count", *placement.count},
                     {"scale_m", 1},
                     {"seed", seed},
                     {"box_m", {{-1, -1, -1}, {1, 1, 1}}}};
        return named("holes", std::move(body), [spheres](const Vec3& p) {
            double d = 1e9;
            for (const Sphere& s : spheres)
                d = std::min(d, length(p - s.center) - s.radius_m);
            return d;
        });
    }
    Made embedded(Made host, Made stone) {
        const double gap = size(0.02, 0.1);
        Json body = {{"of", {host.node, stone.node}}, {"gap_m", gap}};
        return named(
            "embed", std::move(body),
            [h = std::move(host.distance), s = std::move(stone.distance), gap](const Vec3& p) {
                const double d = s(p);
                return std::min(d, std::max(h(p), -(d - gap)));
            });
    }
    Made plane_cut(Made of) {
        const Vec3 normal = awkward_ ? Vec3{0, 1, 0} : Vec3{uniform(-1, 1), 1, uniform(-1, 1)};
        const Vec3 point = 0.3 * place(), n = normal / length(normal);
        Made plane = named("plane", {{"normal", vector(normal)}, {"point_m", vector(point)}},
                           [n, point](const Vec3& p) { return dot(p - point, n); });
        return intersection({std::move(of), std::move(plane)}, 0);
    }

    Made tree(int depth) {
        if (depth == 0)
            return transformed(shape());
        const double blend = pick(3) == 0 ? uniform(0.05, 0.2) : 0;
        switch (pick(9)) {
        case 0:
            return unite({tree(depth - 1), tree(depth - 2 > 0 ? depth - 2 : 0), tree(0)}, blend);
        case 1:
            return intersection({tree(depth - 1), tree(0)}, blend);
        case 2:
            return difference({tree(depth - 1), tree(0), tree(0)}, blend);
        case 3:
            return difference({tree(depth - 1), holes()}, 0);
        case 4:
            return transformed(tree(depth - 1));
        case 5: {
            Made of = tree(depth - 1);
            const double by = (pick(2) == 0 ? 1 : -1) * uniform(0.01, 0.06);
            Json body = {{"of", of.node}, {"by_m", by}};
            return named("offset", std::move(body),
                         [d = std::move(of.distance), by](const Vec3& p) { return d(p) - by; });
        }
        case 6: {
            Made of = tree(depth - 1);
            const double in = size(0.03, 0.12), out = uniform(0, 0.05);
            Json body = {{"of", of.node}, {"inwards_m", in}, {"outwards_m", out}};
            return named("shell", std::move(body),
                         [d = std::move(of.distance), in, out](const Vec3& p) {
                             const double v = d(p);
                             return std::max(v - out, -in - v);
                         });
        }
        case 7:
            return embedded(tree(depth - 1), tree(0));
        default:
            return plane_cut(tree(depth - 1));
        }
    }

    Rng rng_;
    std::uint32_t n_draws_ = 0;
    double voxel_m_;
    bool awkward_ = false;
    std::set<std::string> kinds_;
};

} // namespace

RandomRecipe random_recipe(std::uint64_t seed, double voxel_m) {
    return Maker(seed, voxel_m).make();
}

} // namespace taihu
