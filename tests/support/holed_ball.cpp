#include "tests/support/holed_ball.h"

#include <array>
#include <cmath>
#include <numbers>

#include <openvdb/tools/SignedFloodFill.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/parallel_for.h>

#include "mesh_out/crossings_detail.h"
#include "stats/core/rng.h"

namespace taihu {
namespace {

constexpr double kBlock = 8, kMargin = 5, kHalfDiagonal = 6.93;
constexpr double kFar = 5;

/// sin(2 pi turns) by its series, to 6e-8: the library's would be most of what simplification
/// costs.
double sine(double turns) {
    constexpr double kRound = 0x1.8p52;
    const double t = turns - ((turns + kRound) - kRound);
    const double x = 2 * std::numbers::pi * std::copysign(.25 - std::abs(.25 - std::abs(t)), t);
    const double y = x * x;
    return x *
           (1 + y * (-1. / 6 +
                     y * (1. / 120 + y * (-1. / 5040 + y * (1. / 362880 + y * (-1. / 39916800))))));
}

} // namespace

HoledBall::HoledBall(double radius, std::vector<Sphere> holes, bool rough)
    : radius_(radius), half_(rough ? 1.4 * radius : radius + 4), holes_(std::move(holes)) {
    if (rough) {
        constexpr std::array kAmplitude = {.07, .06, .04, .03, .02, .015, .01, .008};
        constexpr std::array kWave = {1.5, 2., 3., 3.5, 5., 6., 8., 9.};
        const Rng rng{7, 1};
        for (std::size_t i = 0; i < kWave.size(); ++i) {
            const double c = 2 * rng.uniform(i, 0) - 1, s = std::sqrt(1 - c * c),
                         t = 2 * std::numbers::pi * rng.uniform(i, 1),
                         k = kWave[i] / radius / (2 * std::numbers::pi);
            waves_.push_back({Vec3{s * std::cos(t), s * std::sin(t), c} * k, rng.uniform(i, 2),
                              kAmplitude[i] * radius});
        }
    }
    n_ = 2 * static_cast<int>(std::ceil(half_ / kBlock));
    const auto n_blocks = static_cast<std::size_t>(n_) * n_ * n_;
    const double reach = kHalfDiagonal + kMargin;
    const auto center = [&](int i, int j, int k) {
        return Vec3{i - n_ / 2 + .5, j - n_ / 2 + .5, k - n_ / 2 + .5} * kBlock;
    };
    states_.assign(n_blocks, State::air);
    for (int i = 0, b = 0; i < n_; ++i)
        for (int j = 0; j < n_; ++j)
            for (int k = 0; k < n_; ++k, ++b) {
                const double d = base(center(i, j, k)).value_m;
                states_[static_cast<std::size_t>(b)] = d > 2 * reach    ? State::air
                                                       : d < -2 * reach ? State::solid
                                                                        : State::near_base;
            }
    const auto visit = [&](const Sphere& s, auto&& near, auto&& inside) {
        std::array<int, 3> lo{}, hi{};
        for (int a = 0; a < 3; ++a) {
            const double w = s.radius_m + reach;
            lo[a] = std::clamp(static_cast<int>(std::floor((s.center[a] - w) / kBlock)) + n_ / 2, 0,
                               n_ - 1);
            hi[a] = std::clamp(static_cast<int>(std::floor((s.center[a] + w) / kBlock)) + n_ / 2, 0,
                               n_ - 1);
        }
        for (int i = lo[0]; i <= hi[0]; ++i)
            for (int j = lo[1]; j <= hi[1]; ++j)
                for (int k = lo[2]; k <= hi[2]; ++k) {
                    const auto b = static_cast<std::size_t>((i * n_ + j) * n_ + k);
                    const double d = s.radius_m - length(center(i, j, k) - s.center);
                    if (states_[b] != State::air && d > reach)
                        inside(b);
                    else if (states_[b] != State::air && d > -reach)
                        near(b);
                }
    };
    for (const Sphere& s : holes_)
        visit(
            s, [](std::size_t) {}, [&](std::size_t b) { states_[b] = State::air; });
    first_.assign(n_blocks + 1, 0);
    for (const Sphere& s : holes_)
        visit(
            s, [&](std::size_t b) { ++first_[b + 1]; }, [](std::size_t) {});
    for (std::size_t b = 0; b < n_blocks; ++b)
        first_[b + 1] += first_[b];
    entries_.resize(first_.back());
    auto at = first_;
    for (std::uint32_t h = 0; h < holes_.size(); ++h)
        visit(
            holes_[h], [&](std::size_t b) { entries_[at[b]++] = h; }, [](std::size_t) {});
}

HoledBall HoledBall::random(double dim, std::size_t n_holes, double porosity, std::uint64_t seed) {
    const Rng rng{seed, 2};
    const double mean = std::cbrt(-std::log(1 - porosity) * dim * dim * dim /
                                  (std::numbers::pi * static_cast<double>(n_holes)));
    std::vector<Sphere> holes;
    for (std::size_t i = 0; i < n_holes; ++i) {
        const Vec3 c = Vec3{rng.uniform(i, 0) - .5, rng.uniform(i, 1) - .5, rng.uniform(i, 2) - .5};
        const double r = -0.5 * mean * std::log(rng.uniform(i, 3));
        if (r >= 1)
            holes.push_back({c * dim, r});
    }
    return HoledBall(0.44 * dim, std::move(holes), true);
}

FieldProbe::Value HoledBall::base(const Vec3& p) const {
    const double l = std::max(length(p), 1e-6);
    double rise = 0;
    Vec3 g = p / l;
    for (const Wave& w : waves_) {
        const double turns = dot(w.k, p) + w.phase;
        rise += w.amplitude * sine(turns);
        g -= w.k * (2 * std::numbers::pi * w.amplitude * sine(turns + .25));
    }
    const double slope = length(g);
    return {(l - radius_ - rise) / slope, g / slope};
}

std::size_t HoledBall::block(const Vec3& p) const {
    std::size_t b = 0;
    for (int a = 0; a < 3; ++a)
        b = b * static_cast<std::size_t>(n_) +
            static_cast<std::size_t>(
                std::clamp(static_cast<int>(std::floor(p[a] / kBlock)) + n_ / 2, 0, n_ - 1));
    return b;
}

FieldProbe::Nearest HoledBall::at(const Vec3& p) const {
    const std::size_t b = block(p);
    if (states_[b] == State::air)
        return {kFar, 0};
    Nearest most{-kFar, 0};
    if (states_[b] == State::near_base)
        most.value_m = std::max(base(p).value_m, -kFar);
    for (std::uint32_t e = first_[b]; e < first_[b + 1]; ++e)
        if (const double d = hole(entries_[e], p); d > most.value_m)
            most = {d, entries_[e] + 1};
    return most;
}

FieldProbe::Value HoledBall::of(Primitive primitive, const Vec3& p) const {
    if (primitive == 0)
        return base(p);
    const Vec3 d = holes_[primitive - 1].center - p;
    const double l = length(d);
    return {holes_[primitive - 1].radius_m - l, d / std::max(l, 1e-12)};
}

void HoledBall::near(const Vec3& p, double reach_m, std::vector<Primitive>& out) const {
    if (std::abs(base(p).value_m) <= reach_m)
        out.push_back(0);
    // Blocks know what comes within `kMargin` of them: enough blocks round p for the rest.
    const int r = static_cast<int>(std::ceil(std::max(0., reach_m - kMargin) / kBlock));
    const std::size_t first = out.size();
    for (int i = -r; i <= r; ++i)
        for (int j = -r; j <= r; ++j)
            for (int k = -r; k <= r; ++k) {
                const std::size_t b = block(p + Vec3{double(i), double(j), double(k)} * kBlock);
                for (std::uint32_t e = first_[b]; e < first_[b + 1]; ++e)
                    if (std::abs(hole(entries_[e], p)) <= reach_m)
                        out.push_back(entries_[e] + 1);
            }
    const auto begin = out.begin() + static_cast<std::ptrdiff_t>(first);
    std::sort(begin, out.end());
    out.erase(std::unique(begin, out.end()), out.end());
}

std::optional<Sphere> HoledBall::ball(Primitive primitive) const {
    if (primitive > 0)
        return holes_[primitive - 1];
    if (waves_.empty())
        return Sphere{{}, radius_};
    return std::nullopt;
}

namespace {

using Quad = std::array<std::uint32_t, 4>;

struct Extraction {
    const HoledBall& solid;
    double h;
    std::vector<openvdb::Vec3s> points; ///< of the dual mesh [voxels]
    std::vector<Quad> quads;
    std::vector<Vec3> safe, v;
    std::vector<PrimitiveSet> l;
    std::vector<Triangle> faces;

