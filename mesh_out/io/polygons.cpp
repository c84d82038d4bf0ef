#include "mesh_out/io/polygons_detail.h"

#include <algorithm>

namespace taihu {
namespace {

bool folded(const Triangle& t) {
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

} // namespace

void add_triangle(MeshFile& file, TriMesh& level, const Triangle& triangle) {
    if (folded(triangle))
        ++file.n_degenerate_faces;
    else
        level.triangles.push_back(triangle);
}

bool add_face(MeshFile& file, std::vector<std::uint32_t>& corners) {
    TriMesh& mesh = file.levels.front();
    if (corners.size() == 3) {
        add_triangle(file, mesh, {corners[0], corners[1], corners[2]});
        return true;
    }
    ++file.n_polygons;
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    while (corners.size() > 1 && corners.back() == corners.front())
        corners.pop_back();
    if (corners.size() < 3) {
        ++file.n_degenerate_faces;
        return true;
    }
    const auto n_before = static_cast<std::ptrdiff_t>(mesh.triangles.size());
    if (!triangulate(mesh.positions, corners, mesh.triangles))
        return false;
    // A corner met twice (a seam to an inner loop) may leave a triangle that folds onto a line.
    const auto added = mesh.triangles.begin() + n_before;
    const auto kept = std::remove_if(added, mesh.triangles.end(), folded);
    file.n_degenerate_faces += kept == added;
    mesh.triangles.erase(kept, mesh.triangles.end());
    return true;
}

} // namespace taihu
