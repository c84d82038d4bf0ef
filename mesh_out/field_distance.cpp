#include "mesh_out/field_distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "mesh_out/surface_distance.h"
#include "stats/core/error.h"

namespace taihu {
namespace {

constexpr double kOn = 1e-3;        ///< of the spacing: on the surface
constexpr double kStride = 1. / 16; ///< spacings, at least
constexpr double kFarthest = 8;     ///< spacings that a projection may take
constexpr std::size_t kChunk = 512; ///< faces or points that are summed together
constexpr double kClose = 0.7;      ///< of the limit: looked at more closely
constexpr int kParts = 3;           ///< of an edge then
constexpr double kVeryClose = 0.9;  ///< looked at once more, every
constexpr double kFine = 0.15;      ///< of the spacing
constexpr double kSure = 0.98;      ///< of the limit: points between samples may be farther
constexpr int kFinest = 64;         ///< parts of an edge
constexpr double kNowhere = std::numeric_limits<double>::infinity();

/// The nearest point of the surface that can be reached by projecting onto the primitive that
/// decides at `p`, then onto all that turn out to decide where that leads.
std::optional<Vec3> surface_point(const FieldProbe& field, const Vec3& p, double spacing_m) {
    const auto here = field.at(p);
    PrimitiveSet set(here.primitive);
    for (std::size_t i = 0; i < PrimitiveSet::kMost; ++i) {
        const auto q = onto(field, set, p, std::fabs(here.value_m) + kFarthest * spacing_m);
        if (!q)
            return std::nullopt;
        const auto there = field.at(*q);
        if (std::fabs(there.value_m) < kOn * spacing_m)
            return q;
        if (!set.add(there.primitive))
            return std::nullopt;
    }
    return std::nullopt;
}

/// How far the field's sign changes from `p` in any of 26 directions, or `farthest_m` where it does
/// not before: the surface is there or nearer. In the rough of a level set, where values are no
/// distances, projections leap over the nearest point.
double to_sign_change(const FieldProbe& field, const Vec3& p, double spacing_m, double farthest_m) {
    const double own_m = field.at(p).value_m;
    for (int k = 0; k < 27; ++k) {
        const Vec3 to{double(k / 9 - 1), double(k / 3 % 3 - 1), double(k % 3 - 1)};
        if (k == 13)
            continue;
        const Vec3 along = normalized(to);
        double at_m = 0, before_m = 0, value_m = own_m;
        while (at_m < farthest_m && (value_m < 0) == (own_m < 0)) {
            before_m = at_m;
            at_m += std::max(std::fabs(value_m), kStride * spacing_m);
            value_m = field.at(p + along * at_m).value_m;
        }
        if ((value_m < 0) == (own_m < 0))
            continue;
        while (at_m - before_m > kOn * spacing_m) {
            const double middle_m = (at_m + before_m) / 2;
            const bool past = (field.at(p + along * middle_m).value_m < 0) != (own_m < 0);
            (past ? at_m : before_m) = middle_m;
        }
        farthest_m = std::min(farthest_m, at_m);
    }
    return farthest_m;
}

struct Sum {
    double most = 0, apart = 0, squares = 0;
    Vec3 worst;
    std::size_t n = 0;
    std::vector<Vec3> beyond;

