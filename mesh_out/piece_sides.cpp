#include "mesh_out/piece_sides_detail.h"

#include <limits>
#include <vector>

#include "mesh_out/crossings_detail.h"
#include "mesh_out/face_tree_detail.h"

namespace taihu {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// How often, and to which side, a face goes round the line through `p` along X: an edge counts
/// where it passes p, the same for both of its faces.
int turns(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
    const auto passed = [&p](const Vec3& u, const Vec3& v) {
        const bool up = u.y <= p.y && v.y > p.y, down = v.y <= p.y && u.y > p.y;
        if (!up && !down)
            return 0;
        const Vec3 &lo = up ? u : v, &hi = up ? v : u;
        // In the plane of y and z: a third point along X makes it one of space.
        const Vec3 from{0, lo.y, lo.z}, to{0, hi.y, hi.z}, at{0, p.y, p.z}, side{1, lo.y, lo.z};
        return orient3d(from, to, at, side) > 0 ? (up ? 1 : -1) : 0;
    };
    return passed(a, b) + passed(b, c) + passed(c, a);
}

} // namespace

std::size_t count_misplaced_pieces(std::span<const Vec3> positions, std::span<const Triangle> faces,
                                   std::span<const std::uint32_t> piece_of,
                                   std::span<const double> volume) {
    std::vector<std::uint32_t> farthest(faces.size(), kNone); // vertex of a piece along X
    for (std::size_t f = 0; f < faces.size(); ++f)
        for (const std::uint32_t v : faces[f])
            if (std::uint32_t& far = farthest[piece_of[f]];
                far == kNone || positions[v].x > positions[far].x)
                far = v;
    const FaceTree tree(positions, faces);
    std::size_t n = 0;
    for (std::uint32_t piece = 0; piece < farthest.size(); ++piece) {
        if (farthest[piece] == kNone || volume[piece] == 0)
            continue;
        const Vec3 p = positions[farthest[piece]];
        Box ahead;
        ahead.include(p);
        ahead.include({tree.bounds().hi.x, p.y, p.z});
        int depth = 0;
        tree.visit(tree.box(ahead), [&](const FaceTree::Face& face) {
            if (piece_of[face.index] == piece)
                return;
            const auto& [a, b, c] = face.vertices;
            const int round = turns(p, positions[a], positions[b], positions[c]);
            if (round != 0 && orient3d(positions[a], positions[b], positions[c], p) * round < 0)
                depth += round;
        });
        n += depth != (volume[piece] > 0 ? 0 : 1);
    }
    return n;
}

} // namespace taihu
