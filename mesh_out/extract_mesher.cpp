#include "mesh_out/extract_mesher_detail.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace taihu {

std::vector<std::uint32_t> Mesher::run() {
    next_.assign(surface_.n_vertices(), kNone);
    find_crossings();
    list_polygons();
    place();
    // Cells on both sides of a fin take the same stretch of its rim, and several one corner.
    Vertices all(polygons_.size());
    std::iota(all.begin(), all.end(), 0u);
    if (join_near(all, kTwins_vox * points_.voxel_m(), 2))
        list_polygons();
    split_all();
    return retreat();
}

LabelledMesh Mesher::take() {
    Vertices number(mesh_.positions.size(), 0);
    for (const std::uint32_t w : next_)
        if (w != kNone)
            number[w] = kNone;
    std::uint32_t n = 0;
    for (std::size_t v = 0; v < number.size(); ++v)
        if (number[v] != kNone) {
            mesh_.positions[n] = mesh_.positions[v];
            mesh_.labels[n] = mesh_.labels[v];
            number[v] = n++;
        }
    mesh_.positions.resize(n);
    mesh_.labels.resize(n);
    for (Triangle& t : mesh_.triangles)
        for (std::uint32_t& v : t)
            v = number[v];
    return std::move(mesh_);
}

std::vector<std::uint8_t> Mesher::owned_by(const openvdb::CoordBBox& box) const {
    std::vector<std::uint8_t> owned(first_triangle_.back());
    for (std::size_t i = 0; i < polygons_.size(); ++i) {
        const auto& edge = surface_.edges()[i];
        if (box.isInside(blocks_[edge.block].origin + CellBlocks::local(edge.key % 512)))
            std::fill(owned.begin() + first_triangle_[i], owned.begin() + first_triangle_[i + 1],
                      1);
    }
    return owned;
}

void Mesher::find_crossings() {
    const auto& edges = surface_.edges();
    crossings_.resize(edges.size());
    each(edges.size(), [&](const SurfacePoints& points, std::size_t i) {
        crossings_[i] =
            points.on_edge(blocks_[edges[i].block].origin + CellBlocks::local(edges[i].key % 512),
                           edges[i].key / 512);
    });
}

