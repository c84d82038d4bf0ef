#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include <openvdb/openvdb.h>

#include "vdb_ops/components_detail.h"
#include "vdb_ops/flips_detail.h"

namespace taihu {

/// Cubes of n voxels along each edge that cover a box, in order: x before y before z.
class TileLattice {
public:
    /// \throws Error bad_argument: beyond voxel 2^30; unsupported: more than 2^20 tiles.
    TileLattice(const openvdb::CoordBBox& box, int tile_voxels);

    std::size_t size() const { return size_; }
    openvdb::CoordBBox tile(std::size_t n) const;
    /// All tiles together.
    openvdb::CoordBBox world() const;
    /// The number of the tile before this one along an axis; false at the border.
    bool before(std::size_t n, int axis, std::size_t& number) const;

private:
    openvdb::Coord index(std::size_t n) const;
    int edge_ = 0;
    openvdb::Coord first_, n_;
    std::size_t size_ = 0;
};

/// The parts of a solid that is seen tile by tile, joined over the faces of tiles.
class TileParts {
public:
    explicit TileParts(const TileLattice& tiles) : tiles_(tiles), parts_(1), parent_{0} {}

    /// The tiles in order, each once.
    void add(std::size_t tile, const Components& components);
    /// After the last. \throws Error as choose_parts().
    const CleanCounts& choose(const CleanSettings& settings);
    /// Whether something in this tile changes side.
    bool any(std::size_t tile) const;
    /// Its voxels that do. \param components  as they were added.
    void mark(std::size_t tile, const Components& components, openvdb::MaskTree& removed,
              openvdb::MaskTree& filled) const;

private:
    using Faces = std::array<std::vector<std::uint32_t>, 3>; // upper ones
    std::uint32_t find(std::uint32_t part);
    std::uint32_t global(std::size_t tile, std::uint32_t part) const;
    void join_before(std::size_t tile, const Components& components);

    const TileLattice& tiles_;
    std::vector<std::uint32_t> offset_;   // of a tile's parts, by tile
    std::vector<Components::Part> parts_; // of all tiles; 0 is the void around
    std::vector<std::uint32_t> parent_;   // then, once chosen, the number of the whole part
    std::vector<Components::Contact> contacts_;
    std::map<std::size_t, Faces> faces_; // of tiles that a later one may meet
    CleanChoice choice_;
};

} // namespace taihu
