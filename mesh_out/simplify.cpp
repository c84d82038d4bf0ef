#include "mesh_out/simplify.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>
#include <string>
#include <tuple>

#include <OpenMesh/Core/Utils/vector_cast.hh> // QuadricT.hh needs it and does not include it

#include <OpenMesh/Core/Geometry/QuadricT.hh>
#include <tbb/parallel_for.h>

#include "mesh_out/closest_point_detail.h"
#include "mesh_out/half_edges_detail.h"
#include "mesh_out/surface_distance.h"

namespace taihu {
namespace {

using HalfEdge = HalfEdgeMesh::HalfedgeHandle;
using Vertex = HalfEdgeMesh::VertexHandle;
using Face = HalfEdgeMesh::FaceHandle;
using Quadric = OpenMesh::Geometry::QuadricT<double>;

constexpr std::uint32_t kNone = 0xffffffffu;
constexpr std::size_t kMaxValence = 32; ///< fans beyond it slow down every test round them

std::size_t index(const OpenMesh::BaseHandle& handle) {
    return static_cast<std::size_t>(handle.idx());
}

/// Side of a square that two triangles of the mesh fill, as they do in a uniform mesh.
double spacing_of(const TriMesh& mesh) {
    return std::sqrt(2 * area_m2(mesh) / static_cast<double>(mesh.triangles.size()));
}

/// The mesh being simplified and everything known of its elements. Blocks of it are worked on at
/// the same time: a collapse is tried only when the rings of both ends lie in one block, and then
/// touches nothing outside of it.
struct Surface {
    HalfEdgeMesh mesh;
    const SurfaceDistance reference;
    double bound_m, min_turn_cosine, leaf_m, length_weight;
    Vec3 center; ///< quadrics are taken about it, or far from the origin they lose their digits

    std::vector<Quadric> quadrics;       ///< per vertex
    std::vector<std::uint32_t> stamps;   ///< per vertex: raised when its ring changes
    std::vector<std::uint32_t> blocks;   ///< per vertex
    std::vector<std::uint8_t> inner;     ///< per vertex: its ring lies in its block
    std::vector<std::uint8_t> exhausted; ///< per vertex: no collapse of it is legal as things are

    // What of the reference the surface no longer passes through, in one list per face: each point
    // stays within the bound of its face. Point i < number of vertices is vertex i.
    std::vector<Vec3> points;
    std::vector<std::uint32_t> first_point; ///< per face, kNone at the end
    std::vector<std::uint32_t> next_point;  ///< per point

    Surface(const TriMesh& input, const TriMesh& reference_mesh, const SimplifySettings& settings);
    void carry_reference(const TriMesh& input, const TriMesh& reference_mesh);
    void divide(double block_m, double shift);