void Mesher::list_polygons() {
    first_.assign(surface_.n_vertices() + 1, 0);
    for (const DualPolygon& p : polygons_)
        for (std::size_t k = 0; k < p.n; ++k)
            ++first_[p.vertices[k] + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    around_.resize(first_.back());
    Vertices next(first_.begin(), first_.end() - 1);
    for (std::uint32_t i = 0; i < polygons_.size(); ++i)
        for (std::size_t k = 0; k < polygons_[i].n; ++k)
            around_[next[polygons_[i].vertices[k]]++] = i;
}

void Mesher::place() {
    mesh_.positions.resize(surface_.n_vertices());
    mesh_.labels.resize(surface_.n_vertices());
    stage_.assign(surface_.n_vertices(), 0);
    each(surface_.n_vertices(), [&](const SurfacePoints& points, std::size_t v) {
        if (around(v).empty()) // where a part of a solid ends
            return;
        const auto placed =
            points.place(crossings_of(v), cell_box(v), kSlack_vox * points.voxel_m());
        mesh_.positions[v] = placed.point;
        mesh_.labels[v] = placed.labels;
    });
}

void Mesher::split_all() {
    first_triangle_.assign(polygons_.size() + 1, 0);
    for (std::size_t i = 0; i < polygons_.size(); ++i)
        first_triangle_[i + 1] =
            first_triangle_[i] + std::max<std::uint32_t>(polygons_[i].n, 2) - 2;
    mesh_.triangles.resize(first_triangle_.back());
    each(polygons_.size(), [&](const SurfacePoints& points, std::size_t i) { split(points, i); });
}

/// Good until the same thread asks again.
std::span<const Crossing> Mesher::crossings_of(std::size_t v) const {
    thread_local std::vector<Crossing> all;
    all.clear();
    for (const std::uint32_t polygon : around(v))
        all.push_back(crossings_[polygon]);
    return all;
}

Box Mesher::cell_box(std::size_t v) const {
    Box box;
    for (std::size_t w = v; w != kNone; w = next_[w]) {
        const CellRef& cell = surface_.cell(w);
        const auto at = blocks_[cell.block].origin + CellBlocks::local(cell.first);
        box.include(points_.voxel(at));
        box.include(points_.voxel(at.offsetBy(cell.size)));
    }
    return box;
}

void Mesher::split(const SurfacePoints& points, std::size_t i) {
    const auto& [v, n] = polygons_[i];
    if (n < 3)
        return;
    const bool first = n == 3 || along_first(points, v, crossings_[i].normal);
    Triangle* out = &mesh_.triangles[first_triangle_[i]];
    out[0] = first ? Triangle{v[0], v[1], v[2]} : Triangle{v[1], v[2], v[3]};
    if (n == 4)
        out[1] = first ? Triangle{v[0], v[2], v[3]} : Triangle{v[1], v[3], v[0]};
}

/// Whether to split a quad from its first corner to the third: along a rim, or so that its
/// triangles face as the surface does; none of them may turn over.
/// \param normal  of the surface where the quad stands across an edge, or 0.
bool Mesher::along_first(const SurfacePoints& points, const std::array<std::uint32_t, 4>& v,
                         const Vec3& normal) const {
    const auto& l = mesh_.labels;
    const Vec3 a = mesh_.positions[v[0]], b = mesh_.positions[v[1]], c = mesh_.positions[v[2]],
               d = mesh_.positions[v[3]];
    // The smaller cosine to `n` of the triangles pqr and prs.
    const auto least = [](const Vec3& p, const Vec3& q, const Vec3& r, const Vec3& s,
                          const Vec3& n) {
        const Vec3 x = cross(q - p, r - p), y = cross(r - p, s - p);
        return std::min(dot(x, n) / std::max(length(x), 1e-300),
                        dot(y, n) / std::max(length(y), 1e-300));
    };
    // Three corners along one rim make no triangle worth the name.
    const auto flatness = [](const Vec3& p, const Vec3& q, const Vec3& r) {
        return length(cross(q - p, r - p)) / std::max({length_squared(q - p), length_squared(r - q),
                                                       length_squared(p - r), 1e-300});
    };
    const double wide = std::min(flatness(a, b, c), flatness(a, c, d)),
                 wide_across = std::min(flatness(b, c, d), flatness(b, d, a));
    constexpr double kWide = 0.05, kUpright = 0.1;
    if (std::min(wide, wide_across) < kWide && wide != wide_across)
        return wide > wide_across;
    const Vec3 whole = normalized(cross(c - a, d - b));
    const double first = least(a, b, c, d, whole), second = least(b, c, d, a, whole);
    if (std::min(first, second) < kUpright && first != second)
        return first > second;
    const bool on_rim =
        l[v[0]].size() != 1 || !(l[v[0]] == l[v[1]] && l[v[1]] == l[v[2]] && l[v[2]] == l[v[3]]);
    if (on_rim) {
        const double voxel = points.voxel_m();
        const auto off = [&](const Vec3& p, const Vec3& q, const PrimitiveSet& common) {
            const double favour = common.size() > 1 ? -0.05 : common.empty() ? 10 : 0;
            return std::fabs(points.field().at((p + q) * 0.5).value_m) + 1e-3 * length(p - q) +
                   favour * voxel;
        };
        return off(a, c, l[v[0]].common(l[v[2]])) <= off(b, d, l[v[1]].common(l[v[3]]));
    }
    const double along = least(a, b, c, d, normal), across = least(b, c, d, a, normal);
    constexpr double kAlike = 1e-6; // of cosines
    return std::fabs(along - across) > kAlike ? along > across : length(c - a) <= length(d - b);
}

} // namespace taihu