    bool crossing(const Quad& q, Vec3& p, Primitive& which) const;
    void place_vertices();
    void split(const std::vector<std::uint8_t>& redo);
    void retreat();
    Vec3 floor_of(std::size_t i) const {
        return Vec3{std::floor(points[i][0]), std::floor(points[i][1]), std::floor(points[i][2])} *
               h;
    }
    Vec3 clamped(std::size_t i, const Vec3& p, double slack) const {
        const Vec3 lo = floor_of(i), s{slack, slack, slack}, one{h, h, h};
        return min(max(p, lo - s), lo + one + s);
    }
};

/// Of the edge of the lattice that a quad is the dual of.
bool Extraction::crossing(const Quad& q, Vec3& p, Primitive& which) const {
    std::array<int, 3> lo{1 << 30, 1 << 30, 1 << 30}, hi{-(1 << 30), -(1 << 30), -(1 << 30)};
    for (const std::uint32_t i : q)
        for (int a = 0; a < 3; ++a) {
            lo[a] = std::min(lo[a], static_cast<int>(std::floor(points[i][a])));
            hi[a] = std::max(hi[a], static_cast<int>(std::floor(points[i][a])));
        }
    int axis = -1;
    for (int a = 0; a < 3; ++a)
        if (hi[a] == lo[a])
            axis = axis < 0 ? a : 3;
    if (axis < 0 || axis == 3)
        return false;
    Vec3 p0 = Vec3{double(hi[0]), double(hi[1]), double(hi[2])} * h, p1 = p0;
    p1[axis] += h;
    double f0 = solid.at(p0).value_m, f1 = solid.at(p1).value_m;
    if ((f0 < 0) == (f1 < 0))
        return false;
    double t0 = 0, t1 = 1;
    for (int i = 0; i < 30; ++i) {
        const double t =
            i % 3 == 2 ? (t0 + t1) / 2 : t0 + (t1 - t0) * std::clamp(f0 / (f0 - f1), .02, .98);
        p = p0 + (p1 - p0) * t;
        const auto n = solid.at(p);
        which = n.primitive;
        if (std::abs(n.value_m) < 1e-6)
            break;
        if ((n.value_m < 0) == (f0 < 0))
            t0 = t, f0 = n.value_m;
        else
            t1 = t, f1 = n.value_m;
    }
    return true;
}

void Extraction::place_vertices() {
    std::vector<std::vector<std::uint32_t>> around(points.size());
    std::vector<Vec3> cross(quads.size());
    std::vector<Primitive> which(quads.size(), 0xffffffffu);
    tbb::parallel_for(std::size_t{0}, quads.size(), [&](std::size_t q) {
        if (!crossing(quads[q], cross[q], which[q]))
            which[q] = 0xffffffffu;
    });
    for (std::uint32_t q = 0; q < quads.size(); ++q)
        for (const std::uint32_t i : quads[q])
            around[i].push_back(q);
    v.resize(points.size());
    l.resize(points.size());
    tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
        Vec3 mean;
        int n = 0;
        PrimitiveSet set;
        for (const std::uint32_t q : around[i])
            if (which[q] != 0xffffffffu)
                mean += cross[q], ++n, set.add(which[q]);
        mean = n ? mean / n : safe[i];
        const auto fits = [&](const PrimitiveSet& s, Vec3& p) {
            const auto x = onto(solid, s, mean, 3 * h);
            if (!x || !(length(clamped(i, *x, h) - *x) == 0))
                return false;
            p = *x;
            return true;
        };
        Vec3 p = mean;
        bool ok = false;
        for (int k = 0; k < 3 && !set.empty() && fits(set, p); ++k) {
            const auto at = solid.at(p);
            if ((ok = at.value_m < 1e-3) || !set.add(at.primitive))
                break;
        }
        for (std::size_t a = 0; !ok && set.size() == 3 && a < 3; ++a) {
            PrimitiveSet two(set[a]);
            two.add(set[(a + 1) % 3]);
            if (fits(two, p) && solid.at(p).value_m < 1e-3)
                ok = true, set = two;
        }
        if (!ok) {
            const PrimitiveSet one(solid.at(mean).primitive);
            p = clamped(i, onto(solid, one, mean, 3 * h).value_or(mean), h);
            set = PrimitiveSet(solid.at(p).primitive);
        }
        v[i] = p;
        l[i] = set;
    });
}

