#include "mesh_out/position_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <limits>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "mesh_out/half_edges_detail.h"

namespace taihu {
namespace {

constexpr int kMaxBits = 18;
constexpr double kFloatSteps = 1 << 24; ///< whole numbers up to here are exact in float

std::string shown(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", value);
    return text;
}

double power_of_two_below(double x) {
    int exponent = 0;
    std::frexp(x, &exponent); // x = m 2^exponent with 0.5 <= m < 1
    return std::ldexp(1.0, exponent - 1);
}

bool is_power_of_two(double x) {
    int exponent = 0;
    return x > 0 && std::isfinite(x) && std::frexp(x, &exponent) == 0.5;
}

/// The grid of `step` over `box` with room for two steps on each side; bits beyond the limit, or
/// coordinates beyond float, make bits 0.
PositionGrid grid_of_step(const Box& box, double step, double origin_step) {
    PositionGrid grid{{}, step, 0};
    double n_steps = 2, farthest = 0;
    for (int k = 0; k < 3; ++k) {
        grid.origin[k] = std::floor((box.lo[k] - 2 * step) / origin_step) * origin_step;
        const double n = std::ceil((box.hi[k] - grid.origin[k]) / step) + 3;
        n_steps = std::max(n_steps, n);
        farthest = std::max(
            {farthest, std::abs(grid.origin[k]) / step, std::abs(grid.origin[k] / step + n)});
    }
    int bits = 1;
    while (bits <= kMaxBits && std::exp2(bits) < n_steps)
        ++bits;
    grid.bits = bits <= kMaxBits && farthest < kFloatSteps ? bits : 0;
    return grid;
}

} // namespace

PositionGrid position_grid(const Box& box, double max_move_m, double origin_step_m) {
    if (box.empty() || !is_finite(box.lo) || !is_finite(box.hi))
        throw Error(Fault::bad_argument, "position grid: the box is empty or not finite; give the "
                                         "bounds of a mesh");
    if (!(max_move_m > 0) || !std::isfinite(max_move_m))
        throw Error(Fault::bad_argument, "position grid: max_move_m is " + shown(max_move_m) +
                                             ", must be finite and > 0");
    const double step = power_of_two_below(2 * max_move_m / std::sqrt(3.0));
    const double origin_step = origin_step_m == 0 ? step : origin_step_m;
    if (!is_power_of_two(origin_step) || origin_step < step)
        throw Error(Fault::bad_argument, "position grid: origin_step_m is " + shown(origin_step) +
                                             ", must be a power of two and at least the step " +
                                             shown(step));
    const PositionGrid grid = grid_of_step(box, step, origin_step);
    if (grid.bits > 0)
        return grid;
    double fits = step;
    while (std::isfinite(fits) && grid_of_step(box, fits, std::max(fits, origin_step)).bits == 0)
        fits *= 2;
    throw Error(Fault::numeric, "position grid: steps of " + shown(step) + " m need more than " +
                                    std::to_string(kMaxBits) +
                                    " bits or lie beyond float; the finest step that fits is " +
                                    shown(fits) + " m: allow moves of " +
                                    shown(fits * std::sqrt(3.0) / 2) +
                                    " m, or bring the mesh nearer to the origin");
}

PositionGrid finest_grid(const Box& box) {
    const double step = std::exp2(std::ceil(std::log2(box.longest() / 0x1p17)));
    return position_grid(box, step * std::sqrt(3.0) / 2 * (1 + 1e-9));
}

std::optional<PositionGrid> grid_of(const TriMesh& mesh) {
    Box box;
    int lowest = std::numeric_limits<int>::max(); // exponent of the least bit of any coordinate
    for (const Vec3& p : mesh.positions) {
        if (!is_finite(p))
            return std::nullopt;
        box.include(p);
        for (int axis = 0; axis < 3; ++axis) {
            int exponent = 0;
            const auto digits =
                static_cast<std::int64_t>(std::ldexp(std::frexp(p[axis], &exponent), 53));
            if (digits != 0)
                lowest = std::min(lowest, exponent - 53 +
                                              std::countr_zero(static_cast<std::uint64_t>(digits)));
        }
    }
    if (lowest == std::numeric_limits<int>::max())
        return std::nullopt;
    PositionGrid grid{box.lo, std::ldexp(1.0, lowest), 1};
    while (grid.bits <= kMaxBits && std::exp2(grid.bits) <= box.longest() / grid.step_m)
        ++grid.bits;
    if (grid.bits > kMaxBits)
        return std::nullopt;
    return grid;
}

namespace {

using Point = OpenMesh::Vec3d; ///< whole numbers of at most 18 bits: products of three are exact
using Vertex = HalfEdgeMesh::VertexHandle;
using HalfEdge = HalfEdgeMesh::HalfedgeHandle;
using Face = HalfEdgeMesh::FaceHandle;

Point normal(const Point& a, const Point& b, const Point& c) {
    return (b - a).cross(c - a);
}
bool is_zero(const Point& n) {
    return n[0] == 0 && n[1] == 0 && n[2] == 0;
}

/// A closed 2-manifold in lattice coordinates, on its way to distinct points and real triangles.
class Snapper {
public:
    Snapper(const TriMesh& mesh, const PositionGrid& grid);
    void separate_vertices();
    void open_flat_faces();
    SnapResult result() const;

private:
    static std::uint64_t key(const Point& p) {
        return static_cast<std::uint64_t>(p[0]) | static_cast<std::uint64_t>(p[1]) << 20 |
               static_cast<std::uint64_t>(p[2]) << 40;
    }
    Point lattice(int v) const {
        const Vec3 q =
            (input_.positions[static_cast<std::size_t>(v)] - grid_.origin) / grid_.step_m;
        return {q.x, q.y, q.z};
    }
    Point face_normal(Face f) const {
        const HalfEdge h = mesh_.halfedge_handle(f);
        const HalfEdge g = mesh_.next_halfedge_handle(h);
        return normal(mesh_.point(mesh_.from_vertex_handle(h)),
                      mesh_.point(mesh_.to_vertex_handle(h)),
                      mesh_.point(mesh_.to_vertex_handle(g)));
    }
    bool links(HalfEdge h) {
        const bool tetrahedron = mesh_.valence(mesh_.from_vertex_handle(h)) == 3 &&
                                 mesh_.valence(mesh_.to_vertex_handle(h)) == 3;
        return !tetrahedron && mesh_.is_collapse_ok(h);
    }
    /// What moving `v` to `to` asks of its faces.
    enum class Care { keep_side, keep_area, none };
    bool allows(Vertex v, const Point& to, Vertex merged_into, Care care) const;
    bool move(Vertex v);
    bool flip_longest(HalfEdge longest);
    bool collapse(HalfEdge h, Care care);
    bool open(Face f);
    [[noreturn]] void give_up(const std::string& what) const;

