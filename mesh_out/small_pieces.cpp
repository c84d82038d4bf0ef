#include "mesh_out/small_pieces_detail.h"

#include <limits>

#include "mesh_out/partition_detail.h"
#include "stats/core/box.h"

namespace taihu {

std::vector<Vec3> drop_small_pieces(TriMesh& mesh, double longest_m) {
    const std::size_t n = mesh.positions.size();
    Partition pieces(n);
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : {t[1], t[2]})
            pieces.join(t[0], v);
    std::vector<Box> boxes(n);
    for (std::uint32_t v = 0; v < n; ++v)
        boxes[pieces.find(v)].include(mesh.positions[v]);
    double most = 0;
    for (std::uint32_t v = 0; v < n; ++v)
        if (pieces.find(v) == v)
            most = std::max(most, boxes[v].longest());
    constexpr auto kGone = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> renamed(n, kGone);
    std::vector<Vec3> gone;
    std::uint32_t n_kept = 0;
    const auto keep = [&](auto& of_vertices, std::uint32_t v) {
        if (!of_vertices.empty())
            of_vertices[n_kept] = of_vertices[v];
    };
    for (std::uint32_t v = 0; v < n; ++v) {
        const double size = boxes[pieces.find(v)].longest();
        if (size <= longest_m && size < most) {
            gone.push_back(mesh.positions[v]);
            continue;
        }
        keep(mesh.positions, v);
        keep(mesh.normals, v);
        keep(mesh.openness, v);
        renamed[v] = n_kept++;
    }
    if (gone.empty())
        return gone;
    for (auto* vectors : {&mesh.positions, &mesh.normals})
        if (!vectors->empty())
            vectors->resize(n_kept);
    if (!mesh.openness.empty())
        mesh.openness.resize(n_kept);
    std::erase_if(mesh.triangles, [&](const Triangle& t) { return renamed[t[0]] == kGone; });
    for (Triangle& t : mesh.triangles)
        for (std::uint32_t& v : t)
            v = renamed[v];
    return gone;
}

} // namespace taihu
