#include "tests/bench/mesh_peers.h"

#include <openvdb/tools/VolumeToMesh.h>

#include <OpenMesh/Core/Utils/vector_cast.hh> // ModQuadricT.hh needs it and does not include it

#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

#ifdef TAIHU_HAS_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif

#include "mesh_out/half_edges_detail.h"
#include "tests/bench/ratio.h"

namespace taihu {

TriMesh peer_mesh(const openvdb::FloatGrid& grid, double adaptivity) {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    std::vector<openvdb::Vec4I> quads;
    openvdb::tools::volumeToMesh(grid, points, triangles, quads, 0, adaptivity);
    TriMesh mesh;
    for (const auto& p : points)
        mesh.positions.push_back({p.x(), p.y(), p.z()});
    for (const auto& t : triangles)
        mesh.triangles.push_back({t[2], t[1], t[0]});
    for (const auto& q : quads) {
        mesh.triangles.push_back({q[2], q[1], q[0]});
        mesh.triangles.push_back({q[3], q[2], q[0]});
    }
    return mesh;
}

TriMesh openmesh_simplified(const TriMesh& mesh, std::size_t n_faces, double& seconds) {
    HalfEdgeMesh half_edges = to_half_edges(mesh, "bench");
    const double start = processor_s();
    OpenMesh::Decimater::DecimaterT<HalfEdgeMesh> decimater(half_edges);
    OpenMesh::Decimater::ModQuadricT<HalfEdgeMesh>::Handle quadric;
    decimater.add(quadric);
    decimater.initialize();
    decimater.decimate_to_faces(0, n_faces);
    seconds = processor_s() - start;
    return from_half_edges(half_edges, mesh);
}

#ifdef TAIHU_HAS_MESHOPTIMIZER
TriMesh meshoptimizer_simplified(const TriMesh& mesh, std::size_t n_faces, double& seconds) {
    std::vector<float> positions;
    std::vector<unsigned> indices, left(3 * mesh.triangles.size());
    for (const Vec3& p : mesh.positions)
        for (int a = 0; a < 3; ++a)
            positions.push_back(static_cast<float>(p[a]));
    for (const Triangle& t : mesh.triangles)
        indices.insert(indices.end(), t.begin(), t.end());
    const double start = processor_s();
    left.resize(meshopt_simplify(left.data(), indices.data(), indices.size(), positions.data(),
                                 mesh.positions.size(), 3 * sizeof(float), 3 * n_faces, 1e9f, 0,
                                 nullptr));
    seconds = processor_s() - start;
    TriMesh simplified{mesh.positions, {}, {}};
    for (std::size_t i = 0; i < left.size(); i += 3)
        simplified.triangles.push_back({left[i], left[i + 1], left[i + 2]});
    return simplified;
}
#endif

} // namespace taihu
