#include "mesh_out/extract_mesher_detail.h"

#include <algorithm>
#include <array>
#include <tuple>
#include <unordered_set>

#include <tbb/parallel_for.h>

#include "mesh_out/cell_loops_detail.h"
#include "mesh_out/crossings_detail.h"

namespace taihu {
namespace {

/// Vertices of two sheets, in voxels: so that rounding does not bring them together.
constexpr double kLeastApart_vox = 0.02;
/// Areas and lengths of triangles that cannot cross others, in voxels.
constexpr double kLeast = 1e-3;

void make_set(std::vector<std::uint32_t>& all) {
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
}

} // namespace

/// Moves vertices until no triangles cross: along their rims and faces to between their neighbours;
/// then those of what still crosses become one where they are near each other; at last they go back
/// towards the middle of their cells. Those of cells that cannot be helped so are returned.
Mesher::Vertices Mesher::retreat() {
    constexpr int kMostRounds = 16;
    Vertices hit = in_trouble(untamed(), true);
    hold_others(hit);
    hit = relax(std::move(hit));
    const Vertices polygons = polygons_around(hit), vertices = vertices_of(polygons);
    if (join_near(polygons, points_.voxel_m(), 1)) {
        list_polygons();
        split_all();
    }
    hit = relax(in_trouble(split_around(vertices), true));
    std::vector<std::uint8_t> picked = split_around(hit);
    for (int round = 0; round < kMostRounds && !hit.empty(); ++round) {
        hit = in_trouble(picked, false);
        if (std::all_of(hit.begin(), hit.end(),
                        [&](std::uint32_t v) { return stage_[v] >= kLastStage; }))
            break;
        each(hit.size(),
             [&](const SurfacePoints& points, std::size_t i) { step_back(points, hit[i]); });
        picked = split_around(hit);
    }
    return hit;
}

/// From now on only vertices around troubled ones may move.
void Mesher::hold_others(std::span<const std::uint32_t> hit) {
    movable_.assign(mesh_.positions.size(), 0);
    const Vertices polygons = polygons_around(hit);
    for (const std::uint32_t v : vertices_of(polygons))
        movable_[v] = 1;
    for (const std::uint32_t i : near_to(flags_of(polygons)))
        for (std::size_t k = 0; k < polygons_[i].n; ++k)
            if (const std::uint32_t v = polygons_[i].vertices[k]; movable_[v] || !is_alone(v))
                crowded_.push_back(v);
    make_set(crowded_);
    if (certainty_.is_of_all())
        return;
    std::vector<Box> boxes;
    for (const std::uint32_t v : hit)
        boxes.push_back(reach(vertices_of(polygons_around({&v, 1}))));
    certainty_.decided(boxes);
}

/// \return what is in trouble still.
Mesher::Vertices Mesher::relax(Vertices hit) {
    constexpr int kRounds = 3;
    for (int round = 0; round < kRounds && !hit.empty(); ++round) {
        // From the second time on with those around: they alone were not enough.
        Vertices moving = round > 0 ? vertices_of(polygons_around(hit)) : hit;
        std::erase_if(moving, [&](std::uint32_t v) { return !may_move(v); });
        std::vector<Vec3> to(moving.size());
        each(moving.size(), [&](const SurfacePoints& points, std::size_t i) {
            to[i] = relaxed(points, moving[i]);
        });
        for (std::size_t i = 0; i < moving.size(); ++i)
            mesh_.positions[moving[i]] = to[i];
        hit = in_trouble(split_around(moving), true);
    }
    return hit;
}

/// A place between its neighbours on the same face or rim.
Vec3 Mesher::relaxed(const SurfacePoints& points, std::uint32_t v) const {
    const Vec3 p = mesh_.positions[v];
    const PrimitiveSet& own = mesh_.labels[v];
    Vec3 sum;
    double n = 0;
    for (const std::uint32_t i : around(v))
        for (std::size_t k = 0; k < polygons_[i].n; ++k) {
            const std::uint32_t w = polygons_[i].vertices[k];
            if (w != v && own.within(mesh_.labels[w])) {
                sum += mesh_.positions[w];
                ++n;
            }
        }
    if (own.empty() || own.size() == PrimitiveSet::kMost || n == 0)
        return p;
    const auto to = onto(points.field(), own, sum / n, 2 * points.voxel_m());
    const Box about = cell_box(v).dilated(kFarthest_vox * points.voxel_m());
    return to && about.contains(*to) && points.is_on(*to) ? *to : p;
}

Mesher::Vertices Mesher::polygons_around(std::span<const std::uint32_t> vertices) const {
    Vertices polygons;
    for (const std::uint32_t v : vertices)
        polygons.insert(polygons.end(), around(v).begin(), around(v).end());
    make_set(polygons);
    return polygons;
}

Mesher::Vertices Mesher::vertices_of(std::span<const std::uint32_t> polygons) const {
    Vertices vertices;
    for (const std::uint32_t i : polygons)
        vertices.insert(vertices.end(), polygons_[i].vertices.begin(),
                        polygons_[i].vertices.begin() + polygons_[i].n);
    make_set(vertices);
    return vertices;
}

/// Where the triangles around vertices are, wherever these may move.
Box Mesher::reach(std::span<const std::uint32_t> vertices) const {
    Box box;
    for (const std::uint32_t v : vertices_of(polygons_around(vertices))) {
        const Box cell = cell_box(v);
        box.include(cell.lo);
        box.include(cell.hi);
    }
    return box.dilated(kFarthest_vox * points_.voxel_m());
}

/// Splits the polygons of vertices that moved, and picks them.
std::vector<std::uint8_t> Mesher::split_around(std::span<const std::uint32_t> vertices) {
    const Vertices polygons = polygons_around(vertices);
    each(polygons.size(),
         [&](const SurfacePoints& points, std::size_t i) { split(points, polygons[i]); });
    return flags_of(polygons);
}

std::vector<std::uint8_t> Mesher::flags_of(std::span<const std::uint32_t> polygons) const {
    std::vector<std::uint8_t> flags(polygons_.size());
    for (const std::uint32_t i : polygons)
        flags[i] = 1;
    return flags;
}

/// Polygons that may cross others.
///
/// Take a polygon that winds around its edge between two voxels, and the tetrahedra of that edge
/// with each side of it. It lies in these when the planes of its triangles meet the edge between
/// its ends. Where a cell has one vertex inside of it, which joins to those of its neighbours
/// through the faces between them, the tetrahedra of all edges part space: such polygons never
/// cross each other. After Ju and Udeshi 2006, "Intersection-free contouring on an octree grid"
/// (from memory, unchecked; the test of planes is our own).
std::vector<std::uint8_t> Mesher::untamed() const {
    std::vector<std::uint8_t> tame(mesh_.positions.size()), wild(polygons_.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, tame.size(), 1024), [&](const auto& r) {
        for (std::size_t v = r.begin(); v < r.end(); ++v) {
            const CellRef& cell = surface_.cell(v);
            tame[v] =
                next_[v] == kNone && has_own_cell(static_cast<std::uint32_t>(v)) &&
                cell_box(v).dilated(-kLeast * points_.voxel_m()).contains(mesh_.positions[v]) &&
                alternating_faces(
                    blocks_[cell.block].corners(CellBlocks::local(cell.first), cell.size)) == 0;
        }
    });
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, wild.size(), 1024), [&](const auto& r) {
        for (std::size_t i = r.begin(); i < r.end(); ++i)
            wild[i] = !std::all_of(polygons_[i].vertices.begin(),
                                   polygons_[i].vertices.begin() + polygons_[i].n,
                                   [&](std::uint32_t v) { return tame[v] != 0; }) ||
                      !is_tame(i);
    });
    return wild;
}

