#include "mesh_out/extract_mesher_detail.h"

#include <algorithm>
#include <array>
#include <unordered_set>
#include <utility>

namespace taihu {
namespace {

std::uint64_t mixed(std::uint64_t x) {
    x = (x ^ (x >> 32)) * 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 29)) * 0xbf58476d1ce4e5b9u;
    return x ^ (x >> 32);
}

/// A polygon after `w` has become `v`; that of opposite corners is no more.
DualPolygon joined(const DualPolygon& before, std::uint32_t v, std::uint32_t w) {
    DualPolygon after;
    after.n = 0;
    const auto& all = before.vertices;
    for (std::size_t k = 0; k < 2 && before.n == 4; ++k)
        if (std::minmax(all[k], all[k + 2]) == std::minmax(v, w))
            return {{v, all[k + 1], 0, 0}, 2};
    for (std::size_t k = 0; k < before.n; ++k) {
        const std::uint32_t x = all[k] == w ? v : all[k];
        const auto end = after.vertices.begin() + after.n;
        if (std::find(after.vertices.begin(), end, x) == end)
            after.vertices[after.n++] = x;
    }
    return after;
}

/// Whether polygons around `v` stay a disk however they are split: each neighbour is beside two of
/// them, and those across them are all others.
bool is_disk(std::span<const DualPolygon> polygons, std::uint32_t v) {
    std::vector<std::uint32_t> beside, across;
    std::size_t n = 0;
    for (const DualPolygon& p : polygons) {
        if (p.n < 3)
            continue;
        ++n;
        const auto k = static_cast<std::size_t>(
            std::find(p.vertices.begin(), p.vertices.begin() + p.n, v) - p.vertices.begin());
        beside.push_back(p.vertices[(k + 1) % p.n]);
        beside.push_back(p.vertices[(k + p.n - 1u) % p.n]);
        if (p.n == 4)
            across.push_back(p.vertices[(k + 2) % 4]);
    }
    std::sort(beside.begin(), beside.end());
    std::sort(across.begin(), across.end());
    if (n < 3 || std::adjacent_find(across.begin(), across.end()) != across.end())
        return false;
    for (std::size_t k = 0; k < beside.size(); k += 2)
        if (beside[k] != beside[k + 1] || (k > 0 && beside[k] == beside[k - 1]) ||
            std::binary_search(across.begin(), across.end(), beside[k]))
            return false;
    return true;
}

} // namespace

/// Joins vertices of the polygons that are so near each other, those on rims to others of the same
/// rim or a corner of it; with `least_labels` 1 those on faces, too. In an order as good as random,
/// so that what becomes of two depends on few others, however long a row of such there is.
/// \return whether there were any; then the lists are to be made anew.
bool Mesher::join_near(std::span<const std::uint32_t> polygons, double near_m,
                       std::size_t least_labels) {
    bool any = false;
    const bool of_part = !certainty_.is_of_all();
    std::unordered_set<std::uint32_t> uncertain; // polygons
    std::vector<Box> boxes;
    for (const Near& pair : near_pairs(polygons, near_m, least_labels)) {
        std::uint32_t v = now(pair.v), w = now(pair.w);
        const Vertices around = around_both(v, w);
        if (of_part) {
            const Box box = reach(std::array{pair.v, pair.w});
            if (!certainty_.holds(box) ||
                std::any_of(around.begin(), around.end(),
                            [&](std::uint32_t i) { return uncertain.contains(i); })) {
                uncertain.insert(around.begin(), around.end());
                boxes.push_back(box);
            }
        }
        if (v != w && are_near(v, w, near_m, least_labels))
            any = join(v, w, around) || any;
    }
    certainty_.lose(boxes);
    return any;
}

/// Those that are near each other, or may be once one of them has moved by half of that.
std::vector<Mesher::Near> Mesher::near_pairs(std::span<const std::uint32_t> polygons, double near_m,
                                             std::size_t least_labels) const {
    std::vector<Near> pairs;
    for (const std::uint32_t number : polygons) {
        const DualPolygon& p = polygons_[number];
        for (std::size_t i = 0; i < p.n; ++i)
            for (std::size_t k = i + 1; k < p.n; ++k)
                if (std::uint32_t v = p.vertices[i], w = p.vertices[k];
                    are_near(v, w, 1.5 * near_m, least_labels))
                    pairs.push_back({mixed(3 * cell_key(v) + cell_key(w)), v, w});
    }
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    return pairs;
}

/// A number for the place of its cell.
std::uint64_t Mesher::cell_key(std::uint32_t v) const {
    const CellRef& cell = surface_.cell(v);
    const auto at = blocks_[cell.block].origin + CellBlocks::local(cell.first);
    std::uint64_t key = 0;
    for (int axis = 0; axis < 3; ++axis)
        key = mixed(key ^ static_cast<std::uint32_t>(at[axis]));
    return key;
}

/// What a vertex has become.
std::uint32_t Mesher::now(std::uint32_t v) const {
    for (auto at = became_.find(v); at != became_.end(); at = became_.find(v))
        v = at->second;
    return v;
}

/// The polygons around two vertices and all that became these.
Mesher::Vertices Mesher::around_both(std::uint32_t v, std::uint32_t w) const {
    Vertices all;
    for (const std::uint32_t end : {v, w})
        for (std::uint32_t x = end; x != kNone; x = next_[x])
            all.insert(all.end(), around(x).begin(), around(x).end());
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
}

/// Whether they are to be joined; v is the one to stay then.
bool Mesher::are_near(std::uint32_t& v, std::uint32_t& w, double near_m,
                      std::size_t least_labels) const {
    const auto& labels = mesh_.labels;
    if (std::pair(labels[w].size(), v) > std::pair(labels[v].size(), w))
        std::swap(v, w);
    return labels[w].size() >= least_labels && labels[w].within(labels[v]) &&
           length_squared(mesh_.positions[v] - mesh_.positions[w]) < near_m * near_m;
}

/// Makes `w` the vertex `v`, if the surface stays what it is. \param all  as around_both().
bool Mesher::join(std::uint32_t v, std::uint32_t w, const Vertices& all) {
    if (!may_move(v) || !may_move(w))
        return false;
    for (const std::uint32_t end : {v, w})
        if (apart_.contains(small_cell(surface_.cell(end), 2)))
            return false;
    const auto has_both = [&](std::uint32_t i) {
        const auto& [vertices, n] = polygons_[i];
        const auto end = vertices.begin() + n;
        return std::find(vertices.begin(), end, v) != end &&
               std::find(vertices.begin(), end, w) != end;
    };
    if (std::none_of(all.begin(), all.end(), has_both))
        return false;
    std::vector<DualPolygon> after;
    for (const std::uint32_t i : all)
        after.push_back(joined(polygons_[i], v, w));
    if (!is_disk(after, v))
        return false;
    if (mesh_.labels[v] == mesh_.labels[w]) {
        const auto middle =
            onto(points_.field(), mesh_.labels[v], (mesh_.positions[v] + mesh_.positions[w]) * 0.5,
                 points_.voxel_m());
        if (!middle || !points_.is_on(*middle))
            return false;
        mesh_.positions[v] = *middle;
    }
    for (std::size_t k = 0; k < all.size(); ++k)
        polygons_[all[k]] = after[k];
    std::uint32_t last = v;
    while (next_[last] != kNone)
        last = next_[last];
    next_[last] = w;
    became_[w] = v;
    return true;
}

} // namespace taihu
