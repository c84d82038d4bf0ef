#include "vdb_ops/fractal_rock.h"

#include <array>
#include <bit>
#include <cmath>
#include <string>
#include <tuple>

#include "stats/core/error.h"
#include "stats/core/portable_math.h"
#include "stats/core/rng.h"
#include "stats/core/text.h"
#include "stats/number_detail.h"
#include "vdb_ops/icosphere.h"
#include "vdb_ops/similarity.h"

namespace taihu {
namespace {

constexpr std::uint32_t kTableStream = 0x66726163, kTurnStream = 0x7475726e; // "frac", "turn"
constexpr std::size_t kTableSize = 4096;
constexpr std::size_t kMostTriangles = std::size_t{1} << 24;
constexpr std::array<std::string_view, 3> kDampings = {"none", "interpolating", "approximating"};
constexpr std::array<std::string_view, 2> kAlong = {"radius", "normal"};

template <class Name, std::size_t n>
Name from_name(const char* what, std::string_view name,
               const std::array<std::string_view, n>& known) {
    std::string list;
    for (std::size_t i = 0; i < n; ++i) {
        if (known[i] == name)
            return static_cast<Name>(i);
        list += (i == 0 ? "" : ", ") + std::string(known[i]);
    }
    throw Error(Fault::bad_argument, std::string("fractal rock: ") + what + " is '" +
                                         printable(name) + "'; must be one of " + list);
}

void check_range(const char* name, double value, double lo, double hi) {
    if (!(value >= lo && value <= hi))
        throw Error(Fault::bad_argument, std::string("fractal rock: ") + name + " is " +
                                             shortest(value) + ", must be " + shortest(lo) + ".." +
                                             shortest(hi) + "; choose a value in that range");
}

void refuse_if_too_many(double n_triangles) {
    if (n_triangles > static_cast<double>(kMostTriangles))
        throw Error(Fault::unsupported, "fractal rock: would have " + shortest(n_triangles) +
                                            " triangles, at most 16777216; iterate less often");
}

auto ordered(const Vec3& p) {
    return std::tie(p.x, p.y, p.z);
}

/// From whichever corner the face is told, the same bits.
Vec3 face_normal(const TriMesh& mesh, const Triangle& t) {
    std::size_t k = 0;
    for (std::size_t i = 1; i < 3; ++i)
        if (ordered(mesh.positions[t[i]]) < ordered(mesh.positions[t[k]]))
            k = i;
    const Vec3 &a = mesh.positions[t[k]], &b = mesh.positions[t[(k + 1) % 3]],
               &c = mesh.positions[t[(k + 2) % 3]];
    return normalized(cross(b - a, c - a));
}

std::uint64_t mixed(std::uint64_t h, double v) {
    h ^= std::bit_cast<std::uint64_t>(v + 0.0); // -0 is 0
    h *= 0x9e3779b97f4a7c15u;
    h ^= h >> 29;
    h *= 0xbf58476d1ce4e5b9u;
    return h ^ h >> 32;
}

/// The edges of a closed mesh.
struct Edges {
    struct Edge {
        std::uint32_t from = 0, to = 0; ///< as the left face runs through it
        std::uint32_t left = 0, right = 0;
    };
    std::vector<Edge> edges;
    std::vector<std::array<std::uint32_t, 3>> of_face; ///< from its corners 0, 1, 2
};

[[noreturn]] void refuse_edge(std::uint32_t a, std::uint32_t b) {
    throw Error(Fault::bad_input, "fractal rock: the edge between positions " + std::to_string(a) +
                                      " and " + std::to_string(b) +
                                      " has not one face on each side; give a closed mesh");
}

/// Half edges are sorted into buckets by the lower of their ends: there are few in each.
Edges find_edges(const TriMesh& mesh) {
    const std::size_t n_faces = mesh.triangles.size();
    std::vector<std::uint32_t> first(mesh.positions.size() + 1);
    const auto ends = [&](std::uint32_t half) {
        const Triangle& t = mesh.triangles[half / 3];
        return std::pair{t[half % 3], t[(half + 1) % 3]};
    };
    const auto n_halves = static_cast<std::uint32_t>(3 * n_faces);
    for (std::uint32_t h = 0; h < n_halves; ++h) {
        const auto [a, b] = ends(h);
        if (a >= mesh.positions.size() || b >= mesh.positions.size() || a == b)
            refuse_edge(a, b);
        ++first[std::min(a, b) + 1];
    }
    for (std::size_t v = 0; v < mesh.positions.size(); ++v)
        first[v + 1] += first[v];
    std::vector<std::uint32_t> halves(n_halves), filled(first.begin(), first.end() - 1);
    for (std::uint32_t h = 0; h < n_halves; ++h) {
        const auto [a, b] = ends(h);
        halves[filled[std::min(a, b)]++] = h;
    }
    Edges out;
    out.edges.reserve(n_halves / 2);
    out.of_face.resize(n_faces);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v)
        for (std::uint32_t i = first[v]; i < first[v + 1]; ++i) {
            const auto [a, b] = ends(halves[i]);
            std::uint32_t twin = n_halves;
            for (std::uint32_t j = first[v]; j < first[v + 1]; ++j) {
                const auto [c, d] = ends(halves[j]);
                if (j != i && a == c && b == d)
                    refuse_edge(a, b);
                if (a == d && b == c)
                    twin = halves[j];
            }
            if (twin == n_halves)
                refuse_edge(a, b);
            if (halves[i] > twin)
                continue; // met already, from the other side
            const auto edge = static_cast<std::uint32_t>(out.edges.size());
            out.edges.push_back({a, b, halves[i] / 3, twin / 3});
            out.of_face[halves[i] / 3][halves[i] % 3] = edge;
            out.of_face[twin / 3][twin % 3] = edge;
        }
    return out;
}

} // namespace

