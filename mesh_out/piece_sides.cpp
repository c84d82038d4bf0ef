#include "mesh_out/piece_sides_detail.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "mesh_out/crossings_detail.h"
#include "mesh_out/face_tree_detail.h"
#include "mesh_out/partition_detail.h"

namespace taihu {
namespace {

constexpr std::size_t kSmallPiece = 200; ///< faces
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

/// Which of the pieces with a volume face the wrong way, by the faces round their farthest vertices
/// along X.
std::vector<std::uint32_t> misplaced(std::span<const Vec3> positions,
                                     std::span<const Triangle> faces,
                                     std::span<const std::uint32_t> piece_of,
                                     std::span<const double> volume) {
    std::vector<std::uint32_t> farthest(volume.size(), kNone);
    for (std::size_t f = 0; f < faces.size(); ++f)
        for (const std::uint32_t v : faces[f])
            if (std::uint32_t& far = farthest[piece_of[f]];
                far == kNone || positions[v].x > positions[far].x)
                far = v;
    const FaceTree tree(positions, faces);
    std::vector<std::uint32_t> found;
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
        if (depth != (volume[piece] > 0 ? 0 : 1))
            found.push_back(piece);
    }
    return found;
}

} // namespace

std::size_t count_misplaced_pieces(std::span<const Vec3> positions, std::span<const Triangle> faces,
                                   std::span<const std::uint32_t> piece_of,
                                   std::span<const double> volume) {
    return misplaced(positions, faces, piece_of, volume).size();
}

void turn_small_pieces(std::span<const Vec3> positions, std::span<Triangle> faces) {
    Partition pieces(positions.size());
    for (const Triangle& t : faces)
        for (const std::uint32_t v : {t[1], t[2]})
            pieces.join(t[0], v);
    std::vector<std::uint32_t> piece_of(faces.size());
    std::vector<std::size_t> n_faces(positions.size());
    for (std::size_t f = 0; f < faces.size(); ++f)
        ++n_faces[piece_of[f] = pieces.find(faces[f][0])];
    std::vector<double> volume(positions.size());
    bool any = false;
    for (std::size_t f = 0; f < faces.size(); ++f) {
        const std::uint32_t piece = piece_of[f];
        if (n_faces[piece] > kSmallPiece || n_faces[piece] == faces.size())
            continue;
        const Vec3& o = positions[piece]; // itself a vertex of it
        const auto& [a, b, c] = faces[f];
        volume[piece] += dot(positions[a] - o, cross(positions[b] - o, positions[c] - o));
        any = true;
    }
    if (!any)
        return;
    std::vector<std::uint8_t> turned(positions.size());
    for (const std::uint32_t piece : misplaced(positions, faces, piece_of, volume))
        turned[piece] = 1;
    for (std::size_t f = 0; f < faces.size(); ++f)
        if (turned[piece_of[f]])
            std::swap(faces[f][1], faces[f][2]);
}

} // namespace taihu
