#pragma once
#include <cstdint>
#include <vector>

#include "stats/core/tri_mesh.h"

namespace taihu {

inline constexpr std::uint32_t kNoVertex = ~std::uint32_t{0};

/// Positions welded when equal (tolerance 0) or when within the tolerance of an earlier one. Adds
/// those that remain to `out`; returns where each went, kNoVertex for one that is not finite.
std::vector<std::uint32_t> weld(const std::vector<Vec3>& points, double tolerance,
                                std::vector<Vec3>& out);

/// A face's use of an undirected edge.
struct HalfEdge {
    std::uint32_t low, high; ///< its two vertices
    std::uint32_t face;
    int direction; ///< +1 when the face runs from low to high
};

/// All halves, grouped by edge, faces ascending in each group.
std::vector<HalfEdge> sorted_halves(const std::vector<Triangle>& faces, std::size_t n_vertices);

/// Calls fn(begin, end) for the halves of each edge.
template <class Fn>
void each_edge(const std::vector<HalfEdge>& halves, Fn&& fn) {
    for (std::size_t i = 0, j = 0; i < halves.size(); i = j) {
        while (j < halves.size() && halves[j].low == halves[i].low &&
               halves[j].high == halves[i].high)
            ++j;
        fn(halves.data() + i, halves.data() + j);
    }
}

} // namespace taihu