std::string_view damping_name(Damping damping) {
    return kDampings[static_cast<std::size_t>(damping)];
}
std::string_view along_name(DisplaceAlong along) {
    return kAlong[static_cast<std::size_t>(along)];
}
Damping damping_from_name(std::string_view name) {
    return from_name<Damping>("damping", name, kDampings);
}
DisplaceAlong along_from_name(std::string_view name) {
    return from_name<DisplaceAlong>("along", name, kAlong);
}

void check_fractal(const FractalSettings& s) {
    check_range("base", s.base, 0, 5);
    check_range("iterations", s.iterations, 0, 8);
    check_range("amplitude", s.amplitude, 0, 1);
    check_range("hurst_up", s.hurst_up, 0.05, 2);
    check_range("hurst_down", s.hurst_down, 0.05, 2);
    check_range("corners", s.corners, 0, 1);
    check_range("roundness", s.roundness, 0, 1);
    const int bits = 2 * s.base + (s.damping == Damping::none ? 2 : 4) * s.iterations;
    refuse_if_too_many(20 * std::ldexp(1.0, bits));
}

DisplacementTable::DisplacementTable(std::uint64_t seed) : values_(kTableSize) {
    const Rng rng{seed, kTableStream};
    for (std::size_t i = 0; i < kTableSize; ++i)
        values_[i] = 2 * rng.uniform(i) - 1;
}

double DisplacementTable::at(const Vec3& a, const Vec3& b) const {
    const bool swap = ordered(b) < ordered(a);
    std::uint64_t h = 0;
    for (const Vec3* p : {swap ? &b : &a, swap ? &a : &b})
        h = mixed(mixed(mixed(h, p->x), p->y), p->z);
    return values_[h % kTableSize];
}

FractalRefiner::FractalRefiner(const TriMesh& base, const FractalSettings& settings,
                               std::uint64_t seed)
    : settings_(settings), table_(seed) {
    check_fractal(settings);
    find_edges(base); // refuses what is not closed
    const Box box = bounds(base);
    middle_ = box.center();
    for (const Triangle& t : base.triangles)
        for (const std::uint32_t v : t)
            radius_m_ = std::max(radius_m_, length(base.positions[v] - middle_));
    if (!is_finite(box.lo) || !is_finite(box.hi) || !(radius_m_ > 0) || !std::isfinite(radius_m_))
        throw Error(Fault::bad_input, "fractal rock: the base mesh has no finite extent; give one "
                                      "that has");
}