    void add(const Vec3& p, double d, double limit_m, std::span<const Sphere> balls) {
        ++n;
        squares += d * d;
        if (d > limit_m) {
            if (std::any_of(balls.begin(), balls.end(),
                            [&](const Sphere& b) { return length(p - b.center) <= b.radius_m; })) {
                apart = std::max(apart, d);
                return;
            }
            beyond.push_back(p);
        }
        if (d > most) {
            most = d;
            worst = p;
        }
    }
    void add(const Sum& other) {
        n += other.n;
        squares += other.squares;
        apart = std::max(apart, other.apart);
        beyond.insert(beyond.end(), other.beyond.begin(), other.beyond.end());
        if (other.most > most) {
            most = other.most;
            worst = other.worst;
        }
    }
    double rms() const { return n > 0 ? std::sqrt(squares / static_cast<double>(n)) : 0; }
};

/// one(i, sum) for i in 0..n, in chunks of one size, added up in order.
template <class One>
Sum summed(std::size_t n, Progress* progress, One&& one) {
    std::vector<Sum> chunks((n + kChunk - 1) / kChunk);
    tbb::parallel_for(std::size_t{0}, chunks.size(), [&](std::size_t c) {
        check_cancelled(progress);
        for (std::size_t i = c * kChunk; i < std::min(n, (c + 1) * kChunk); ++i)
            one(i, chunks[c]);
    });
    Sum all;
    for (const Sum& c : chunks)
        all.add(c);
    return all;
}

/// Each edge once, however many faces it has, ascending.
std::vector<std::array<std::uint32_t, 2>> edges_of(const TriMesh& mesh) {
    std::vector<std::array<std::uint32_t, 2>> edges;
    edges.reserve(3 * mesh.triangles.size());
    for (const Triangle& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const auto [a, b] = std::minmax(t[k], t[(k + 1) % 3]);
            edges.push_back({a, b});
        }
    tbb::parallel_sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    return edges;
}

int n_parts(double length_m, double spacing_m) {
    return static_cast<int>(std::clamp(std::ceil(length_m / spacing_m), 2.0, double{kFinest}));
}

/// fn(p) between the edges of a face, no two neighbours farther apart than the spacing.
template <class Fn>
void each_inside(const std::array<Vec3, 3>& face, double spacing_m, Fn&& fn) {
    const auto& [a, b, c] = face;
    const int n = n_parts(std::max({length(b - a), length(c - b), length(a - c)}), spacing_m);
    for (int u = 1; u < n; ++u)
        for (int v = 1; u + v < n; ++v) {
            const double x = double(u) / n, y = double(v) / n;
            fn(a * (1 - x - y) + b * x + c * y);
        }
}

} // namespace

FieldDistance field_distance(const TriMesh& mesh, const FieldProbe& field, const TriMesh& surface,
                             double spacing_m, double limit_m, std::span<const Sphere> apart,
                             Progress* progress) {
    if (mesh.triangles.empty() || surface.triangles.empty())
        throw Error(Fault::bad_argument, "field distance: a mesh is empty; give one with faces");
    if (!(spacing_m >= 1e-5 * bounds(mesh).longest()))
        throw Error(Fault::bad_argument, "field distance: spacing_m is " +
                                             std::to_string(spacing_m) +
                                             ", must be at least 1e-5 of the mesh");
    const SurfaceDistance to_surface(surface), to_mesh(mesh);
    const double trusted_m = std::min(limit_m, spacing_m);
    const auto add = [&](const Vec3& p, Sum& sum) {
        const auto on = surface_point(field, p, spacing_m);
        double d = on ? length(p - *on) : kNowhere;
        if (d > trusted_m) { // went astray, as it does less from beside the surface
            const Vec3 beside = to_surface.nearest(p);
            const Vec3 near = surface_point(field, beside, spacing_m).value_or(beside);
            d = to_sign_change(field, p, spacing_m, std::min(d, length(p - near)));
        }
        sum.add(p, d, limit_m, apart);
    };
    const std::vector<Vec3>& points = mesh.positions;
    const auto edges = edges_of(mesh);
    std::vector<std::uint8_t> is_used(points.size());
    for (const auto& [a, b] : edges)
        is_used[a] = is_used[b] = 1;
    Sum there = summed(points.size(), progress, [&](std::size_t v, Sum& sum) {
        if (is_used[v])
            add(points[v], sum);
    });
    there.add(summed(edges.size(), progress, [&](std::size_t i, Sum& sum) {
        const Vec3 a = points[edges[i][0]], along = points[edges[i][1]] - a;
        const int n = n_parts(length(along), spacing_m);
        for (int k = 1; k < n; ++k)
            add(a + along * (double(k) / n), sum);
    }));
    there.add(summed(mesh.triangles.size(), progress, [&](std::size_t f, Sum& sum) {
        const Triangle& t = mesh.triangles[f];
        each_inside({points[t[0]], points[t[1]], points[t[2]]}, spacing_m,
                    [&](const Vec3& p) { add(p, sum); });
    }));
    std::vector<std::uint8_t> is_close(surface.positions.size()); // to the limit
    Sum back = summed(surface.positions.size(), progress, [&](std::size_t i, Sum& sum) {
        const double d = to_mesh(surface.positions[i]);
        is_close[i] = d > kClose * limit_m;
        sum.add(surface.positions[i], d, kSure * limit_m, apart);
    });
    back.add(summed(surface.triangles.size(), progress, [&](std::size_t f, Sum& sum) {
        const Triangle& t = surface.triangles[f];
        if (!is_close[t[0]] && !is_close[t[1]] && !is_close[t[2]])
            return;
        const Vec3 a = surface.positions[t[0]], b = surface.positions[t[1]],
                   c = surface.positions[t[2]];
        const double long_m = std::max({length(b - a), length(c - b), length(a - c)});
        const auto look = [&](int n) {
            double most_m = 0;
            for (int u = 0; u <= n; ++u)
                for (int v = 0; u + v <= n; ++v) {
                    if (u == n || v == n || u + v == 0)
                        continue; // a corner
                    const Vec3 p = a + (b - a) * (double(u) / n) + (c - a) * (double(v) / n);
                    if (!(to_mesh(p) > kClose * limit_m))
                        continue;
                    if (const auto y = surface_point(field, p, spacing_m)) {
                        const double d = to_mesh(*y);
                        sum.add(*y, d, kSure * limit_m, apart);
                        most_m = std::max(most_m, d);
                    }
                }
            return most_m;
        };
        const double most_m = look(kParts);
        if (most_m > kVeryClose * limit_m && most_m <= kSure * limit_m)
            look(std::max(3 * kParts, n_parts(long_m, kFine * spacing_m)));
    }));
    FieldDistance result;
    result.max_to_field_m = there.most;
    result.max_from_field_m = back.most;
    result.max_m = std::max(there.most, back.most);
    result.worst = there.most >= back.most ? there.worst : back.worst;
    result.rms_m = std::max(there.rms(), back.rms());
    result.max_apart_m = std::max(there.apart, back.apart);
    result.n_samples = there.n + back.n;
    result.beyond = there.beyond;
    result.beyond.insert(result.beyond.end(), back.beyond.begin(), back.beyond.end());
    return result;
}

} // namespace taihu
