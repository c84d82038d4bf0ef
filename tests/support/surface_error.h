#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "mesh_out/surface_distance.h"
#include "stats/core/rng.h"
#include "stats/core/tri_mesh.h"
#include "vdb_ops/field_probe.h"

namespace taihu {

/// Errors of one kind, in the order of their making.
struct Errors {
    std::vector<float> all;

    double at_share(double share) const {
        if (all.empty())
            return 0;
        std::vector<float> sorted = all;
        const auto k = static_cast<std::ptrdiff_t>(share * static_cast<double>(all.size() - 1));
        std::nth_element(sorted.begin(), sorted.begin() + k, sorted.end());
        return static_cast<double>(sorted[static_cast<std::size_t>(k)]);
    }
    double max() const { return at_share(1); }
    double rms() const {
        double sum = 0;
        for (const float e : all)
            sum += static_cast<double>(e) * static_cast<double>(e);
        return std::sqrt(sum / std::max<double>(1, static_cast<double>(all.size())));
    }
};

/// The nearest point of the solid's surface: on the primitives that turn out to be active there.
struct OnSurface {
    Vec3 point;
    PrimitiveSet active;
};
inline std::optional<OnSurface> closest_on(const FieldProbe& field, const Vec3& p, double reach) {
    constexpr double kNear = 2e-3;
    OnSurface on{p, PrimitiveSet(field.at(p).primitive)};
    for (int i = 0; i < 3; ++i) {
        const auto q = onto(field, on.active, p, reach);
        if (!q)
            return std::nullopt;
        on.point = *q;
        const auto there = field.at(*q);
        if (there.value_m < kNear)
            return there.value_m > -kNear ? std::optional(on) : std::nullopt;
        if (!on.active.add(there.primitive))
            return std::nullopt;
    }
    return std::nullopt;
}

/// Points of the exact surface: on faces and on rims; apart those where the solid or the air is
/// about as thin as a voxel.
struct ReferencePoints {
    std::vector<Vec3> faces, rims, thin;
};
inline ReferencePoints reference_points(const FieldProbe& field, const std::vector<Vec3>& seeds) {
    ReferencePoints points;
    const auto sort = [&](const OnSurface& on) {
        Vec3 out;
        for (const Primitive k : on.active.all())
            out += field.of(k, on.point).gradient;
        const double l = length(out), deep = on.active.size() == 1 ? 1 : 1.5;
        out = normalized(out);
        const bool thick = l > 0.3 && field.at(on.point - out * deep).value_m <= -0.5 &&
                           field.at(on.point + out).value_m >= 0.5;
        auto& to = !thick ? points.thin : on.active.size() == 1 ? points.faces : points.rims;
        if (thick && on.active.size() == 3)
            return;
        to.push_back(on.point);
    };
    std::vector<Primitive> near;
    for (std::size_t i = 0; i < seeds.size(); ++i) {
        const auto u = [i](std::uint32_t d) { return Rng{99, 1}.uniform(i, d) - 0.5; };
        const Vec3 p = seeds[i] + Vec3{u(0), u(1), u(2)} * 2;
        const auto on = closest_on(field, p, 3);
        if (!on)
            continue;
        sort(*on);
        if (on->active.size() != 1)
            continue;
        near.clear();
        field.near(on->point, 2, near);
        for (const Primitive other : near) {
            OnSurface rim = *on;
            if (other == on->active[0] || !rim.active.add(other))
                continue;
            const auto q = onto(field, rim.active, on->point, 3);
            if (q && std::fabs(field.at(*q).value_m) < 2e-3) {
                rim.point = *q;
                sort(rim);
                break;
            }
        }
    }
    return points;
}

/// From samples of all triangles to the surface; angles between triangles and the field [degrees].
struct MeshErrors {
    Errors distance, angle_deg;
    std::size_t n_lost = 0; ///< samples whose nearest point was not found: |field| instead
};
inline MeshErrors mesh_errors(const FieldProbe& field, const TriMesh& mesh) {
    const std::size_t n = mesh.triangles.size();
    std::vector<std::vector<float>> distances(n);
    MeshErrors errors;
    errors.angle_deg.all.resize(n);
    std::vector<char> lost(n);
    tbb::parallel_for(std::size_t{0}, n, [&](std::size_t t) {
        const Vec3 a = mesh.positions[mesh.triangles[t][0]],
                   b = mesh.positions[mesh.triangles[t][1]],
                   c = mesh.positions[mesh.triangles[t][2]];
        const double longest = std::max({length(b - a), length(c - b), length(a - c)});
        const int k = std::clamp(static_cast<int>(std::ceil(longest / 0.7)), 3, 24);
        for (int i = 0; i <= k; ++i)
            for (int j = 0; i + j <= k; ++j) {
                const Vec3 p = a + (b - a) * (double(i) / k) + (c - a) * (double(j) / k);
                double d = field.at(p).value_m;
                if (d > 1e-3) {
                    if (const auto on = closest_on(field, p, 4))
                        d = length(on->point - p);
                    else
                        lost[t] = 1;
                }
                distances[t].push_back(static_cast<float>(std::fabs(d)));
            }
        const Vec3 m = (a + b + c) / 3, normal = normalized(cross(b - a, c - a));
        const auto g = field.of(field.at(m).primitive, m).gradient;
        errors.angle_deg.all[t] = static_cast<float>(
            std::acos(std::clamp(dot(normal, normalized(g)), -1.0, 1.0)) * 180 / std::numbers::pi);
    });
    for (std::size_t t = 0; t < n; ++t) {
        errors.n_lost += static_cast<std::size_t>(lost[t]);
        errors.distance.all.insert(errors.distance.all.end(), distances[t].begin(),
                                   distances[t].end());
    }
    return errors;
}

} // namespace taihu