double FractalRefiner::reach_m(std::size_t n_faces, double facing) const {
    const double up = settings_.hurst_up, down = settings_.hurst_down;
    const double hurst = down + (up - down) * 0.5 * (1 + facing);
    return settings_.amplitude * radius_m_ *
           portable_exp(0.5 * hurst * portable_log(20.0 / static_cast<double>(n_faces)));
}

TriMesh FractalRefiner::start(TriMesh base) const {
    for (Vec3& p : base.positions) {
        const Vec3 way = normalized(p - middle_);
        p += way * (settings_.corners * reach_m(base.triangles.size(), way.y) * table_.at(p, p));
    }
    return base;
}

MidpointMesh FractalRefiner::displace(const TriMesh& mesh) const {
    const FractalSettings& s = settings_;
    refuse_if_too_many(4.0 * static_cast<double>(mesh.triangles.size()));
    const Edges edges = find_edges(mesh);
    std::vector<Vec3> normals;
    normals.reserve(mesh.triangles.size());
    for (const Triangle& t : mesh.triangles)
        normals.push_back(face_normal(mesh, t));

    MidpointMesh out;
    out.n_corners = static_cast<std::uint32_t>(mesh.positions.size());
    out.mesh.positions.reserve(mesh.positions.size() + edges.edges.size());
    out.mesh.positions = mesh.positions;
    for (const Edges::Edge& e : edges.edges) {
        const Vec3 &a = mesh.positions[e.from], &b = mesh.positions[e.to];
        const Vec3 middle = (a + b) * 0.5, out_from_middle = middle - middle_;
        const Vec3 normal = normalized(normals[e.left] + normals[e.right]);
        const double height = length(out_from_middle);
        const Vec3 radial = height > 0 ? out_from_middle / height : normal;
        const double arc = 0.5 * (length(a - middle_) + length(b - middle_));
        const double reach = reach_m(mesh.triangles.size(), normal.y);
        const Vec3& way = s.along == DisplaceAlong::radius ? radial : normal;
        out.mesh.positions.push_back(middle + radial * (s.roundness * (arc - height)) +
                                     way * (reach * table_.at(a, b)));
    }
    out.mesh.triangles.reserve(4 * mesh.triangles.size());
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
        const auto& [a, b, c] = mesh.triangles[f];
        const std::uint32_t ab = out.n_corners + edges.of_face[f][0],
                            bc = out.n_corners + edges.of_face[f][1],
                            ca = out.n_corners + edges.of_face[f][2];
        out.mesh.triangles.insert(out.mesh.triangles.end(),
                                  {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    return out;
}

namespace {

/// The quarters of the patch: a point of an edge near its end `a`, and the one of a face near its
/// corner `a`. Both are symmetric in what lies opposite, bit for bit.
struct Patch {
    bool through; ///< the midpoints; else Bezier

    Vec3 on_edge(const Vec3& a, const Vec3& mid, const Vec3& b) const {
        return through ? (0.375 * a + 0.75 * mid) - 0.125 * b
                       : (0.5625 * a + 0.375 * mid) + 0.0625 * b;
    }
    Vec3 on_face(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& ab, const Vec3& bc,
                 const Vec3& ca) const {
        return through ? (0.5 * (ab + ca) + 0.25 * bc) - 0.125 * (b + c)
                       : (0.25 * (ab + ca) + 0.125 * bc) + (0.25 * a + 0.0625 * (b + c));
    }
};

} // namespace

TriMesh FractalRefiner::damp(const MidpointMesh& displaced) const {
    if (settings_.damping == Damping::none)
        return displaced.mesh;
    const Patch patch{settings_.damping == Damping::interpolating};
    const std::vector<Vec3>& p = displaced.mesh.positions;
    const std::uint32_t n_corners = displaced.n_corners;
    const auto n_mids = static_cast<std::uint32_t>(p.size()) - n_corners;
    const std::size_t n_faces = displaced.mesh.triangles.size() / 4;
    refuse_if_too_many(16.0 * static_cast<double>(n_faces));
    TriMesh out;
    out.positions.reserve(p.size() + 2 * n_mids + 3 * n_faces);
    out.positions = p;
    out.positions.resize(p.size() + 2 * n_mids + 3 * n_faces);
    out.triangles.reserve(16 * n_faces);
    for (std::size_t f = 0; f < n_faces; ++f) {
        const Triangle* four = &displaced.mesh.triangles[4 * f];
        std::array<std::uint32_t, 3> end, mid, inner;
        std::array<std::array<std::uint32_t, 2>, 3> sub; // of edge k, near its start and its end
        for (std::size_t k = 0; k < 3; ++k) {
            end[k] = four[k][0];
            mid[k] = four[3][k];
        }
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t a = end[k], b = end[(k + 1) % 3], c = end[(k + 2) % 3];
            const std::uint32_t ab = mid[k], bc = mid[(k + 1) % 3], ca = mid[(k + 2) % 3];
            const auto quarters = static_cast<std::uint32_t>(p.size()) + 2 * (ab - n_corners);
            sub[k] = {quarters + (a > b), quarters + (a < b)};
            if (a < b) { // the face on the other side sees a > b
                out.positions[sub[k][0]] = patch.on_edge(p[a], p[ab], p[b]);
                out.positions[sub[k][1]] = patch.on_edge(p[b], p[ab], p[a]);
                if (!patch.through)
                    out.positions[ab] = 0.5 * p[ab] + 0.25 * (p[a] + p[b]);
            }
            inner[k] = static_cast<std::uint32_t>(p.size() + 2 * n_mids + 3 * f + k);
            out.positions[inner[k]] = patch.on_face(p[a], p[b], p[c], p[ab], p[bc], p[ca]);
        }
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t next = (k + 1) % 3, last = (k + 2) % 3;
            const std::uint32_t left = sub[last][1], right = sub[k][0]; // beside corner k
            out.triangles.insert(out.triangles.end(), {{end[k], right, left},
                                                       {right, inner[k], left},
                                                       {right, mid[k], inner[k]},
                                                       {mid[last], left, inner[k]},
                                                       {mid[k], inner[next], inner[k]}});
        }
        out.triangles.push_back({inner[0], inner[1], inner[2]});
    }
    return out;
}

