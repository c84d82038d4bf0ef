#pragma once
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include <openvdb/openvdb.h>

namespace taihu {

/// Face-connected parts of the solid and of the void of a level set, over the leaves and uniform
/// blocks of a region.
class Components {
public:
    using Leaf = openvdb::FloatTree::LeafNodeType;
    /// Two parts that touch: a solid one and one of void.
    using Contact = std::pair<std::uint32_t, std::uint32_t>;
    struct Part {
        bool solid = false;
        std::size_t n_voxels = 0;
        openvdb::Coord first; ///< the first voxel: by block of 8^3, x before y before z, and in it
    };
    /// The void around everything; it has no voxels of its own, and is there always.
    static constexpr std::uint32_t kOutside = 0;

    /// \param region  whole leaves. \param world  beyond it all is void; holds the region.
    /// \throws Error bad_input: more than 2^31 blocks in the region.
    Components(const openvdb::FloatGrid& grid, const openvdb::CoordBBox& region,
               const openvdb::CoordBBox& world);

    const std::vector<Part>& parts() const { return parts_; }
    /// Each once, in order.
    std::vector<Contact> contacts() const;
    /// The part of a voxel of the region.
    std::uint32_t part(const openvdb::Coord& voxel) const;
    /// The parts on one face of the region, by voxel, the later axis fastest.
    std::vector<std::uint32_t> face(int axis, bool upper) const;
    /// The voxels of the marked parts, added to `mask`.
    void mark(const std::vector<char>& marked, openvdb::MaskTree& mask) const;

private:
    std::size_t block_index(const openvdb::Coord& voxel) const;
    openvdb::Coord block_origin(std::size_t block) const;
    void label_leaf(std::size_t leaf);
    std::uint32_t label_at(std::size_t block, int voxel) const;
    void label_blocks(const openvdb::FloatGrid& grid);
    void join_faces();
    void join_outside(const openvdb::CoordBBox& world);
    void collect();
    void contacts_of(std::size_t block, std::vector<Contact>& found) const;
    std::uint32_t find(std::uint32_t label);
    void join(std::uint32_t a, std::uint32_t b);

    std::vector<const Leaf*> leaves_;
    openvdb::CoordBBox region_;
    openvdb::Coord lo_, n_;            // the region in blocks of 8^3
    std::vector<std::uint32_t> block_; // leaf number, or kUniform + label of the block
    std::vector<std::array<std::uint16_t, 512>> labels_;
    std::vector<std::uint16_t> n_labels_;
    std::vector<std::uint32_t> first_label_, parent_, part_of_;
    std::vector<char> solid_; // by label
    std::vector<Part> parts_;
};

} // namespace taihu