void Extraction::split(const std::vector<std::uint8_t>& redo) {
    faces.resize(2 * quads.size());
    tbb::parallel_for(std::size_t{0}, quads.size(), [&](std::size_t q) {
        if (!redo[q])
            return;
        const std::uint32_t a = quads[q][0], b = quads[q][3], c = quads[q][2], d = quads[q][1];
        const Vec3 A = v[a], B = v[b], C = v[c], D = v[d], n = taihu::cross(C - A, D - B);
        const auto least = [&](const Vec3& p, const Vec3& q2, const Vec3& r, const Vec3& s) {
            const Vec3 x = taihu::cross(q2 - p, r - p), y = taihu::cross(r - p, s - p);
            return std::min(dot(x, n) / std::max(length(x), 1e-12),
                            dot(y, n) / std::max(length(y), 1e-12));
        };
        const auto rank = [&](std::uint32_t i, std::uint32_t k) {
            const PrimitiveSet both = l[i].common(l[k]);
            return std::abs(solid.at((v[i] + v[k]) * .5).value_m) + 1e-3 * length(v[i] - v[k]) -
                   (both.size() > 1 ? .05 : 0) + (both.empty() ? 10 : 0);
        };
        double ac = length(C - A), bd = length(D - B);
        if (l[a].size() > 1 || l[b].size() > 1 || l[c].size() > 1 || l[d].size() > 1)
            ac = rank(a, c), bd = rank(b, d);
        const double ma = least(A, B, C, D), mb = least(B, C, D, A), ln = .1 * length(n);
        if (ma < ln && mb > ma)
            ac = 1e9;
        else if (mb < ln && ma > mb)
            bd = 1e9;
        faces[2 * q] = ac <= bd ? Triangle{a, b, c} : Triangle{a, b, d};
        faces[2 * q + 1] = ac <= bd ? Triangle{a, c, d} : Triangle{b, c, d};
    });
}

