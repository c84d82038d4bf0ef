#pragma once
#include <cmath>
#include <map>

#include "mesh_out/position_grid.h"
#include "stats/core/tri_mesh.h"

namespace taihu {

/// An octahedron with n^2 triangles a side, blown up to a ball of `radius_m` and rounded to
/// multiples of `step_m`: closed, 2-manifold, outward, with normals; 4 n^2 + 2 vertices.
inline TriMesh grid_ball(int n, double radius_m, double step_m) {
    TriMesh mesh;
    std::map<std::array<int, 3>, std::uint32_t> known;
    const auto vertex = [&](int x, int y, int z) {
        const auto [at, is_new] =
            known.try_emplace({x, y, z}, static_cast<std::uint32_t>(mesh.positions.size()));
        if (is_new) {
            const Vec3 direction = normalized(
                {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)});
            Vec3 p = direction * radius_m;
            for (int axis = 0; axis < 3; ++axis)
                p[axis] = std::round(p[axis] / step_m) * step_m;
            mesh.positions.push_back(p);
            mesh.normals.push_back(direction);
        }
        return at->second;
    };
    for (int side = 0; side < 8; ++side) {
        const int sx = side & 1 ? -1 : 1, sy = side & 2 ? -1 : 1, sz = side & 4 ? -1 : 1;
        const auto corner = [&](int i, int j) { return vertex(sx * i, sy * j, sz * (n - i - j)); };
        const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            if (sx * sy * sz > 0)
                mesh.triangles.push_back({a, b, c});
            else
                mesh.triangles.push_back({a, c, b});
        };
        for (int i = 0; i < n; ++i)
            for (int j = 0; i + j < n; ++j) {
                add(corner(i, j), corner(i + 1, j), corner(i, j + 1));
                if (i + j + 1 < n)
                    add(corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1));
            }
    }
    return mesh;
}

/// A grid of `bits` about the origin.
inline PositionGrid centred_grid(double step_m, int bits) {
    const double half = step_m * std::ldexp(1.0, bits - 1);
    return {{-half, -half, -half}, step_m, bits};
}

} // namespace taihu
