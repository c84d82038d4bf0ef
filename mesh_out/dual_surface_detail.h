#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "mesh_out/cell_blocks_detail.h"
#include "mesh_out/extract_certainty_detail.h"
#include "mesh_out/surface_points_detail.h"

namespace taihu {

/// A polygon of the dual mesh: it stands across the edge between two voxels that the surface
/// passes, and joins the cells around it; counter-clockwise from outside.
struct DualPolygon {
    std::array<std::uint32_t, 4> vertices;
    std::uint8_t n = 4; ///< 3 where one cell is on two sides of the edge
};

/// Which vertices a surface has in the cells of an octree and which polygons join them: one vertex
/// for each curve in which it passes a cell's faces, so that it is a closed 2-manifold whatever the
/// signs. Where corners of a face alternate, both cells beside it join the same of them; and never
/// so that two faces of the mesh could share both ends of two edges. Of a part of a solid, it ends
/// where blocks are missing.
class DualSurface {
public:
    struct Edge {
        std::uint32_t block;
        std::uint16_t key; ///< axis * 512 + cell number of the voxel in the block
    };

    /// \throws Error unsupported: 2^32 vertices or more.
    DualSurface(const CellBlocks& blocks, const SurfacePoints& points, Certainty& certainty);

    std::size_t n_vertices() const { return cells_.size(); }
    const CellRef& cell(std::size_t vertex) const { return cells_[vertex]; }
    const std::vector<DualPolygon>& polygons() const { return polygons_; }
    /// The edge that polygon i stands across.
    const std::vector<Edge>& edges() const { return edges_; }

private:
    unsigned joined(const CellRef& cell, unsigned corners) const;
    void join_faces(const SurfacePoints& points, Certainty& certainty);
    bool is_joined(const CellRef& cell, int face) const;
    bool could_meet_twice(const CellRef& above, int axis) const;
    bool in_one_loop(const CellRef& cell, int face) const;
    void number_vertices();
    void make_polygons();
    bool polygon_across(std::uint32_t block, const openvdb::Coord& voxel, int axis,
                        DualPolygon& polygon) const;

    static std::uint64_t face_key(const CellRef& cell, int axis) {
        return (std::uint64_t{cell.block} * 512 + cell.first) * 4 + static_cast<unsigned>(axis);
    }
    openvdb::Coord voxel_of(const CellRef& cell) const {
        return blocks_[cell.block].origin + CellBlocks::local(cell.first);
    }
    std::optional<CellRef> single(const openvdb::Coord& voxel) const;

    const CellBlocks& blocks_;
    std::unordered_map<std::uint64_t, bool> joined_; ///< by the lower faces of cells
    std::vector<std::array<std::uint16_t, 512>> local_vertex_;
    std::vector<std::uint32_t> first_vertex_; ///< of each block
    std::vector<CellRef> cells_;
    std::vector<DualPolygon> polygons_;
    std::vector<Edge> edges_;
};

} // namespace taihu