bool Mesher::is_tame(std::size_t polygon) const {
    const auto& edge = surface_.edges()[polygon];
    const auto& [vertices, n] = polygons_[polygon];
    int size = 4; // of the smallest cell around: the edge is as long
    for (std::size_t k = 0; k < n; ++k)
        size = std::min<int>(size, surface_.cell(vertices[k]).size);
    const int axis = edge.key / 512, b = (axis + 1) % 3, c = (axis + 2) % 3;
    auto first = CellBlocks::local(edge.key % 512);
    const double h = points_.voxel_m(), turn = blocks_[edge.block].in(first) ? 1 : -1;
    first[axis] &= -size;
    const Vec3 from = points_.voxel(blocks_[edge.block].origin + first);
    const auto area = [&](std::uint32_t v, std::uint32_t w) {
        const Vec3 p = mesh_.positions[v] - from, q = mesh_.positions[w] - from;
        return turn * (p[b] * q[c] - p[c] * q[b]);
    };
    for (std::size_t k = 0; k < n; ++k) {
        const std::uint32_t v = vertices[k], w = vertices[(k + 1) % n];
        if (!(area(v, w) > kLeast * h * h))
            return false;
        const Box one = cell_box(v), other = cell_box(w);
        if (surface_.cell(v).size == surface_.cell(w).size)
            continue;
        const Box face{max(one.lo, other.lo), min(one.hi, other.hi)};
        const Vec3 p = mesh_.positions[v], way = mesh_.positions[w] - p;
        const int a = face.lo.x == face.hi.x ? 0 : face.lo.y == face.hi.y ? 1 : 2;
        const Vec3 at = p + way * ((face.lo[a] - p[a]) / way[a]);
        for (const int side : {(a + 1) % 3, (a + 2) % 3})
            if (!(at[side] > face.lo[side] + kLeast * h && at[side] < face.hi[side] - kLeast * h))
                return false;
    }
    for (auto t = first_triangle_[polygon]; t < first_triangle_[polygon + 1]; ++t) {
        const auto& [u, v, w] = mesh_.triangles[t];
        const double at_u = area(v, w), at_v = area(w, u), at_w = area(u, v),
                     all = at_u + at_v + at_w;
        const auto along = [&](std::uint32_t x) { return mesh_.positions[x][axis] - from[axis]; };
        const double meets = (at_u * along(u) + at_v * along(v) + at_w * along(w)) / all;
        if (!(all > kLeast * h * h && meets > kLeast * h && meets < (size - kLeast) * h))
            return false;
    }
    return true;
}

