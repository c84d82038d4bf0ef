#pragma once
#include <utility>

#include "stats/core/tri_mesh.h"
#include "vdb_ops/shapes.h"

namespace taihu {

inline TriMesh cube(const Vec3& at = {}, double size = 1) {
    TriMesh mesh = shape_mesh({.kind = ShapeKind::box, .size_m = {size, size, size}});
    for (Vec3& p : mesh.positions)
        p += at;
    return mesh;
}

inline void append(TriMesh& mesh, const TriMesh& other) {
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
    for (const Triangle& t : other.triangles)
        mesh.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
}

inline void flip(TriMesh& mesh) {
    for (Triangle& t : mesh.triangles)
        std::swap(t[0], t[1]);
}

} // namespace taihu
