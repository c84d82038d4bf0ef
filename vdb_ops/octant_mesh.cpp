#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "vdb_ops/octant_mesh_detail.h"

namespace taihu {

Quarter::Quarter(int n, double exponent) {
    for (int i = 0; i <= n; ++i) {
        const double angle = std::numbers::pi / 2 * i / n;
        cos.push_back(i == n ? 0 : std::pow(std::cos(angle), exponent));
        sin.push_back(i == n ? 1 : std::pow(std::sin(angle), exponent));
    }
}

TriMesh octant_mesh(int n, const std::function<Vec3(const Vec3& sign, int lat, int lon)>& point) {
    TriMesh mesh;
    std::map<std::array<double, 3>, std::uint32_t> known;
    const int n_rows = 2 * (n + 1), n_columns = 4 * (n + 1);
    std::vector<std::uint32_t> ids; // rows from the south pole, columns from +X over +Z
    for (int r = 0; r < n_rows; ++r)
        for (int c = 0; c < n_columns; ++c) {
            const int quadrant = c / (n + 1), along = c % (n + 1);
            const Vec3 sign{quadrant == 0 || quadrant == 3 ? 1. : -1., r > n ? 1. : -1.,
                            quadrant < 2 ? 1. : -1.};
            const Vec3 p =
                point(sign, r > n ? r - n - 1 : n - r, quadrant % 2 == 0 ? along : n - along);
            const auto [it, added] = known.try_emplace(
                {p.x, p.y, p.z}, static_cast<std::uint32_t>(mesh.positions.size()));
            if (added)
                mesh.positions.push_back(p);
            ids.push_back(it->second);
        }
    const auto at = [&](int r, int c) {
        return ids[static_cast<std::size_t>(r * n_columns + c % n_columns)];
    };
    const auto add = [&mesh](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        if (a != b && b != c && c != a)
            mesh.triangles.push_back({a, b, c});
    };
    for (int c = 0; c < n_columns; ++c) {
        add(at(0, 0), at(0, c), at(0, c + 1));
        add(at(n_rows - 1, 0), at(n_rows - 1, c + 1), at(n_rows - 1, c));
        for (int r = 0; r + 1 < n_rows; ++r) {
            add(at(r, c), at(r + 1, c), at(r + 1, c + 1));
            add(at(r, c), at(r + 1, c + 1), at(r, c + 1));
        }
    }
    return mesh;
}

} // namespace taihu