    const TriMesh& input_;
    const PositionGrid& grid_;
    HalfEdgeMesh mesh_;
    std::unordered_map<std::uint64_t, int>
        at_; ///< lattice point -> vertex; looked up, never walked
    std::deque<Face> to_look_at_;
    std::size_t n_collapsed_ = 0, n_moved_ = 0;
    double max_collapse_ = 0; ///< farthest that a collapsed vertex went [steps]
};

Snapper::Snapper(const TriMesh& mesh, const PositionGrid& grid)
    : input_(mesh), grid_(grid), mesh_(to_half_edges(mesh, "snap to grid")) {
    if (grid.bits < 1 || grid.bits > kMaxBits || !is_power_of_two(grid.step_m))
        throw Error(Fault::bad_argument, "snap to grid: the grid has " + std::to_string(grid.bits) +
                                             " bits and step " + shown(grid.step_m) +
                                             ", must be 1..18 and a power of two");
    const double last = std::exp2(grid.bits) - 1;
    for (const Vertex v : mesh_.vertices()) {
        if (mesh_.is_isolated(v))
            continue;
        Point p = lattice(v.idx());
        for (std::size_t k = 0; k < 3; ++k) {
            p[k] = std::nearbyint(p[k]);
            if (!(p[k] >= 0 && p[k] <= last))
                throw Error(Fault::bad_argument, "snap to grid: positions[" +
                                                     std::to_string(v.idx()) +
                                                     "] lies outside of the grid; make the grid "
                                                     "from the bounds of the mesh");
        }
        mesh_.set_point(v, p);
    }
}

void Snapper::give_up(const std::string& what) const {
    throw Error(Fault::numeric, "snap to grid: " + what + " on a grid of step " +
                                    shown(grid_.step_m) + " m; use a finer grid");
}

bool Snapper::allows(Vertex v, const Point& to, Vertex merged_into, Care care) const {
    if (care == Care::none)
        return true;
    for (const auto h : mesh_.voh_range(v)) {
        const Vertex b = mesh_.to_vertex_handle(h);
        const Vertex c = mesh_.to_vertex_handle(mesh_.next_halfedge_handle(h));
        if (b == merged_into || c == merged_into)
            continue;
        const Point after = normal(to, mesh_.point(b), mesh_.point(c));
        const Point before = normal(mesh_.point(v), mesh_.point(b), mesh_.point(c));
        if (is_zero(after) ||
            (care == Care::keep_side && !is_zero(before) && before.dot(after) <= 0))
            return false;
    }
    return true;
}

/// Move `v` to the best free lattice point round it: nearest to where the vertex really was.
bool Snapper::move(Vertex v) {
    const double last = std::exp2(grid_.bits) - 1;
    const Point at = mesh_.point(v), wanted = lattice(v.idx());
    std::vector<std::pair<double, Point>> places;
    for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
            for (int z = -1; z <= 1; ++z) {
                const Point p = at + Point(x, y, z);
                if (p.min() >= 0 && p.max() <= last && !at_.contains(key(p)))
                    places.emplace_back((p - wanted).sqrnorm(), p);
            }
    std::stable_sort(places.begin(), places.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const Care care : {Care::keep_side, Care::keep_area, Care::none})
        for (const auto& [ignored, place] : places)
            if (allows(v, place, Vertex(), care)) {
                const auto own = at_.find(key(at));
                if (own != at_.end() && own->second == v.idx())
                    at_.erase(own);
                at_.emplace(key(place), v.idx());
                mesh_.set_point(v, place);
                ++n_moved_;
                for (const auto f : mesh_.vf_range(v))
                    to_look_at_.push_back(f);
                return true;
            }
    return false;
}

bool Snapper::collapse(HalfEdge h, Care care) {
    const Vertex v = mesh_.from_vertex_handle(h), stays = mesh_.to_vertex_handle(h);
    const Point to = mesh_.point(stays);
    if (!links(h) || !allows(v, to, stays, care))
        return false;
    const auto own = at_.find(key(mesh_.point(v)));
    if (own != at_.end() && own->second == v.idx())
        at_.erase(own);
    max_collapse_ = std::max(max_collapse_, (lattice(v.idx()) - to).norm());
    mesh_.collapse(h);
    ++n_collapsed_;
    for (const auto f : mesh_.vf_range(stays))
        to_look_at_.push_back(f);
    return true;
}

void Snapper::separate_vertices() {
    std::vector<Vertex> doubles;
    at_.reserve(mesh_.n_vertices());
    for (const Vertex v : mesh_.vertices())
        if (!mesh_.is_isolated(v) && !at_.emplace(key(mesh_.point(v)), v.idx()).second)
            doubles.push_back(v);
    for (const Vertex v : doubles) {
        const HalfEdge h = mesh_.find_halfedge(v, Vertex(at_.at(key(mesh_.point(v)))));
        // Both ends are at one point: no face that stays changes, so none need be asked.
        const bool done = (h.is_valid() && collapse(h, Care::none)) || move(v);
        if (!done)
            give_up("vertex " + std::to_string(v.idx()) + " finds no place of its own");
    }
}

/// A flat face whose middle vertex m lies on its edge a-b: replacing that edge by the one from m to
/// the far corner cuts the neighbour in two and changes no point of the surface. The squares of the
/// edges' lengths sum to less each time, so this ends.
bool Snapper::flip_longest(HalfEdge longest) {
    const HalfEdgeMesh::EdgeHandle e = mesh_.edge_handle(longest);
    if (!mesh_.is_flip_ok(e))
        return false;
    const Face f0 = mesh_.face_handle(longest);
    const Face f1 = mesh_.face_handle(mesh_.opposite_halfedge_handle(longest));
    mesh_.flip(e);
    to_look_at_.push_back(f0);
    to_look_at_.push_back(f1);
    return true;
}

bool Snapper::open(Face f) {
    HalfEdge longest = mesh_.halfedge_handle(f);
    const auto squared = [&](HalfEdge h) {
        return (mesh_.point(mesh_.to_vertex_handle(h)) - mesh_.point(mesh_.from_vertex_handle(h)))
            .sqrnorm();
    };
    for (const HalfEdge h : mesh_.fh_range(f))
        if (squared(h) > squared(longest))
            longest = h;
    if (flip_longest(longest))
        return true;
    const HalfEdge to_m = mesh_.next_halfedge_handle(longest);
    const HalfEdge from_m = mesh_.next_halfedge_handle(to_m);
    const HalfEdge to_b = mesh_.opposite_halfedge_handle(to_m);
    for (const Care care : {Care::keep_side, Care::keep_area})
        for (const HalfEdge h : {from_m, to_b})
            if (collapse(h, care))
                return true;
    return move(mesh_.from_vertex_handle(from_m)) || move(mesh_.from_vertex_handle(longest)) ||
           move(mesh_.to_vertex_handle(longest));
}

void Snapper::open_flat_faces() {
    for (const Face f : mesh_.faces())
        to_look_at_.push_back(f);
    std::size_t n_left = 10 * mesh_.n_faces() + 1000; // far more than any fine enough grid needs
    for (; !to_look_at_.empty(); to_look_at_.pop_front()) {
        const Face f = to_look_at_.front();
        if (mesh_.status(f).deleted() || !is_zero(face_normal(f)))
            continue;
        if (n_left-- == 0 || !open(f))
            give_up("face " + std::to_string(f.idx()) + " keeps no area");
    }
}

SnapResult Snapper::result() const {
    SnapResult result;
    TriMesh placed = input_;
    double farthest = max_collapse_;
    for (const Vertex v : mesh_.vertices()) {
        if (mesh_.status(v).deleted() || mesh_.is_isolated(v))
            continue;
        const Point& q = mesh_.point(v);
        placed.positions[static_cast<std::size_t>(v.idx())] =
            grid_.origin + Vec3{q[0], q[1], q[2]} * grid_.step_m;
        farthest = std::max(farthest, (lattice(v.idx()) - q).norm());
    }
    result.mesh = from_half_edges(mesh_, placed);
    result.n_collapsed = n_collapsed_;
    result.n_moved = n_moved_;
    result.max_move_m = farthest * grid_.step_m;
    return result;
}

} // namespace

SnapResult snap_to_grid(const TriMesh& mesh, const PositionGrid& grid) {
    Snapper snapper(mesh, grid);
    snapper.separate_vertices();
    snapper.open_flat_faces();
    return snapper.result();
}

} // namespace taihu