    const Vec3& at(Vertex v) const { return points[index(v)]; }
    HalfEdge rotated(HalfEdge h) const { // the next one out of the same vertex
        return mesh.opposite_halfedge_handle(mesh.prev_halfedge_handle(h));
    }
};

Surface::Surface(const TriMesh& input, const TriMesh& reference_mesh,
                 const SimplifySettings& settings)
    : mesh(to_half_edges(input, "simplify")), reference(reference_mesh), bound_m(settings.bound_m),
      min_turn_cosine(std::cos(settings.max_normal_turn_deg * std::numbers::pi / 180)),
      // The reference is flat on the scale of its own faces: no need to look much closer.
      leaf_m(std::max(0.3 * bound_m, 0.15 * spacing_of(reference_mesh))),
      length_weight(1e-3 * area_m2(input) / static_cast<double>(input.triangles.size())),
      center(bounds(input).center()), quadrics(input.positions.size()),
      stamps(input.positions.size(), 0), blocks(input.positions.size(), 0),
      inner(input.positions.size(), 1), exhausted(input.positions.size(), 0),
      points(input.positions), first_point(input.triangles.size(), kNone) {
    for (const Triangle& t : input.triangles) {
        const Vec3 a = points[t[0]] - center;
        const Vec3 normal = cross(points[t[1]] - points[t[0]], points[t[2]] - points[t[0]]);
        const Vec3 unit = normalized(normal);
        Quadric plane(unit.x, unit.y, unit.z, -dot(unit, a));
        plane *= length(normal) / 2;
        for (const std::uint32_t v : t)
            quadrics[v] += plane;
    }
    carry_reference(input, reference_mesh);
}

/// Vertices and edge middles of the reference, each in the list of the face it is nearest to.
/// Middles too, because two ends within the bound of two faces say little of what lies between.
void Surface::carry_reference(const TriMesh& input, const TriMesh& reference_mesh) {
    const bool same =
        input.triangles == reference_mesh.triangles && input.positions == reference_mesh.positions;
    const std::vector<Vec3>& p = reference_mesh.positions;
    if (!same) // else its vertices are vertices of the mesh, carried when they go
        points.insert(points.end(), p.begin(), p.end());
    std::vector<std::uint32_t> faces(points.size(), kNone); // per point
    for (std::uint32_t f = 0; f < reference_mesh.triangles.size(); ++f) {
        const Triangle& t = reference_mesh.triangles[f];
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t a = t[k], b = t[(k + 1) % 3];
            if (a > b)
                continue;
            points.push_back((p[a] + p[b]) * 0.5);
            faces.push_back(f);
        }
    }
    const std::size_t n_own = input.positions.size();
    if (!same) {
        const SurfaceDistance to_input(input);
        tbb::parallel_for(n_own, points.size(), [&](std::size_t i) {
            const bool kept = i < n_own + p.size() && to_input(points[i]) == 0;
            faces[i] = kept ? kNone : to_input.nearest_triangle(points[i]);
        });
    }
    next_point.assign(points.size(), kNone);
    for (std::size_t i = n_own; i < points.size(); ++i) {
        if (faces[i] == kNone)
            continue;
        next_point[i] = first_point[faces[i]];
        first_point[faces[i]] = static_cast<std::uint32_t>(i);
    }
}

/// Cubes of side `block_m`, moved by `shift` of it; numbered in the order of their coordinates.
void Surface::divide(double block_m, double shift) {
    const std::size_t n = blocks.size();
    std::vector<std::array<std::int64_t, 3>> cells(n);
    for (std::size_t v = 0; v < n; ++v)
        for (std::size_t k = 0; k < 3; ++k)
            cells[v][k] = static_cast<std::int64_t>(
                std::floor((points[v] - center)[static_cast<int>(k)] / block_m + shift));
    auto sorted = cells;
    std::sort(sorted.begin(), sorted.end());
    sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    for (std::size_t v = 0; v < n; ++v)
        blocks[v] = static_cast<std::uint32_t>(
            std::lower_bound(sorted.begin(), sorted.end(), cells[v]) - sorted.begin());
    for (std::size_t v = 0; v < n; ++v) {
        const Vertex vertex(static_cast<int>(v));
        if (mesh.status(vertex).deleted())
            continue;
        inner[v] = 1;
        for (const auto& neighbour : mesh.vv_range(vertex))
            if (blocks[index(neighbour)] != blocks[v])
                inner[v] = 0;
    }
}

/// One block's queue: from each vertex its cheapest collapse that was not refused yet.
class Worker {
public:
    Worker(Surface& surface, std::size_t n_removable, const Progress* progress)
        : s_(surface), n_removable_(n_removable), progress_(progress) {}

    /// Collapse what can be among `vertices`. \returns the number of triangles removed.
    std::size_t run(const std::vector<std::uint32_t>& vertices);

private:
    struct Candidate {
        float cost;
        int half_edge;
        std::uint32_t stamp; ///< of the vertex it leaves; an older one is void
        bool operator>(const Candidate& other) const {
            return std::tie(cost, half_edge) > std::tie(other.cost, other.half_edge);
        }
    };
    struct NewFace {
        Face face; ///< takes the place of this one
        Vec3 b, c; ///< beside the vertex that stays
    };
    struct Carried {
        std::uint32_t point;
        std::size_t new_face;
    };