void Extraction::retreat() {
    const std::vector<Vec3> want = v;
    std::vector<std::uint8_t> redo(quads.size(), 1), picked(2 * quads.size(), 0);
    split(redo);
    for (std::size_t q = 0; q < quads.size(); ++q)
        for (const std::uint32_t i : quads[q])
            if (l[i].size() > 1 || !(length(clamped(i, v[i], 0) - v[i]) == 0))
                picked[2 * q] = picked[2 * q + 1] = 1;
    for (int it = 0; it < 12; ++it) {
        auto pairs = crossing_pairs(v, faces, picked);
        for (std::uint32_t f = 0; f < faces.size(); ++f)
            if (picked[f] && length(taihu::cross(v[faces[f][1]] - v[faces[f][0]],
                                                 v[faces[f][2]] - v[faces[f][0]])) < 1e-4 * h * h)
                pairs.push_back({f, f});
        if (pairs.empty())
            return;
        std::vector<std::uint8_t> hit(points.size(), 0);
        for (const auto& [f, g] : pairs)
            for (int k = 0; k < 3; ++k)
                hit[faces[f][k]] = hit[faces[g][k]] = 1;
        for (std::size_t i = 0; i < points.size(); ++i) {
            if (!hit[i])
                continue;
            Vec3 to = it == 0 ? clamped(i, want[i], 0) : safe[i];
            if (it == 1 || it == 2)
                if (const auto x = onto(solid, PrimitiveSet(solid.at(to).primitive), to, h))
                    to = clamped(i, *x, 0);
            v[i] = to;
            l[i] = PrimitiveSet(solid.at(to).primitive);
        }
        for (std::size_t q = 0; q < quads.size(); ++q) {
            redo[q] = std::any_of(quads[q].begin(), quads[q].end(),
                                  [&](std::uint32_t i) { return hit[i] != 0; });
            if (redo[q])
                picked[2 * q] = picked[2 * q + 1] = 1;
        }
        split(redo);
    }
}

} // namespace

