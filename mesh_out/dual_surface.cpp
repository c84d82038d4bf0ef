#include "mesh_out/dual_surface_detail.h"

#include <algorithm>
#include <bit>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "mesh_out/cell_loops_detail.h"
#include "stats/core/error.h"

namespace taihu {
namespace {

using openvdb::Coord;

/// Calls fn(block) for all blocks, in parallel.
template <class Fn>
void each_block(std::size_t n, const Fn& fn) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, 16), [&](const auto& range) {
        for (std::size_t b = range.begin(); b < range.end(); ++b)
            fn(static_cast<std::uint32_t>(b));
    });
}

/// Calls fn(cell, corners) for the cells of a block that the surface passes, large ones where it
/// passes the first of their voxel cells.
template <class Fn>
void each_cell(const CellBlock& block, std::uint32_t number, const Fn& fn) {
    std::uint64_t seen = 0; // large cells, by their first eighth
    for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; ++y) {
            const unsigned r00 = block.row(x, y), r01 = block.row(x, y + 1),
                           r10 = block.row(x + 1, y), r11 = block.row(x + 1, y + 1);
            const unsigned any = r00 | r01 | r10 | r11, all = r00 & r01 & r10 & r11;
            unsigned passed = (any | any >> 1) & ~(all & all >> 1) & 0xff;
            for (; passed != 0; passed &= passed - 1) {
                const int z = std::countr_zero(passed);
                const int size = block.size_at({x, y, z});
                const Coord c(x & -size, y & -size, z & -size);
                if (size > 1) {
                    const std::uint64_t bit = std::uint64_t{1}
                                              << ((c.x() / 2 * 4 + c.y() / 2) * 4 + c.z() / 2);
                    if ((seen & bit) != 0)
                        continue;
                    seen |= bit;
                }
                const unsigned corners = block.corners(c, size);
                if (corners != 0 && corners != 255)
                    fn(CellRef{number, CellBlocks::number(c), static_cast<std::uint8_t>(size)},
                       corners);
            }
        }
}

Coord along(int axis, int by) {
    Coord c(0);
    c[axis] = by;
    return c;
}

} // namespace

DualSurface::DualSurface(const CellBlocks& blocks, const SurfacePoints& points,
                         Certainty& certainty)
    : blocks_(blocks) {
    join_faces(points, certainty);
    number_vertices();
    make_polygons();
}

std::optional<CellRef> DualSurface::single(const Coord& voxel) const {
    const auto block = blocks_.find(voxel);
    if (!block)
        return std::nullopt;
    return CellRef{*block, CellBlocks::number(voxel - blocks_[*block].origin), 1};
}

bool DualSurface::is_joined(const CellRef& cell, int face) const {
    const auto owner = face % 2 == 0 ? cell : single(voxel_of(cell) + along(face / 2, 1));
    return owner && joined_.at(face_key(*owner, face / 2));
}

unsigned DualSurface::joined(const CellRef& cell, unsigned corners) const {
    const unsigned alternating = cell.size == 1 ? alternating_faces(corners) : 0;
    unsigned bits = 0;
    for (int face = 0; face < 6 && alternating != 0; ++face)
        if (alternating >> face & 1)
            bits |= static_cast<unsigned>(is_joined(cell, face)) << face;
    return bits;
}

bool DualSurface::in_one_loop(const CellRef& cell, int face) const {
    const unsigned corners = blocks_[cell.block].corners(CellBlocks::local(cell.first), 1);
    const auto& of_edge = cell_loops(corners, joined(cell, corners)).of_edge;
    const auto& e = face_ring(face).edges;
    const auto loop = [&](std::size_t k) { return of_edge[static_cast<std::size_t>(e[k])]; };
    return loop(0) == loop(1) && loop(1) == loop(2) && loop(2) == loop(3);
}

/// Whether the vertices of two cells would be joined by both arcs of the face between them.
bool DualSurface::could_meet_twice(const CellRef& above, int axis) const {
    const auto below = single(voxel_of(above) - along(axis, 1));
    return below && in_one_loop(above, 2 * axis) && in_one_loop(*below, 2 * axis + 1);
}

void DualSurface::join_faces(const SurfacePoints& points, Certainty& certainty) {
    struct Face {
        CellRef above; ///< its lower face along `axis`
        int axis;
        bool joined;
    };
    std::vector<std::vector<Face>> found(blocks_.size());
    each_block(blocks_.size(), [&](std::uint32_t b) {
        const SurfacePoints own = points; // for one thread each
        each_cell(blocks_[b], b, [&](const CellRef& cell, unsigned corners) {
            const unsigned alternating = cell.size == 1 ? alternating_faces(corners) : 0;
            for (int axis = 0; axis < 3; ++axis) {
                if (!(alternating >> (2 * axis) & 1))
                    continue;
                std::array<Coord, 4> ring;
                for (std::size_t k = 0; k < 4; ++k) {
                    const int c = face_ring(2 * axis).corners[k];
                    ring[k] = voxel_of(cell).offsetBy(c >> 2, c >> 1 & 1, c & 1);
                }
                found[b].push_back({cell, axis, own.joins(ring)});
            }
        });
    });
    std::vector<Face> faces;
    for (const auto& f : found)
        faces.insert(faces.end(), f.begin(), f.end());
    for (const Face& f : faces)
        joined_.emplace(face_key(f.above, f.axis), f.joined);
    // The other arcs part the vertices in both cells. Each time there is a curve more, and fewer
    // faces that do this, so once over them is enough.
    std::erase_if(faces, [&](const Face& f) { return !could_meet_twice(f.above, f.axis); });
    std::vector<Box> boxes;
    for (const Face& f : faces) {
        const Coord voxel = voxel_of(f.above);
        boxes.push_back({points.voxel(voxel.offsetBy(-1)), points.voxel(voxel.offsetBy(1))});
        if (could_meet_twice(f.above, f.axis)) {
            bool& flag = joined_.at(face_key(f.above, f.axis));
            flag = !flag;
        }
    }
    certainty.decided(boxes);
}