    float cost(HalfEdge h) const;
    void enqueue(Vertex v, float above_cost, int above_half_edge);
    bool links(HalfEdge h) const;
    bool gather_faces(HalfEdge h);
    bool carry(std::uint32_t point);
    bool carry_points(HalfEdge h);
    bool within(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& middle, double d) const;
    bool faces_within_bound() const;
    bool legal(HalfEdge h) {
        return links(h) && gather_faces(h) && carry_points(h) && faces_within_bound();
    }
    void collapse(HalfEdge h);

    Surface& s_;
    std::size_t n_removable_;
    const Progress* progress_;
    std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> queue_;
    std::vector<NewFace> faces_; ///< of the collapse being looked at
    std::vector<Carried> carried_;
    std::vector<Vertex> ring_;
    Vec3 apex_; ///< the vertex that stays
};

float Worker::cost(HalfEdge h) const {
    const Vertex v0 = s_.mesh.from_vertex_handle(h), v1 = s_.mesh.to_vertex_handle(h);
    const Vec3 p = s_.at(v1) - s_.center;
    const OpenMesh::Vec3d q(p.x, p.y, p.z);
    const double quadric = s_.quadrics[index(v0)](q) + s_.quadrics[index(v1)](q);
    // A little of the length, so that on flat ground short edges go first and no slivers grow.
    return static_cast<float>(std::max(0.0, quadric) +
                              s_.length_weight * length_squared(s_.at(v1) - s_.at(v0)));
}

/// Queue the cheapest collapse of `v` beyond the given one in (cost, half-edge).
void Worker::enqueue(Vertex v, float above_cost, int above_half_edge) {
    if (!s_.inner[index(v)])
        return;
    Candidate best{0, -1, s_.stamps[index(v)]};
    bool blocked = false;
    const HalfEdge start = s_.mesh.halfedge_handle(v);
    HalfEdge h = start;
    do {
        if (s_.inner[index(s_.mesh.to_vertex_handle(h))]) {
            const Candidate next{cost(h), h.idx(), best.stamp};
            if (std::tie(next.cost, next.half_edge) > std::tie(above_cost, above_half_edge) &&
                (best.half_edge < 0 || best > next))
                best = next;
        } else {
            blocked = true;
        }
        h = s_.rotated(h);
    } while (h != start);
    s_.exhausted[index(v)] = best.half_edge < 0 && !blocked;
    if (best.half_edge >= 0)
        queue_.push(best);
}

/// Whether the surface stays a 2-manifold of the same genus.
bool Worker::links(HalfEdge h) const {
    const unsigned v0 = s_.mesh.valence(s_.mesh.from_vertex_handle(h));
    const unsigned v1 = s_.mesh.valence(s_.mesh.to_vertex_handle(h));
    const bool tetrahedron = v0 == 3 && v1 == 3;
    return !tetrahedron && v0 + v1 - 4 <= kMaxValence && s_.mesh.is_collapse_ok(h);
}

/// Fills faces_; false where a face turns too far, or becomes a worse sliver than it was.
bool Worker::gather_faces(HalfEdge h) {
    constexpr double kSliver = 0.06; // 2 area / longest edge^2; 0.87 for an equilateral triangle
    const Vertex v0 = s_.mesh.from_vertex_handle(h), v1 = s_.mesh.to_vertex_handle(h);
    const Vec3 removed = s_.at(v0);
    apex_ = s_.at(v1);
    faces_.clear();
    for (HalfEdge e = s_.rotated(h); e != h; e = s_.rotated(e)) {
        const Vertex vb = s_.mesh.to_vertex_handle(e);
        const Vertex vc = s_.mesh.to_vertex_handle(s_.mesh.next_halfedge_handle(e));
        if (vb == v1 || vc == v1)
            continue;
        const Vec3 &b = s_.at(vb), &c = s_.at(vc);
        const Vec3 before = cross(b - removed, c - removed), after = cross(b - apex_, c - apex_);
        const double area0 = length(before), area1 = length(after);
        if (!(dot(before, after) > s_.min_turn_cosine * area0 * area1) || !(area1 > 0))
            return false;
        const double far = length_squared(c - b);
        const double longest0 =
            std::max({far, length_squared(b - removed), length_squared(c - removed)});
        const double longest1 =
            std::max({far, length_squared(b - apex_), length_squared(c - apex_)});
        if (area1 < kSliver * longest1 && area1 * longest0 < area0 * longest1)
            return false;
        faces_.push_back({s_.mesh.face_handle(e), b, c});
    }
    return !faces_.empty();
}

/// Give `point` to the nearest new face, if that is within the bound.
bool Worker::carry(std::uint32_t point) {
    const Vec3& p = s_.points[point];
    double best = s_.bound_m * s_.bound_m;
    std::size_t nearest = faces_.size();
    for (std::size_t i = 0; i < faces_.size(); ++i) {
        const Vec3 q = closest_point_on_triangle(p, apex_, faces_[i].b, faces_[i].c);
        const double squared = length_squared(q - p);
        if (squared < best) {
            best = squared;
            nearest = i;
        }
    }
    carried_.push_back({point, nearest});
    return nearest < faces_.size();
}

bool Worker::carry_points(HalfEdge h) {
    carried_.clear();
    const Vertex v0 = s_.mesh.from_vertex_handle(h);
    if (!carry(static_cast<std::uint32_t>(v0.idx())))
        return false;
    HalfEdge e = h;
    do {
        std::uint32_t point = s_.first_point[index(s_.mesh.face_handle(e))];
        for (; point != kNone; point = s_.next_point[point])
            if (!carry(point))
                return false;
        e = s_.rotated(e);
    } while (e != h);
    return true;
}

/// Whether a face lies within the bound, given the distance `d` of its middle. A middle far enough
/// inside the bound vouches for the whole face; otherwise the four quarters are asked, down to
/// leaves finer than the reference's own faces. How fast distance changes along a face is the slope
/// between face and surface. kSlope holds for all but a few faces (1 would for all, at twice the
/// time); what it misses is found by measuring the result.
bool Worker::within(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& middle,
                    double d) const {
    constexpr double kSlope = 0.35;
    if (d >= s_.bound_m)
        return false;
    const double radius = std::sqrt(std::max(
        {length_squared(a - middle), length_squared(b - middle), length_squared(c - middle)}));
    if (d + kSlope * radius <= s_.bound_m || radius <= s_.leaf_m)
        return true;
    const Vec3 ab = (a + b) * 0.5, bc = (b + c) * 0.5, ca = (c + a) * 0.5;
    const auto corner = [&](const Vec3& p, const Vec3& q, const Vec3& r) {
        const Vec3 m = (p + q + r) / 3;
        return within(p, q, r, m, s_.reference(m, s_.bound_m));
    };
    return within(ab, bc, ca, middle, d) && corner(a, ab, ca) && corner(ab, b, bc) &&
           corner(ca, bc, c);
}

bool Worker::faces_within_bound() const {
    for (const NewFace& face : faces_) // edges stray farthest: ask their middles first
        if (s_.reference((apex_ + face.b) * 0.5, s_.bound_m) >= s_.bound_m)
            return false;
    for (const NewFace& face : faces_) {
        const Vec3 m = (apex_ + face.b + face.c) / 3;
        if (!within(apex_, face.b, face.c, m, s_.reference(m, s_.bound_m)))
            return false;
    }
    return true;
}

void Worker::collapse(HalfEdge h) {
    const Vertex v0 = s_.mesh.from_vertex_handle(h), v1 = s_.mesh.to_vertex_handle(h);
    ring_.clear();
    HalfEdge e = h;
    do {
        ring_.push_back(s_.mesh.to_vertex_handle(e));
        s_.first_point[index(s_.mesh.face_handle(e))] = kNone;
        e = s_.rotated(e);
    } while (e != h);
    for (const Carried& carried : carried_) {
        std::uint32_t& first = s_.first_point[index(faces_[carried.new_face].face)];
        s_.next_point[carried.point] = first;
        first = carried.point;
    }
    s_.mesh.collapse(h);
    s_.quadrics[index(v1)] += s_.quadrics[index(v0)];
    for (const Vertex v : ring_) {
        ++s_.stamps[index(v)];
        s_.exhausted[index(v)] = 0;
        enqueue(v, -1, -1);
    }
}

std::size_t Worker::run(const std::vector<std::uint32_t>& vertices) {
    for (const std::uint32_t v : vertices)
        enqueue(Vertex(static_cast<int>(v)), -1, -1);
    std::size_t n_removed = 0;
    for (std::size_t n = 0; !queue_.empty() && n_removed + 2 <= n_removable_; ++n) {
        if (n % 1024 == 0)
            check_cancelled(progress_);
        const Candidate candidate = queue_.top();
        queue_.pop();
        const HalfEdge h(candidate.half_edge);
        if (s_.mesh.status(h).deleted())
            continue;
        const Vertex v = s_.mesh.from_vertex_handle(h);
        if (s_.mesh.status(v).deleted() || s_.stamps[index(v)] != candidate.stamp)
            continue;
        if (legal(h)) {
            collapse(h);
            n_removed += 2;
        } else {
            enqueue(v, candidate.cost, candidate.half_edge);
        }
    }
    return n_removed;
}

/// One pass over all blocks, each with its share of the triangles that may still go.
/// \returns the number of triangles removed.
std::size_t run_blocks(Surface& surface, std::size_t n_removable, const Progress* progress) {
    const std::size_t n_blocks =
        1 + *std::max_element(surface.blocks.begin(), surface.blocks.end());
    std::vector<std::vector<std::uint32_t>> vertices(n_blocks);
    std::vector<std::size_t> n_vertices(n_blocks, 0);
    std::size_t n_alive = 0;
    for (std::size_t v = 0; v < surface.blocks.size(); ++v) {
        if (surface.mesh.status(Vertex(static_cast<int>(v))).deleted())
            continue;
        ++n_alive;
        ++n_vertices[surface.blocks[v]];
        if (surface.inner[v] && !surface.exhausted[v])
            vertices[surface.blocks[v]].push_back(static_cast<std::uint32_t>(v));
    }
    std::vector<std::size_t> n_removed(n_blocks, 0);
    tbb::parallel_for(std::size_t{0}, n_blocks, [&](std::size_t block) {
        const std::size_t share = n_removable * n_vertices[block] / n_alive;
        n_removed[block] = Worker(surface, share, progress).run(vertices[block]);
    });
    std::size_t total = 0;
    for (const std::size_t n : n_removed)
        total += n;
    return total;
}

} // namespace

