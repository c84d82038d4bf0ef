#include "vdb_ops/cave.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include <nlohmann/json.hpp>

#include "stats/core/error.h"
#include "stats/core/rng.h"
#include "stats/number_detail.h"
#include "vdb_ops/dense_detail.h"
#include "vdb_ops/recipe.h"
#include "vdb_ops/topology_detail.h"

namespace taihu {
namespace {

constexpr std::uint32_t kStream = 0x63617665;              // "cave"
constexpr int kTries = 64, kChoice = 4, kMostSmaller = 15; // to 3.5 % of the width

void check_range(const char* name, double value, double lo, double hi) {
    if (!(value >= lo && value <= hi))
        throw Error(Fault::bad_argument, std::string("cave: ") + name + " is " + shortest(value) +
                                             ", must be " + shortest(lo) + ".." + shortest(hi) +
                                             "; choose a value in that range");
}

void check(const CaveSettings& s) {
    check_range("size_m.x", s.size_m.x, 1e-9, 1e6);
    check_range("size_m.y", s.size_m.y, 1e-9, 1e6);
    check_range("size_m.z", s.size_m.z, 1e-9, 1e6);
    check_range("n_rocks", s.n_rocks, 1, 200);
    check_range("room", s.room, 0.05, 0.9);
    check_range("wall", s.wall, 0, 0.4);
    check_fractal(s.fractal);
}

/// By the solid angles of the faces (van Oosterom and Strackee 1983, from memory, unchecked).
bool is_inside(const TriMesh& mesh, const Vec3& p) {
    double sum = 0;
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.positions[t[0]] - p, b = mesh.positions[t[1]] - p,
                   c = mesh.positions[t[2]] - p;
        const double la = length(a), lb = length(b), lc = length(c);
        sum += std::atan2(dot(a, cross(b, c)),
                          la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
    }
    return sum > std::numbers::pi; // 2 pi inside, 0 outside
}

/// Numbers in (0, 1), one after the other.
struct Draws {
    Rng rng;
    std::uint64_t item = 0;
    std::uint32_t draw = 0;