/// Aside of a rim, first, as little is often enough. Then into the cell, if it is outside; off the
/// rim; to the middle of the crossings.
void Mesher::step_back(const SurfacePoints& points, std::uint32_t v) {
    static constexpr std::array<double, 3> kAside = {0.05, 0.2, 0.6}; // of the way to the crossings
    const Box cell = cell_box(v);
    const auto crossings = crossings_of(v);
    const LabelledPoint start = points.place(crossings, cell, kSlack_vox * points.voxel_m());
    std::optional<LabelledPoint> to;
    while (!to) {
        const std::uint8_t stage = stage_[v]++;
        if (stage < kOutside - 1)
            to = points.aside(start, crossings, stage % 2, kAside[stage / 2]);
        else if (stage == kOutside - 1 && !cell.contains(start.point))
            to = points.back_in(start, cell);
        else if (stage == kOutside && start.labels.size() > 1)
            to = points.on_face(mean_of(crossings), cell);
        else if (stage > kOutside) {
            stage_[v] = kLastStage;
            to = LabelledPoint{mean_of(crossings), points.label(mean_of(crossings))};
        }
    }
    mesh_.positions[v] = to->point;
    mesh_.labels[v] = to->labels;
}

/// The vertices to move of picked polygons' triangles that cross others, have no area, or two
/// vertices in one place. \param all  not only those outside of their cells.
Mesher::Vertices Mesher::in_trouble(const std::vector<std::uint8_t>& picked, bool all) const {
    Vertices hit;
    if (!movable_.empty() && std::find(picked.begin(), picked.end(), 1) == picked.end())
        return hit;
    for (std::size_t i = 0; i < picked.size(); ++i)
        for (auto t = first_triangle_[i]; picked[i] && t < first_triangle_[i + 1]; ++t)
            if (is_needle(mesh_.triangles[t]))
                add_movable({&mesh_.triangles[t], 1}, all, hit);
    std::vector<Triangle> faces;
    std::vector<std::uint8_t> of_picked;
    for (const std::uint32_t i : near_to(picked))
        for (auto t = first_triangle_[i]; t < first_triangle_[i + 1]; ++t) {
            faces.push_back(mesh_.triangles[t]);
            of_picked.push_back(picked[i]);
        }
    for (const auto& pair : crossing_pairs(mesh_.positions, faces, of_picked))
        add_movable(std::array{faces[pair.first], faces[pair.second]}, all, hit);
    add_in_one_place(movable_.empty() ? all_not_alone() : crowded_, hit);
    make_set(hit);
    return hit;
}

