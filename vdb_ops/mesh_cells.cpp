#include "vdb_ops/mesh_cells_detail.h"

#include <array>
#include <limits>

namespace taihu {

LeafTriangle leaf_triangle(Triangle face, const std::vector<Vec3>& points, std::uint32_t shell,
                           float half_width) {
    std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
    const std::array<Vec3, 3> p = {points[face[0]], points[face[1]], points[face[2]]};
    LeafTriangle t;
    t.shell = shell;
    t.n_edges = face[1] < face[2] ? 2 : 1;
    const std::array<Vec3, 3> e = {p[1] - p[0], p[2] - p[1], p[0] - p[2]};
    Vec3 n = cross(e[0], e[1]);
    const double longest2 =
        std::max({length_squared(e[0]), length_squared(e[1]), length_squared(e[2])});
    // A needle has no normal worth the name: its edges are all of it.
    n = length_squared(n) <= 1e-14 * longest2 * longest2 ? Vec3{} : normalized(n);
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 en = cross(n, e[k]);
        const double e2 = length_squared(e[k]);
        t.inverse_e2[k] = e2 > 0 ? static_cast<float>(1 / e2) : 0.f;
        for (int c = 0; c < 3; ++c) {
            t.e[k][c] = static_cast<float>(e[k][c]);
            t.en[k][c] = static_cast<float>(en[c]);
        }
    }
    for (int c = 0; c < 3; ++c) {
        for (std::size_t k = 0; k < 3; ++k)
            t.corner[k][c] = p[k][c];
        t.n[c] = n[c];
        // Rounded away from the face, so that a cell is never missed.
        constexpr float kFar = std::numeric_limits<float>::infinity();
        t.lo[c] = std::nextafter(static_cast<float>(std::min({p[0][c], p[1][c], p[2][c]})), -kFar) -
                  half_width;
        t.hi[c] = std::nextafter(static_cast<float>(std::max({p[0][c], p[1][c], p[2][c]})), kFar) +
                  half_width;
    }
    return t;
}

} // namespace taihu
