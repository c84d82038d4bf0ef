#pragma once
#include <algorithm>
#include <cstdint>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <tbb/parallel_sort.h>

#include "stats/core/error.h"
#include "stats/core/tri_mesh.h"

// OpenMesh's half-edge mesh, and the way into it and back. Vertex i is position i.

namespace taihu {

struct HalfEdgeTraits : OpenMesh::DefaultTraitsDouble {
    VertexAttributes(OpenMesh::Attributes::Status);
    HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge | OpenMesh::Attributes::Status);
    EdgeAttributes(OpenMesh::Attributes::Status);
    FaceAttributes(OpenMesh::Attributes::Status);
};
using HalfEdgeMesh = OpenMesh::TriMesh_ArrayKernelT<HalfEdgeTraits>;

/// Whether `mesh` is closed, oriented and a 2-manifold by index, edges and vertices. To be asked
/// first: OpenMesh prints when it is given anything else.
inline bool is_closed_manifold(const TriMesh& mesh) {
    struct Edge {
        std::uint64_t key; ///< the two vertices, lower one first
        std::uint32_t corner;
    };
    const std::size_t n = 3 * mesh.triangles.size();
    if (n == 0 || n > 0xffffffffu)
        return false;
    const auto vertex = [&](std::size_t corner) { return mesh.triangles[corner / 3][corner % 3]; };
    const auto next = [](std::size_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; };
    std::vector<Edge> edges(n); // that of corner c runs from c to next(c)
    for (std::size_t c = 0; c < n; ++c) {
        const std::uint32_t a = vertex(c), b = vertex(next(c));
        const auto [lo, hi] = std::minmax(a, b);
        if (lo == hi || hi >= mesh.positions.size())
            return false;
        edges[c] = {std::uint64_t{lo} << 32 | hi, static_cast<std::uint32_t>(c)};
    }
    tbb::parallel_sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
        return std::tie(a.key, a.corner) < std::tie(b.key, b.corner);
    });
    std::vector<std::uint32_t> twin(n);
    for (std::size_t i = 0; i < n; i += 2) {
        if (i + 1 == n || edges[i].key != edges[i + 1].key ||
            (i + 2 < n && edges[i].key == edges[i + 2].key) ||
            vertex(edges[i].corner) == vertex(edges[i + 1].corner))
            return false;
        twin[edges[i].corner] = edges[i + 1].corner;
        twin[edges[i + 1].corner] = edges[i].corner;
    }
    // One walk round each vertex must meet all of its corners.
    std::vector<std::uint8_t> seen(n, 0), walked(mesh.positions.size(), 0);
    for (std::size_t c = 0; c < n; ++c) {
        if (seen[c])
            continue;
        if (std::exchange(walked[vertex(c)], std::uint8_t{1}))
            return false;
        for (std::size_t at = c; !seen[at]; at = next(twin[at]))
            seen[at] = 1;
    }
    return true;
}

/// \param where  begins the message.
/// \throws Error bad_argument: not a closed 2-manifold.
inline HalfEdgeMesh to_half_edges(const TriMesh& mesh, const std::string& where) {
    if (!is_closed_manifold(mesh))
        throw Error(Fault::bad_argument,
                    where + ": the mesh of " + std::to_string(mesh.triangles.size()) +
                        " triangles is not a closed 2-manifold; repair it first");
    HalfEdgeMesh result;
    result.reserve(mesh.positions.size(), 3 * mesh.triangles.size() / 2, mesh.triangles.size());
    for (const Vec3& p : mesh.positions)
        result.add_vertex({p.x, p.y, p.z});
    const auto handle = [](std::uint32_t v) {
        return HalfEdgeMesh::VertexHandle(static_cast<int>(v));
    };
    for (const Triangle& t : mesh.triangles)
        if (!result.add_face(handle(t[0]), handle(t[1]), handle(t[2])).is_valid())
            throw Error(Fault::bad_argument,
                        where + ": OpenMesh cannot hold the mesh; repair it first");
    return result;
}

/// What is left of `mesh` (made from `original`) after collapses and flips: used vertices and faces
/// in their old order, vertices where `original` has them, with its normals.
inline TriMesh from_half_edges(const HalfEdgeMesh& mesh, const TriMesh& original) {
    TriMesh result;
    std::vector<std::uint32_t> renamed(mesh.n_vertices());
    for (std::uint32_t v = 0; v < mesh.n_vertices(); ++v) {
        const HalfEdgeMesh::VertexHandle handle(static_cast<int>(v));
        if (mesh.status(handle).deleted() || mesh.is_isolated(handle))
            continue;
        renamed[v] = static_cast<std::uint32_t>(result.positions.size());
        result.positions.push_back(original.positions[v]);
        if (!original.normals.empty())
            result.normals.push_back(original.normals[v]);
    }
    for (std::uint32_t f = 0; f < mesh.n_faces(); ++f) {
        const HalfEdgeMesh::FaceHandle handle(static_cast<int>(f));
        if (mesh.status(handle).deleted())
            continue;
        Triangle t;
        auto corner = mesh.cfv_begin(handle);
        for (std::uint32_t& v : t)
            v = renamed[static_cast<std::size_t>((corner++)->idx())];
        result.triangles.push_back(t);
    }
    return result;
}

} // namespace taihu
