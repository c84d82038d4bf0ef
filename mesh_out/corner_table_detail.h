#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "stats/core/tri_mesh.h"

namespace taihu {

/// A closed 2-manifold as a corner table: corner c belongs to triangle c / 3; two numbers a corner
/// and one a vertex. Collapses and splits are local; what is gone is left as a gap.
/// Source: Rossignac 2001, "3D compression made simple: Edgebreaker on a corner-table" (from
/// memory, unchecked).
class CornerTable {
public:
    static constexpr std::uint32_t kNone = 0xffffffffu;
    static constexpr std::size_t kMostCorners = 40; ///< round a vertex, that are worked on

    /// The corners round a vertex, counter-clockwise; in its triangle corner k comes before
    /// neighbour k and after neighbour k + 1.
    struct Ring {
        std::size_t n = 0;
        std::array<std::uint32_t, kMostCorners> corners, neighbours;
        /// Calls visit(v, w) for each triangle, v and w the other two vertices, until it says
        /// false.
        template <class Visit>
        bool each(Visit&& visit) const {
            for (std::size_t k = 0; k < n; ++k)
                if (!visit(neighbours[k], neighbours[k + 1 < n ? k + 1 : 0]))
                    return false;
            return true;
        }
        std::span<const std::uint32_t> all() const { return {corners.data(), n}; }
    };

    /// \throws Error bad_argument, beginning with `where`: not a closed oriented 2-manifold by
    /// index.
    CornerTable(std::size_t n_vertices, std::span<const Triangle> triangles, const char* where);

    static std::uint32_t next(std::uint32_t c) { return c % 3 == 2 ? c - 2 : c + 1; }
    static std::uint32_t previous(std::uint32_t c) { return c % 3 == 0 ? c + 2 : c - 1; }

    std::size_t n_vertices() const { return corners_.size(); }
    std::size_t n_triangles() const { return vertices_.size() / 3; } ///< gaps included
    bool has_triangle(std::size_t t) const { return vertices_[3 * t] != kNone; }
    bool has_vertex(std::uint32_t v) const { return corners_[v] != kNone; }
    Triangle triangle(std::size_t t) const {
        return {vertices_[3 * t], vertices_[3 * t + 1], vertices_[3 * t + 2]};
    }
    std::uint32_t vertex(std::uint32_t c) const { return vertices_[c]; }
    std::uint32_t opposite(std::uint32_t c) const { return opposites_[c]; }
    std::uint32_t corner(std::uint32_t v) const { return corners_[v]; }
    /// The next corner of the same vertex, counter-clockwise.
    std::uint32_t swing(std::uint32_t c) const { return next(opposites_[next(c)]); }
    /// False when the vertex has more than kMostCorners.
    bool ring(std::uint32_t v, Ring& out) const;

    /// The corner of `a` before the edge to `b` in its ring, when moving `a` into `b` leaves a
    /// closed 2-manifold: the link condition, and no vertex left with two neighbours; else kNone.
    std::uint32_t collapsible(std::uint32_t a, std::uint32_t b, const Ring& ring_a,
                              const Ring& ring_b) const;
    /// Moves vertex(c) into vertex(next(c)); `c` and `ring` as collapsible() had them.
    void collapse(std::uint32_t c, const Ring& ring);
    /// A new vertex, the last one, in the edge opposite to corner `c`: two triangles more.
    void split(std::uint32_t c);

private:
    void link(std::uint32_t c, std::uint32_t d) {
        opposites_[c] = d;
        opposites_[d] = c;
    }

    std::vector<std::uint32_t> vertices_, opposites_; ///< per corner
    std::vector<std::uint32_t> corners_;              ///< per vertex, one of its corners
};

} // namespace taihu
