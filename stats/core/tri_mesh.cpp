#include "stats/core/tri_mesh.h"

namespace taihu {

Box bounds(const TriMesh& mesh) {
    Box box;
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t)
            box.include(mesh.positions[v]);
    return box;
}

double signed_volume_m3(const TriMesh& mesh) {
    if (mesh.triangles.empty())
        return 0;
    const Vec3 origin = mesh.positions[mesh.triangles[0][0]];
    double sum = 0;
    for (const Triangle& t : mesh.triangles)
        sum += dot(mesh.positions[t[0]] - origin,
                   cross(mesh.positions[t[1]] - origin, mesh.positions[t[2]] - origin));
    return sum / 6;
}

double area_m2(const TriMesh& mesh) {
    double sum = 0;
    for (const Triangle& t : mesh.triangles)
        sum += length(cross(mesh.positions[t[1]] - mesh.positions[t[0]],
                            mesh.positions[t[2]] - mesh.positions[t[0]]));
    return sum / 2;
}

} // namespace taihu
