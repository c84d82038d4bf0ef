#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include <openvdb/openvdb.h>

namespace taihu {

/// Face-connected pieces of the solid and of the void of a level set, over leaves and uniform
/// blocks.
class Components {
public:
    using Leaf = openvdb::FloatTree::LeafNodeType;
    struct Part {
        bool solid = false;
        bool outside = false; ///< the unbounded void
        std::size_t n_voxels = 0;
        std::size_t first = 0; ///< where it was met first, for ties
    };

    explicit Components(const openvdb::FloatGrid& grid);

    const std::vector<Part>& parts() const { return parts_; }
    /// The part that a voxel of leaf number `leaf` (in tree order) belongs to.
    std::uint32_t part(std::size_t leaf, int voxel) const {
        return part_of_[first_label_[leaf] + labels_[leaf][static_cast<std::size_t>(voxel)]];
    }
    /// The part of any voxel inside the box of the leaves.
    std::uint32_t part(const openvdb::Coord& voxel) const;
    const std::vector<const Leaf*>& leaves() const { return leaves_; }
    /// By block of 8^3 voxels: holds a voxel of a part that is marked in `marked`.
    std::vector<char> blocks_with(const std::vector<char>& marked) const;
    /// A block within kMargin of the one at `origin` is set in `blocks`.
    bool near_any(const openvdb::Coord& origin, const std::vector<char>& blocks) const;

private:
    std::size_t block_index(const openvdb::Coord& voxel) const;
    void label_leaf(std::size_t leaf);
    std::uint32_t label_at(std::size_t block, int voxel) const;
    void join_faces();
    void collect();
    std::uint32_t find(std::uint32_t label);
    void join(std::uint32_t a, std::uint32_t b);

    std::vector<const Leaf*> leaves_;
    openvdb::Coord lo_, n_;            // blocks of 8^3 that the leaves' box covers, plus one
    std::vector<std::uint32_t> block_; // leaf number, or kUniform + label of the block
    std::vector<std::array<std::uint16_t, 512>> labels_;
    std::vector<std::uint16_t> n_labels_;
    std::vector<std::uint32_t> first_label_, parent_, part_of_;
    std::vector<char> solid_; // by label
    std::vector<Part> parts_;
};

} // namespace taihu
