#include "mesh_out/creases.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <string>
#include <tuple>
#include <vector>

#include "mesh_out/io/mesh_formats_detail.h"
#include "stats/core/error.h"

namespace taihu {
namespace {

constexpr double kHalfTurn_deg = 180;

/// The first of equal positions, for each.
std::vector<std::uint32_t> first_equal(const std::vector<Vec3>& positions) {
    std::vector<std::uint32_t> order(positions.size()), out(positions.size());
    std::iota(order.begin(), order.end(), 0u);
    const auto key = [&](std::uint32_t i) {
        return std::tuple(positions[i].x, positions[i].y, positions[i].z);
    };
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return std::tuple_cat(key(a), std::tuple(a)) < std::tuple_cat(key(b), std::tuple(b));
    });
    for (std::size_t i = 0; i < order.size(); ++i)
        out[order[i]] = i > 0 && key(order[i]) == key(order[i - 1]) ? out[order[i - 1]] : order[i];
    return out;
}

/// Corners that share a normal: corner k of triangle f is 3 f + k.
class Groups {
public:
    explicit Groups(std::size_t n) : of_(n) { std::iota(of_.begin(), of_.end(), 0u); }
    std::uint32_t find(std::uint32_t i) {
        while (of_[i] != i)
            i = of_[i] = of_[of_[i]];
        return i;
    }
    void join(std::uint32_t a, std::uint32_t b) {
        const auto [low, high] = std::minmax({find(a), find(b)}); // a list: values, no references
        of_[high] = low;
    }

private:
    std::vector<std::uint32_t> of_;
};

/// Joins the corners at both ends of edges that two faces share smoothly.
void join_across_edges(const std::vector<Triangle>& triangles, const std::vector<Vec3>& normals,
                       double least_cosine, Groups& groups) {
    struct Side {
        std::uint32_t a, b, corner_a, corner_b;
    };
    std::vector<Side> sides;
    for (std::uint32_t f = 0; f < triangles.size(); ++f)
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t next = (k + 1) % 3;
            Side s{triangles[f][k], triangles[f][next], 3 * f + k, 3 * f + next};
            if (s.a > s.b)
                s = {s.b, s.a, s.corner_b, s.corner_a};
            sides.push_back(s);
        }
    std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
        return std::tie(x.a, x.b, x.corner_a) < std::tie(y.a, y.b, y.corner_a);
    });
    for (std::size_t i = 0, end = 0; i < sides.size(); i = end) {
        for (end = i + 1;
             end < sides.size() && sides[end].a == sides[i].a && sides[end].b == sides[i].b;)
            ++end;
        if (end == i + 2 && dot(normals[sides[i].corner_a / 3],
                                normals[sides[i + 1].corner_a / 3]) >= least_cosine) {
            groups.join(sides[i].corner_a, sides[i + 1].corner_a);
            groups.join(sides[i].corner_b, sides[i + 1].corner_b);
        }
    }
}

} // namespace

CreasedMesh with_creases(const TriMesh& mesh, double crease_deg) {
    check_writable(mesh, "creases");
    if (!(crease_deg >= 0 && crease_deg <= kHalfTurn_deg))
        throw Error(Fault::bad_argument,
                    "creases: " + std::to_string(crease_deg) + " degrees, must be 0..180");
    const std::vector<std::uint32_t> first = first_equal(mesh.positions);
    CreasedMesh out;
    std::vector<Triangle> triangles;
    std::vector<Vec3> normals;
    for (const Triangle& given : mesh.triangles) {
        const Triangle t = {first[given[0]], first[given[1]], first[given[2]]};
        const Vec3 n = cross(mesh.positions[t[1]] - mesh.positions[t[0]],
                             mesh.positions[t[2]] - mesh.positions[t[0]]);
        if (!(length(n) > 0)) {
            ++out.n_degenerate;
            continue;
        }
        triangles.push_back(t);
        normals.push_back(normalized(n));
    }
    if (triangles.empty())
        throw Error(Fault::bad_input, "creases: no triangle has an area; mend the mesh first");
    Groups groups(3 * triangles.size());
    join_across_edges(triangles, normals, std::cos(crease_deg * std::numbers::pi / kHalfTurn_deg),
                      groups);
    constexpr std::uint32_t kNone = 0xffffffffu;
    std::vector<std::uint32_t> vertex(3 * triangles.size(), kNone); // of a group's first corner
    for (std::uint32_t f = 0; f < triangles.size(); ++f) {
        Triangle& corners = out.mesh.triangles.emplace_back();
        for (std::uint32_t k = 0; k < 3; ++k) {
            std::uint32_t& v = vertex[groups.find(3 * f + k)];
            const Vec3& p = mesh.positions[triangles[f][k]];
            if (v == kNone) {
                v = static_cast<std::uint32_t>(out.mesh.positions.size());
                out.mesh.positions.push_back(p);
                out.mesh.normals.emplace_back();
            }
            const Vec3 a = normalized(mesh.positions[triangles[f][(k + 1) % 3]] - p),
                       b = normalized(mesh.positions[triangles[f][(k + 2) % 3]] - p);
            out.mesh.normals[v] += normals[f] * std::acos(std::clamp(dot(a, b), -1.0, 1.0));
            corners[k] = v;
        }
    }
    for (const Triangle& t : out.mesh.triangles) // where they cancel out, any of its faces'
        for (const std::uint32_t v : t)
            if (!(length(out.mesh.normals[v]) > 1e-12))
                out.mesh.normals[v] =
                    normals[static_cast<std::size_t>(&t - out.mesh.triangles.data())];
    for (Vec3& n : out.mesh.normals)
        n = normalized(n);
    return out;
}

} // namespace taihu