TriMesh simplify(const TriMesh& mesh, const TriMesh& reference, const SimplifySettings& settings,
                 Progress* progress) {
    if (!(settings.bound_m > 0) || !std::isfinite(settings.bound_m))
        throw Error(Fault::bad_argument, "simplify: bound_m is " +
                                             std::to_string(settings.bound_m) +
                                             ", must be finite and > 0");
    if (!(settings.max_normal_turn_deg > 0 && settings.max_normal_turn_deg <= 90))
        throw Error(Fault::bad_argument, "simplify: max_normal_turn_deg is " +
                                             std::to_string(settings.max_normal_turn_deg) +
                                             ", must be in (0, 90]");
    check_cancelled(progress);
    Surface surface(mesh, reference, settings);
    const double block_m = 32 * spacing_of(mesh);
    if (!(block_m > 0) || !std::isfinite(block_m))
        throw Error(Fault::bad_argument, "simplify: the mesh of " +
                                             std::to_string(mesh.triangles.size()) +
                                             " triangles has no finite area; repair it first");
    std::size_t n_triangles = mesh.triangles.size();
    const auto n_removable = [&] {
        return n_triangles - std::min(n_triangles, settings.min_triangles);
    };
    // Blocks at three places, then the whole as one block for what lay across all of their borders.
    constexpr std::array kShifts{0.0, 3.0 / 7, 5.0 / 7};
    for (std::size_t pass = 0; pass <= kShifts.size(); ++pass) {
        const bool last = pass == kShifts.size();
        surface.divide(last ? std::numeric_limits<double>::infinity() : block_m,
                       last ? 0.5 : kShifts[pass]);
        n_triangles -= run_blocks(surface, n_removable(), progress);
        report_fraction(progress, static_cast<double>(pass + 1) / (kShifts.size() + 1));
    }
    return from_half_edges(surface.mesh, mesh);
}

} // namespace taihu