openvdb::FloatGrid::Ptr level_set_of(const HoledBall& solid, double h) {
    openvdb::initialize();
    using openvdb::Coord;
    const auto grid = openvdb::FloatGrid::create(static_cast<float>(3 * h));
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    const int n = static_cast<int>(std::ceil(solid.half_extent() / h / 8)) * 8;
    std::vector<std::unique_ptr<openvdb::FloatTree::LeafNodeType>> leaves(
        static_cast<std::size_t>(n / 4) * (n / 4) * (n / 4));
    tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t i) {
        const int m = n / 4;
        const Coord o(static_cast<int>(i) / m / m * 8 - n, static_cast<int>(i) / m % m * 8 - n,
                      static_cast<int>(i) % m * 8 - n);
        auto leaf = std::make_unique<openvdb::FloatTree::LeafNodeType>(o, float(3 * h));
        bool any = false;
        for (openvdb::Index v = 0; v < 512; ++v) {
            const Coord c = leaf->offsetToGlobalCoord(v);
            const double d =
                solid.at(Vec3{double(c.x()), double(c.y()), double(c.z())} * h).value_m;
            const bool band = std::abs(d) < 3 * h;
            any |= band;
            leaf->setValueOnly(v, static_cast<float>(std::clamp(d, -3 * h, 3 * h)));
            leaf->setActiveState(v, band);
        }
        if (any)
            leaves[i] = std::move(leaf);
    });
    for (auto& leaf : leaves)
        if (leaf)
            grid->tree().addLeaf(leaf.release());
    openvdb::tools::signedFloodFill(grid->tree());
    return grid;
}

LabelledMesh sharp_surface(const HoledBall& solid, double spacing) {
    Extraction e{solid, spacing, {}, {}, {}, {}, {}, {}};
    std::vector<openvdb::Vec3I> triangles;
    std::vector<openvdb::Vec4I> quads;
    openvdb::tools::volumeToMesh(*level_set_of(solid, spacing), e.points, triangles, quads, 0.0,
                                 0.0);
    for (const auto& q : quads)
        e.quads.push_back({q[0], q[1], q[2], q[3]});
    for (const auto& p : e.points)
        e.safe.push_back(Vec3{p[0], p[1], p[2]} * spacing);
    e.place_vertices();
    e.retreat();
    return {e.v, e.faces, e.l};
}

} // namespace taihu