    double next() { return rng.uniform(item, draw++); }
    double between(double lo, double hi) { return lo + (hi - lo) * next(); }
};

struct Placed {
    CaveRock rock;
    TriMesh mesh; ///< about its own middle
};

/// Whether a rock stays behind the walls; the first one may stick out in front.
bool fits(const CaveSettings& s, const CaveRock& rock, bool first) {
    const double wall = s.wall * std::min({s.size_m.x, s.size_m.y, s.size_m.z});
    for (int axis = 0; axis < 3; ++axis) {
        const double most = 0.5 * (s.size_m[axis] - rock.shape.size_m[axis]) - wall;
        const double at = rock.at_m[axis];
        if (-at > most || (at > most && !(first && axis == 2)))
            return false;
    }
    return true;
}

/// A place in the mouth.
bool place_first(const CaveSettings& s, Draws& draws, CaveRock& rock) {
    for (int i = 0; i < kTries; ++i) {
        rock.at_m = {draws.between(-0.25, 0.25) * s.size_m.x, draws.between(-0.3, 0) * s.size_m.y,
                     0.5 * s.size_m.z};
        if (fits(s, rock, true))
            return true;
    }
    return false;
}

/// A place in one of the rocks before it: of a few that do, the one farthest from all of them, so
/// that the cave leads on.
bool place_next(const CaveSettings& s, std::span<const Placed> before, Draws& draws,
                CaveRock& rock) {
    double farthest = -1;
    Vec3 best;
    for (int i = 0, n_found = 0; i < kTries && n_found < kChoice; ++i) {
        const auto any = [&](std::size_t n) {
            return static_cast<std::size_t>(draws.next() * static_cast<double>(n));
        };
        const Placed& parent = draws.next() < 0.5 ? before.back() : before[any(before.size())];
        const Vec3 inside =
            parent.mesh.positions[any(parent.mesh.positions.size())] * draws.between(0.7, 0.95);
        rock.at_m = parent.rock.at_m + inside;
        if (!fits(s, rock, false) || !is_inside(parent.mesh, inside))
            continue;
        ++n_found;
        double nearest = std::numeric_limits<double>::infinity();
        for (const Placed& other : before)
            nearest = std::min(nearest, length(rock.at_m - other.rock.at_m));
        if (nearest > farthest) {
            farthest = nearest;
            best = rock.at_m;
        }
    }
    rock.at_m = best;
    return farthest >= 0;
}

} // namespace

std::vector<CaveRock> cave_rocks(const CaveSettings& s) {
    check(s);
    const Rng rng{s.seed, kStream};
    const double shortest_m = std::min({s.size_m.x, s.size_m.y, s.size_m.z});
    std::vector<Placed> placed;
    for (std::uint64_t i = 0; placed.size() < static_cast<std::size_t>(s.n_rocks); ++i) {
        Draws draws{rng, i};
        Placed next;
        ShapeSettings& shape = next.rock.shape;
        shape.kind = ShapeKind::fractal_rock;
        shape.fractal = s.fractal;
        const auto words = rng.words(i, 1u << 31);
        shape.seed = std::uint64_t{words[0]} << 21 ^ words[1]; // JSON keeps whole numbers to 2^53
        // The first is no small one, for the others follow behind the wall that it leads through.
        const double width = s.room * shortest_m * draws.between(placed.empty() ? 1 : 0.6, 1.4);
        shape.size_m = {width, width * draws.between(0.6, 1), width * draws.between(0.8, 1.25)};
        next.mesh = shape_mesh(shape);
        if (!is_inside(next.mesh, {}))
            continue; // another rock, whose middle is in it
        for (int smaller = 0; !(placed.empty() ? place_first(s, draws, next.rock)
                                               : place_next(s, placed, draws, next.rock));
             ++smaller) {
            if (smaller == kMostSmaller)
                throw Error(Fault::bad_argument, "cave: there is no place for rock " +
                                                     std::to_string(placed.size()) +
                                                     "; ask for thinner walls or larger rocks");
            constexpr double kSmaller = 0.8;
            shape.size_m *= kSmaller;
            for (Vec3& p : next.mesh.positions)
                p *= kSmaller;
        }
        placed.push_back(std::move(next));
    }
    std::vector<CaveRock> rocks;
    for (const Placed& p : placed)
        rocks.push_back(p.rock);
    return rocks;
}

std::string cave_node(const CaveSettings& settings) {
    using Json = nlohmann::ordered_json;
    const std::vector<CaveRock> rocks = cave_rocks(settings);
    Json of = Json::array();
    of.push_back(Json::parse(shape_node({.kind = ShapeKind::box, .size_m = settings.size_m})));
    for (const CaveRock& rock : rocks)
        of.push_back({{"transform",
                       {{"of", Json::parse(shape_node(rock.shape))},
                        {"move_m", {rock.at_m.x, rock.at_m.y, rock.at_m.z}}}}});
    return clean_node(Json{{"difference", {{"of", std::move(of)}}}}.dump(), {});
}

CaveReport measure_cave(const openvdb::FloatGrid& solid, const Vec3& size_m,
                        const Progress* progress) {
    const DenseLattice lattice = dense_lattice(solid, inside_voxels(solid, "cave"), 0, 1, "cave");
    const std::vector<float> values = dense_values(solid, lattice, progress);
    const double h = lattice.voxel_m;
    std::vector<std::uint8_t> open(lattice.size());
    CaveReport report;
    std::size_t n_inside = 0, n_open = 0;
    for (int x = 0; x < lattice.n[0]; ++x)
        for (int y = 0; y < lattice.n[1]; ++y)
            for (int z = 0; z < lattice.n[2]; ++z) {
                const Vec3 p = lattice.place(x, y, z);
                bool inside = true;
                int n_sides = 0;
                for (int axis = 0; axis < 3; ++axis) {
                    const double depth = 0.5 * size_m[axis] - std::fabs(p[axis]);
                    // One layer of voxels, whether points lie on the side or half a voxel from it:
                    // between the two, where rounding decides nothing.
                    inside = inside && depth >= 0.25 * h;
                    n_sides += depth < 1.25 * h;
                }
                if (!inside)
                    continue;
                ++n_inside;
                if (values[lattice.at(x, y, z)] < 0)
                    continue;
                open[lattice.at(x, y, z)] = 1;
                ++n_open;
                report.mouth_m2 += n_sides * h * h;
            }
    report.n_voids = Pieces(lattice, open, Adjacency::faces).size();
    report.void_share =
        static_cast<double>(n_open) / static_cast<double>(std::max<std::size_t>(1, n_inside));
    return report;
}

} // namespace taihu
