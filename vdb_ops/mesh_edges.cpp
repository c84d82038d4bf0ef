#include "vdb_ops/mesh_edges_detail.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <tuple>

#include <tbb/parallel_for.h>

namespace taihu {

using Index = std::uint32_t;

std::vector<Index> weld(const std::vector<Vec3>& points, double tolerance, std::vector<Vec3>& out) {
    const auto key = [tolerance](const Vec3& p) {
        return tolerance > 0 ? Vec3{std::floor(p.x / tolerance), std::floor(p.y / tolerance),
                                    std::floor(p.z / tolerance)}
                             : p + Vec3{}; // -0 becomes 0
    };
    const auto hash = [](const Vec3& p) {
        std::uint64_t h = 0;
        for (int axis = 0; axis < 3; ++axis)
            h = (h ^ std::bit_cast<std::uint64_t>(p[axis] + 0.0)) * 0x9E3779B97F4A7C15ull,
            h ^= h >> 32;
        return h;
    };
    const std::size_t capacity = std::bit_ceil(2 * points.size() + 16);
    std::vector<Index> slots(capacity, kNoVertex), id(points.size(), kNoVertex);
    const auto find = [&](const Vec3& cell, const Vec3& p) {
        for (std::size_t s = hash(cell) & (capacity - 1); slots[s] != kNoVertex;
             s = (s + 1) & (capacity - 1)) {
            const Vec3& q = out[slots[s]];
            if (tolerance > 0 ? key(q) == cell && length(q - p) <= tolerance : q == p)
                return slots[s];
        }
        return kNoVertex;
    };
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Vec3 p = points[i] + Vec3{}, cell = key(p);
        if (!is_finite(p))
            continue; // faces that use it are dropped
        Index found = kNoVertex;
        for (int n = 0; n < (tolerance > 0 ? 27 : 1) && found == kNoVertex; ++n)
            found = find(tolerance > 0 ? cell + Vec3{double(n % 3 - 1), double(n / 3 % 3 - 1),
                                                     double(n / 9 - 1)}
                                       : p,
                         p);
        if (found == kNoVertex) {
            found = static_cast<Index>(out.size());
            out.push_back(p);
            std::size_t s = hash(tolerance > 0 ? cell : p) & (capacity - 1);
            while (slots[s] != kNoVertex)
                s = (s + 1) & (capacity - 1);
            slots[s] = found;
        }
        id[i] = found;
    }
    return id;
}

std::vector<HalfEdge> sorted_halves(const std::vector<Triangle>& faces, std::size_t n_vertices) {
    std::vector<Index> first(n_vertices + 1, 0);
    const auto each = [&](auto&& fn) {
        for (Index f = 0; f < faces.size(); ++f)
            for (int k = 0; k < 3; ++k) {
                const Index a = faces[f][static_cast<std::size_t>(k)];
                const Index b = faces[f][static_cast<std::size_t>((k + 1) % 3)];
                fn(HalfEdge{std::min(a, b), std::max(a, b), f, a < b ? 1 : -1});
            }
    };
    each([&](const HalfEdge& h) { ++first[h.low + 1]; });
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<HalfEdge> halves(3 * faces.size());
    std::vector<Index> next(first.begin(), first.end() - 1);
    each([&](const HalfEdge& h) { halves[next[h.low]++] = h; });
    tbb::parallel_for(std::size_t{0}, n_vertices, [&](std::size_t v) {
        std::sort(halves.begin() + first[v], halves.begin() + first[v + 1],
                  [](const HalfEdge& a, const HalfEdge& b) {
                      return std::tie(a.high, a.face) < std::tie(b.high, b.face);
                  });
    });
    return halves;
}

} // namespace taihu
