#include <algorithm>
#include <atomic>
#include <string>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "mesh_out/corner_table_detail.h"
#include "stats/core/error.h"

namespace taihu {
namespace {

/// The corners of each vertex, vertex by vertex.
struct Incidence {
    std::vector<std::uint32_t> first, corners;

    Incidence(std::size_t n_vertices, std::span<const std::uint32_t> vertices)
        : first(n_vertices + 1, 0), corners(vertices.size()) {
        for (const std::uint32_t v : vertices)
            ++first[v + 1];
        for (std::size_t v = 0; v < n_vertices; ++v)
            first[v + 1] += first[v];
        std::vector<std::uint32_t> at(first.begin(), first.end() - 1);
        for (std::uint32_t c = 0; c < vertices.size(); ++c)
            corners[at[vertices[c]]++] = c;
    }
    std::span<const std::uint32_t> of(std::size_t v) const {
        return std::span(corners).subspan(first[v], first[v + 1] - first[v]);
    }
};

} // namespace

CornerTable::CornerTable(std::size_t n_vertices, std::span<const Triangle> triangles,
                         const char* where)
    : corners_(n_vertices, kNone) {
    const auto refuse = [&] {
        throw Error(Fault::bad_argument,
                    std::string(where) + ": the mesh of " + std::to_string(triangles.size()) +
                        " triangles is not a closed 2-manifold; repair it first");
    };
    if (triangles.empty() || triangles.size() > kNone / 3 || n_vertices >= kNone)
        refuse();
    vertices_.reserve(3 * triangles.size());
    for (const Triangle& t : triangles) {
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0] ||
            std::max({t[0], t[1], t[2]}) >= n_vertices)
            refuse();
        vertices_.insert(vertices_.end(), t.begin(), t.end());
    }
    opposites_.assign(vertices_.size(), kNone);
    const Incidence incidence(n_vertices, vertices_);
    std::atomic<bool> broken{false};
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n_vertices, 4096), [&](const auto& range) {
        std::vector<std::uint32_t> to, from; // the other ends of the edges of each corner
        for (std::size_t v = range.begin(); v < range.end(); ++v) {
            const auto around = incidence.of(v);
            if (!around.empty())
                corners_[v] = around.front();
            to.clear();
            from.clear();
            for (const std::uint32_t c : around) {
                to.push_back(vertices_[next(c)]);
                from.push_back(vertices_[previous(c)]);
            }
            for (std::size_t i = 0; i < around.size(); ++i) {
                int n_out = 0, n_in = 0;
                std::size_t other = 0;
                for (std::size_t k = 0; k < around.size(); ++k) {
                    n_out += to[k] == to[i];
                    n_in += from[k] == to[i];
                    other = from[k] == to[i] ? k : other;
                }
                if (n_out != 1 || n_in != 1)
                    broken = true;
                else
                    opposites_[previous(around[i])] = next(around[other]);
            }
        }
    });
    if (broken)
        refuse();
    // One walk round each vertex must meet all of its corners.
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n_vertices, 4096), [&](const auto& range) {
        for (std::size_t v = range.begin(); v < range.end(); ++v) {
            std::size_t n = 0;
            if (corners_[v] != kNone)
                for (std::uint32_t c = corners_[v]; n == 0 || c != corners_[v]; c = swing(c))
                    ++n;
            if (n != incidence.of(v).size())
                broken = true;
        }
    });
    if (broken)
        refuse();
}

bool CornerTable::ring(std::uint32_t v, Ring& out) const {
    out.n = 0;
    std::uint32_t c = corners_[v];
    do {
        if (out.n == kMostCorners)
            return false;
        out.corners[out.n] = c;
        out.neighbours[out.n++] = vertices_[next(c)];
        c = swing(c);
    } while (c != corners_[v]);
    return true;
}

std::uint32_t CornerTable::collapsible(std::uint32_t a, std::uint32_t b, const Ring& ring_a,
                                       const Ring& ring_b) const {
    std::uint32_t edge = kNone;
    int n_common = 0;
    for (std::size_t i = 0; i < ring_a.n; ++i) {
        const std::uint32_t v = ring_a.neighbours[i];
        if (v == b)
            edge = ring_a.corners[i];
        for (std::size_t k = 0; k < ring_b.n; ++k)
            n_common += ring_b.neighbours[k] == v;
    }
    if (edge == kNone || n_common != 2)
        return kNone;
    const auto has_three = [&](std::uint32_t v) {
        const std::uint32_t c = corners_[v];
        return swing(swing(swing(c))) == c;
    };
    const std::uint32_t x = vertices_[previous(edge)], y = vertices_[opposites_[previous(edge)]];
    if (a == b || x == y || has_three(x) || has_three(y))
        return kNone;
    return edge;
}

void CornerTable::collapse(std::uint32_t c, const Ring& ring) {
    const std::uint32_t a = vertices_[c], b = vertices_[next(c)], d = opposites_[previous(c)];
    const std::uint32_t x = vertices_[previous(c)], y = vertices_[d];
    const std::uint32_t beyond_a = opposites_[next(c)], beyond_b = opposites_[c];
    const std::uint32_t below_a = opposites_[next(d)], below_b = opposites_[previous(d)];
    for (const std::uint32_t r : ring.all())
        vertices_[r] = b;
    link(beyond_b, beyond_a);
    link(below_a, below_b);
    corners_[x] = next(beyond_b);
    corners_[b] = previous(beyond_b);
    corners_[y] = previous(below_b);
    corners_[a] = kNone;
    for (std::uint32_t k = 0; k < 3; ++k)
        vertices_[c / 3 * 3 + k] = vertices_[d / 3 * 3 + k] = kNone;
}

void CornerTable::split(std::uint32_t c) {
    // Triangle (a, p, q) of c and (b, q, p) beyond become (a, p, m), (a, m, q), (b, q, m), (b, m,
    // p).
    const std::uint32_t d = opposites_[c], cp = next(c), cq = previous(c), dq = next(d),
                        dp = previous(d);
    const std::uint32_t a = vertices_[c], q = vertices_[cq], b = vertices_[d], p = vertices_[dp];
    const auto m = static_cast<std::uint32_t>(corners_.size());
    const auto e = static_cast<std::uint32_t>(vertices_.size()), f = e + 3;
    const std::uint32_t beyond_cp = opposites_[cp], beyond_dq = opposites_[dq];
    vertices_.insert(vertices_.end(), {a, m, q, b, m, p});
    opposites_.resize(vertices_.size());
    vertices_[cq] = m;      // c, cp, cq: a, p, m
    vertices_[dp] = m;      // d, dq, dp: b, q, m
    link(e + 1, beyond_cp); // opposite to m in (a, m, q): the edge q a
    link(cp, e + 2);        // the edge m a, between (a, p, m) and (a, m, q)
    link(f + 1, beyond_dq);
    link(dq, f + 2);
    link(c, f); // the edge p m
    link(d, e); // the edge q m
    corners_.push_back(cq);
    corners_[p] = cp;
    corners_[q] = dq;
    corners_[a] = c;
    corners_[b] = d;
}

} // namespace taihu
