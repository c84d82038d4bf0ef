#include "tests/support/surface_errors.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "mesh_out/surface_distance.h"
#include "stats/core/rng.h"

namespace taihu {
namespace {

constexpr double kOn = 2e-4; ///< of a spacing: on the surface

/// The surface point reached from `p` by projecting on the deciding primitive, then on those that
/// turn out to decide there; `set` is what it lies on.
std::optional<Vec3> reach(const FieldProbe& field, const Vec3& p, double spacing,
                          PrimitiveSet& set) {
    set = PrimitiveSet(field.at(p).primitive);
    for (int i = 0; i < 3; ++i) {
        const auto y = onto(field, set, p, 6 * spacing);
        if (!y)
            return std::nullopt;
        const auto n = field.at(*y);
        if (std::abs(n.value_m) < kOn * spacing)
            return y;
        if (n.value_m < 0 || !set.add(n.primitive))
            return std::nullopt;
    }
    return std::nullopt;
}

} // namespace

double ErrorSample::most() const {
    return values.empty() ? 0 : *std::max_element(values.begin(), values.end());
}
double ErrorSample::rms() const {
    double sum = 0;
    for (const float v : values)
        sum += double(v) * v;
    return values.empty() ? 0 : std::sqrt(sum / static_cast<double>(values.size()));
}
double ErrorSample::quantile(double q) const {
    if (values.empty())
        return 0;
    std::vector<float> v = values;
    const auto k = static_cast<std::ptrdiff_t>(q * static_cast<double>(v.size() - 1));
    std::nth_element(v.begin(), v.begin() + k, v.end());
    return v[static_cast<std::size_t>(k)];
}
double ErrorSample::share_above(double value) const {
    const auto n = std::count_if(values.begin(), values.end(), [&](float v) { return v > value; });
    return values.empty() ? 0 : static_cast<double>(n) / static_cast<double>(values.size());
}

SurfacePoints surface_points(const FieldProbe& field, const TriMesh& dense, double spacing,
                             std::size_t n) {
    struct Found {
        std::vector<std::pair<Vec3, int>> points; ///< and how many primitives meet; 0: thin
    };
    std::vector<Found> found(n);
    const Rng rng{99, 3};
    tbb::parallel_for(std::size_t{0}, n, [&](std::size_t i) {
        const auto u = [&](std::uint32_t draw) { return rng.uniform(i, draw); };
        const Triangle t = dense.triangles[static_cast<std::size_t>(
            u(0) * static_cast<double>(dense.triangles.size()))];
        Vec3 p = dense.positions[t[0]];
        for (int a = 0; a < 3; ++a)
            p[a] += spacing * 3 * (u(1 + static_cast<std::uint32_t>(a)) - .5);
        PrimitiveSet set;
        const auto y = reach(field, p, spacing, set);
        if (!y)
            return;
        const auto sort = [&](const Vec3& z, const PrimitiveSet& s) {
            Vec3 g;
            for (const Primitive q : s.all())
                g += normalized(field.of(q, z).gradient);
            const double l = length(g), in = s.size() == 1 ? 1 : 1.5;
            const bool thick = l > 0.3 &&
                               field.at(z - g * (in * spacing / l)).value_m <= -.5 * spacing &&
                               field.at(z + g * (spacing / l)).value_m >= .5 * spacing;
            found[i].points.push_back({z, thick ? static_cast<int>(s.size()) : 0});
        };
        sort(*y, set);
        if (set.size() > 1)
            return;
        std::vector<Primitive> near;
        field.near(*y, 2 * spacing, near);
        double most = -2 * spacing;
        Primitive other = set[0];
        for (const Primitive q : near)
            if (const double d = field.of(q, *y).value_m; q != set[0] && d > most)
                most = d, other = q;
        if (!set.add(other) || set.size() < 2)
            return;
        if (const auto z = onto(field, set, *y, 3 * spacing);
            z && std::abs(field.at(*z).value_m) < 2 * kOn * spacing)
            sort(*z, set);
    });
    SurfacePoints points;
    for (const Found& f : found)
        for (const auto& [p, n_sets] : f.points)
            (n_sets == 0   ? points.thin
             : n_sets == 1 ? points.face
             : n_sets == 2 ? points.rim
                           : points.corner)
                .push_back(p);
    return points;
}

SurfaceErrors surface_errors(const FieldProbe& field, const SurfacePoints& points,
                             const TriMesh& mesh, double step, double bound) {
    struct Chunk {
        std::vector<float> errors, turns;
        std::vector<Vec3> places;
    };
    constexpr std::size_t kChunk = 512;
    std::vector<Chunk> chunks((mesh.triangles.size() + kChunk - 1) / kChunk);
    tbb::parallel_for(std::size_t{0}, chunks.size(), [&](std::size_t i) {
        Chunk& out = chunks[i];
        for (std::size_t f = i * kChunk; f < std::min((i + 1) * kChunk, mesh.triangles.size());
             ++f) {
            const Triangle t = mesh.triangles[f];
            const Vec3 &a = mesh.positions[t[0]], &b = mesh.positions[t[1]],
                       &c = mesh.positions[t[2]];
            const double edge = std::max({length(b - a), length(c - b), length(a - c)});
            const int n = std::clamp(static_cast<int>(std::ceil(edge / step)), 3, 40);
            for (int u = 0; u <= n; ++u)
                for (int v = 0; u + v <= n; ++v) {
                    const double x = double(u) / n, y = double(v) / n;
                    const Vec3 p = a * (1 - x - y) + b * x + c * y;
                    double d = std::abs(field.at(p).value_m);
                    PrimitiveSet set;
                    if (d > 1e-3 * step)
                        if (const auto q = reach(field, p, step, set))
                            d = std::max(d, length(*q - p));
                    out.errors.push_back(static_cast<float>(d));
                    if (d > bound)
                        out.places.push_back(p);
                }
            const Vec3 m = (a + b + c) / 3, n0 = normalized(cross(b - a, c - a));
            const auto at = field.at(m);
            const Vec3 g = normalized(field.of(at.primitive, m).gradient);
            out.turns.push_back(static_cast<float>(std::acos(std::clamp(dot(n0, g), -1., 1.)) *
                                                   180 / std::numbers::pi));
        }
    });
    SurfaceErrors errors;
    for (const Chunk& c : chunks) {
        errors.mesh.values.insert(errors.mesh.values.end(), c.errors.begin(), c.errors.end());
        errors.turn_deg.values.insert(errors.turn_deg.values.end(), c.turns.begin(), c.turns.end());
        errors.places.insert(errors.places.end(), c.places.begin(), c.places.end());
    }
    const SurfaceDistance distance(mesh);
    const auto measure = [&](const std::vector<Vec3>& from, ErrorSample& to) {
        to.values.resize(from.size());
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, from.size(), 1024),
                          [&](const auto& r) {
                              for (std::size_t i = r.begin(); i < r.end(); ++i)
                                  to.values[i] = static_cast<float>(distance(from[i]));
                          });
    };
    measure(points.face, errors.face);
    measure(points.rim, errors.rim);
    measure(points.corner, errors.corner);
    measure(points.thin, errors.thin);
    return errors;
}

} // namespace taihu
