#include "vdb_ops/leaf_lists_detail.h"

#include <algorithm>
#include <iterator>

#include <tbb/parallel_sort.h>

#include "vdb_ops/mesh_cells_detail.h"

namespace taihu {

using openvdb::Coord;
constexpr int kLeaf = 8;

LeafKey leaf_key(const Coord& c) {
    const auto part = [](int v) { return static_cast<LeafKey>(v + kFarthestLeaf) & 0x1fffff; };
    return part(c.x()) << 42 | part(c.y()) << 21 | part(c.z());
}

Coord leaf_of_key(LeafKey key) {
    const auto part = [key](int shift) {
        return static_cast<int>(key >> shift & 0x1fffff) - kFarthestLeaf;
    };
    return {part(42), part(21), part(0)};
}

LeafLists::LeafLists(const std::vector<LeafTriangle>& triangles, float half_width) {
    constexpr std::size_t kChunk = 256;
    std::vector<std::vector<std::pair<LeafKey, std::uint32_t>>> found(
        (triangles.size() + kChunk - 1) / kChunk);
    const Coord first(-kFarthestLeaf / kLeaf), n(2 * kFarthestLeaf / kLeaf);
    tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t chunk) {
        for (std::size_t t = chunk * kChunk; t < std::min(triangles.size(), (chunk + 1) * kChunk);
             ++t)
            each_cell(triangles[t], kLeaf, first, n, half_width, [&](int i, int j, int k) {
                const Coord leaf = Coord(i, j, k).offsetBy(first.x()) << 3;
                found[chunk].push_back({leaf_key(leaf), static_cast<std::uint32_t>(t)});
            });
    });
    std::vector<std::pair<LeafKey, std::uint32_t>> all;
    for (auto& part : found) {
        all.insert(all.end(), part.begin(), part.end());
        part = {};
    }
    tbb::parallel_sort(all.begin(), all.end());
    for (const auto& [key, triangle] : all) {
        if (keys_.empty() || keys_.back() != key) {
            keys_.push_back(key);
            first_.push_back(triangles_.size());
        }
        triangles_.push_back(triangle);
    }
    first_.push_back(triangles_.size());
}

void LeafLists::nearer(const std::vector<LeafTriangle>& triangles, const Coord& leaf,
                       float half_width, float* squared) const {
    const LeafKey key = leaf_key(leaf);
    const auto at = std::lower_bound(keys_.begin(), keys_.end(), key);
    if (at == keys_.end() || *at != key)
        return;
    const auto i = static_cast<std::size_t>(at - keys_.begin());
    min_triangles(triangles.data(), triangles_.data() + first_[i],
                  triangles_.data() + first_[i + 1], leaf.data(), half_width, nullptr, squared);
}

std::vector<LeafKey> both(const std::vector<LeafKey>& a, const std::vector<LeafKey>& b) {
    std::vector<LeafKey> out;
    std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(out));
    return out;
}

} // namespace taihu
