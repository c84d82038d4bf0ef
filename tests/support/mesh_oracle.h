#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "stats/core/tri_mesh.h"

namespace taihu {

// Brute force in double, face by face; shares nothing with what it judges.

/// Distance to a triangle, region by region.
inline double triangle_distance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
    const auto segment = [&p](const Vec3& s, const Vec3& e) {
        const Vec3 d = e - s;
        const double l2 = length_squared(d);
        const double t = l2 > 0 ? std::clamp(dot(p - s, d) / l2, 0.0, 1.0) : 0;
        return length(p - s - d * t);
    };
    double best = std::min({segment(a, b), segment(b, c), segment(c, a)});
    const Vec3 n = cross(b - a, c - a);
    const bool over = length_squared(n) > 0 && dot(cross(b - a, p - a), n) >= 0 &&
                      dot(cross(c - b, p - b), n) >= 0 && dot(cross(a - c, p - c), n) >= 0;
    if (over)
        best = std::min(best, std::fabs(dot(p - a, n)) / length(n));
    return best;
}

inline double mesh_distance(const std::vector<Vec3>& points, std::span<const Triangle> faces,
                            const Vec3& p) {
    double d = 1e300;
    for (const Triangle& t : faces)
        d = std::min(d, triangle_distance(p, points[t[0]], points[t[1]], points[t[2]]));
    return d;
}

/// Winding number: the sum of the faces' solid angles.
inline double mesh_winding(const std::vector<Vec3>& points, std::span<const Triangle> faces,
                           const Vec3& p) {
    double sum = 0;
    for (const Triangle& t : faces) {
        const Vec3 a = points[t[0]] - p, b = points[t[1]] - p, c = points[t[2]] - p;
        const double la = length(a), lb = length(b), lc = length(c);
        sum += 2 * std::atan2(dot(a, cross(b, c)),
                              la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
    }
    return sum / (4 * std::numbers::pi);
}

/// Signed distance of a closed mesh, negative where the winding number is not 0.
inline double mesh_signed_distance(const TriMesh& mesh, const Vec3& p) {
    const double d = mesh_distance(mesh.positions, mesh.triangles, p);
    return std::fabs(mesh_winding(mesh.positions, mesh.triangles, p)) > 0.5 ? -d : d;
}

} // namespace taihu