TriMesh FractalRefiner::iterate(TriMesh mesh, int n) const {
    for (int i = 0; i < n; ++i) {
        MidpointMesh displaced = displace(mesh);
        mesh = settings_.damping == Damping::none ? std::move(displaced.mesh) : damp(displaced);
    }
    return mesh;
}

TriMesh fractal_base(const FractalSettings& settings, std::uint64_t seed) {
    check_fractal(settings);
    // A unit quaternion: from the ball of 4 dimensions, so that no turn is likelier than another.
    const Rng rng{seed, kTurnStream};
    double w = 0, square = 0;
    Vec3 u;
    for (std::uint32_t draw = 0; !(square > 0.01 && square <= 1); draw += 4) {
        const auto at = [&](std::uint32_t i) { return 2 * rng.uniform(0, draw + i) - 1; };
        w = at(0);
        u = {at(1), at(2), at(3)};
        square = w * w + length_squared(u);
    }
    return placed(icosphere(settings.base), Similarity::rotation(Quaternion{w, u.x, u.y, u.z}));
}

TriMesh fractal_rock(const FractalSettings& settings, std::uint64_t seed) {
    TriMesh base = fractal_base(settings, seed);
    const FractalRefiner refiner(base, settings, seed);
    return refiner.iterate(refiner.start(std::move(base)), settings.iterations);
}

std::vector<Vec3> averaged_normals(const TriMesh& mesh) {
    std::vector<Vec3> normals(mesh.positions.size());
    for (const Triangle& t : mesh.triangles) {
        const Vec3 normal = face_normal(mesh, t);
        for (const std::uint32_t v : t)
            normals[v] += normal;
    }
    for (Vec3& n : normals)
        n = normalized(n);
    return normals;
}

} // namespace taihu