void DualSurface::number_vertices() {
    local_vertex_.resize(blocks_.size());
    std::vector<std::vector<std::pair<CellRef, int>>> found(blocks_.size());
    each_block(blocks_.size(), [&](std::uint32_t b) {
        std::uint16_t n = 0;
        each_cell(blocks_[b], b, [&](const CellRef& cell, unsigned corners) {
            const int loops = cell_loops(corners, joined(cell, corners)).n;
            local_vertex_[b][cell.first] = n;
            n = static_cast<std::uint16_t>(n + loops);
            found[b].emplace_back(cell, loops);
        });
    });
    for (const auto& block : found) {
        first_vertex_.push_back(static_cast<std::uint32_t>(cells_.size()));
        for (const auto& [cell, loops] : block)
            cells_.insert(cells_.end(), static_cast<std::size_t>(loops), cell);
        if (cells_.size() >= 0xffffffffu)
            throw Error(Fault::unsupported,
                        "extract: the mesh would have 2^32 vertices or more; use a larger voxel");
    }
}

bool DualSurface::polygon_across(std::uint32_t block, const Coord& voxel, int axis,
                                 DualPolygon& polygon) const {
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    // Most edges are within a large cell, or within the face between two.
    if (const int size = blocks_[block].size_at(voxel); size > 1) {
        const bool on_b = voxel[b] % size == 0, on_c = voxel[c] % size == 0;
        if (!on_b && !on_c)
            return false;
        if (on_b != on_c) {
            const auto other = blocks_.cell(block, voxel - along(on_b ? b : c, 1));
            if (!other || voxel[on_b ? c : b] % other->size != 0)
                return false;
        }
    }
    static constexpr int kAround[4][2] = {{-1, -1}, {0, -1}, {0, 0}, {-1, 0}};
    std::array<CellRef, 4> ring;
    std::size_t n = 0;
    polygon.n = 0;
    for (const auto& offset : kAround) {
        const Coord at = voxel + along(b, offset[0]) + along(c, offset[1]);
        const auto found = blocks_.cell(block, at);
        if (!found)
            return false;
        const CellRef& cell = *found;
        if (n > 0 && ring[n - 1] == cell)
            continue;
        ring[n++] = cell;
        const unsigned corners =
            blocks_[cell.block].corners(CellBlocks::local(cell.first), cell.size);
        int loop = 0;
        if (cell.size == 1) {
            const auto edge = static_cast<std::size_t>(4 * axis - 2 * offset[0] - offset[1]);
            loop = cell_loops(corners, joined(cell, corners)).of_edge[edge];
        }
        polygon.vertices[polygon.n++] = first_vertex_[cell.block] +
                                        local_vertex_[cell.block][cell.first] +
                                        static_cast<std::uint32_t>(loop);
    }
    if (n > 1 && ring[n - 1] == ring[0])
        polygon.n = static_cast<std::uint8_t>(n - 1);
    if (polygon.n < 3)
        return false; // within a cell, or within the face between two
    if (!blocks_[block].in(voxel))
        std::reverse(polygon.vertices.begin(), polygon.vertices.begin() + polygon.n);
    return true;
}

void DualSurface::make_polygons() {
    std::vector<std::vector<std::pair<Edge, DualPolygon>>> found(blocks_.size());
    each_block(blocks_.size(), [&](std::uint32_t b) {
        const auto take = [&](int x, int y, unsigned passed, int axis) {
            for (passed &= 0xff; passed != 0; passed &= passed - 1) {
                const Coord voxel(x, y, std::countr_zero(passed));
                DualPolygon polygon;
                if (polygon_across(b, voxel, axis, polygon))
                    found[b].push_back(
                        {{b, static_cast<std::uint16_t>(axis * 512 + CellBlocks::number(voxel))},
                         polygon});
            }
        };
        for (int x = 0; x < 8; ++x)
            for (int y = 0; y < 8; ++y) {
                const unsigned row = blocks_[b].row(x, y);
                take(x, y, row ^ blocks_[b].row(x + 1, y), 0);
                take(x, y, row ^ blocks_[b].row(x, y + 1), 1);
                take(x, y, row ^ row >> 1, 2);
            }
    });
    std::size_t n = 0;
    for (const auto& block : found)
        n += block.size();
    polygons_.reserve(n);
    edges_.reserve(n);
    for (const auto& block : found)
        for (const auto& [edge, polygon] : block) {
            edges_.push_back(edge);
            polygons_.push_back(polygon);
        }
}

} // namespace taihu