/// The polygons that may reach picked ones: they and these are within 6 voxels of their edges.
Mesher::Vertices Mesher::near_to(const std::vector<std::uint8_t>& picked) const {
    const auto& edges = surface_.edges();
    const auto coarse = [&](std::size_t polygon) {
        const openvdb::Coord& c = blocks_[edges[polygon].block].origin;
        return openvdb::Coord(c.x() >> 4, c.y() >> 4, c.z() >> 4);
    };
    std::unordered_set<openvdb::Coord> close;
    std::uint32_t last = kNone; // polygons come block by block
    for (std::size_t i = 0; i < picked.size(); ++i)
        if (picked[i] && edges[i].block != last) {
            last = edges[i].block;
            for (int k = 0; k < 27; ++k)
                close.insert(coarse(i).offsetBy(k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1));
        }
    Vertices near;
    last = kNone;
    bool is_close = false;
    for (std::uint32_t i = 0; i < picked.size(); ++i) {
        if (edges[i].block != last) {
            last = edges[i].block;
            is_close = close.contains(coarse(i));
        }
        if (is_close)
            near.push_back(i);
    }
    return near;
}

void Mesher::add_movable(std::span<const Triangle> triangles, bool all, Vertices& hit) const {
    const auto add = [&](bool any) {
        const std::size_t before = hit.size();
        for (const Triangle& t : triangles)
            for (const std::uint32_t v : t)
                if (may_move(v) && (any || (stage_[v] < kOutside && !in_cell(v))))
                    hit.push_back(v);
        return hit.size() > before;
    };
    if (all || !add(false))
        add(true);
}

bool Mesher::is_needle(const Triangle& t) const {
    constexpr double kThin = 1e-5; // height over length
    const Vec3 ab = mesh_.positions[t[1]] - mesh_.positions[t[0]],
               ac = mesh_.positions[t[2]] - mesh_.positions[t[0]], bc = ac - ab;
    return length(cross(ab, ac)) <=
           kThin * std::max({length_squared(ab), length_squared(ac), length_squared(bc)});
}

/// Not so where sheets pass on both sides of a cell's middle, as through opposite corners.
bool Mesher::has_own_cell(std::uint32_t v) const {
    return (v == 0 || surface_.cell(v - 1) != surface_.cell(v)) &&
           (v + 1 == mesh_.positions.size() || surface_.cell(v + 1) != surface_.cell(v));
}

/// Most are, well in their cells.
bool Mesher::is_alone(std::uint32_t v) const {
    const double least_m = kLeastApart_vox * points_.voxel_m();
    return around(v).empty() ||
           (cell_box(v).dilated(-least_m).contains(mesh_.positions[v]) && has_own_cell(v));
}

Mesher::Vertices Mesher::all_not_alone() const {
    std::vector<std::uint8_t> alone(mesh_.positions.size());
    tbb::parallel_for(std::size_t{0}, alone.size(),
                      [&](std::size_t v) { alone[v] = is_alone(static_cast<std::uint32_t>(v)); });
    Vertices others;
    for (std::uint32_t v = 0; v < alone.size(); ++v)
        if (!alone[v])
            others.push_back(v);
    return others;
}

/// Adds those that have the place of another one and may move.
void Mesher::add_in_one_place(Vertices order, Vertices& hit) const {
    std::erase_if(order, [&](std::uint32_t v) { return around(v).empty(); });
    const double least_m = kLeastApart_vox * points_.voxel_m();
    const auto key = [&](std::uint32_t v) {
        const Vec3& p = mesh_.positions[v];
        return std::tuple(p.x, p.y, p.z, v);
    };
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
    for (std::size_t i = 0; i < order.size(); ++i) {
        const Vec3& p = mesh_.positions[order[i]];
        for (std::size_t k = i + 1; k < order.size(); ++k) {
            const Vec3& q = mesh_.positions[order[k]];
            if (q.x - p.x > least_m)
                break;
            if (p == q ||
                (length_squared(q - p) < least_m * least_m && !share_polygon(order[i], order[k])))
                for (const std::uint32_t v : {order[i], order[k]})
                    if (may_move(v))
                        hit.push_back(v);
        }
    }
}

bool Mesher::share_polygon(std::uint32_t v, std::uint32_t w) const {
    const auto of_w = around(w);
    return std::any_of(around(v).begin(), around(v).end(), [&](std::uint32_t polygon) {
        return std::find(of_w.begin(), of_w.end(), polygon) != of_w.end();
    });
}

} // namespace taihu
