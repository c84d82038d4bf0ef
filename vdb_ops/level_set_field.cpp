#include "vdb_ops/level_set_field.h"

#include <cmath>
#include <vector>

#include "stats/core/error.h"
#include "vdb_ops/leaf_detail.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

using openvdb::Coord;

using Node = openvdb::FloatTree::RootNodeType::ChildNodeType::ChildNodeType; // 16^3 leaves

Cover tile_side(float value) {
    return value < 0 ? Cover::inside : Cover::outside;
}

class LevelSetBlock final : public BlockSampler {
public:
    LevelSetBlock(const Node& node, float half_width, float inverse_voxel)
        : node_(node), half_width_(half_width), inverse_voxel_(inverse_voxel) {}

    Cover cover(const Coord& leaf) const override {
        const openvdb::Index i = Node::coordToOffset(leaf);
        return node_.isChildMaskOn(i) ? Cover::surface : tile_side(node_.getTable()[i].getValue());
    }

    void values(const Coord& leaf, float* out) override {
        const Leaf& in = *stored(leaf);
        take_values(in.buffer().data(), active_bits(in), half_width_, inverse_voxel_, out);
    }

    const Leaf* stored(const Coord& leaf) const override {
        return node_.getTable()[Node::coordToOffset(leaf)].getChild();
    }

private:
    const Node& node_;
    float half_width_, inverse_voxel_;
};

class LatticeLevelSet final : public LatticeField {
public:
    LatticeLevelSet(const openvdb::FloatGrid& grid, const Lattice& lattice)
        : tree_(grid.tree()), half_width_(lattice.half_width_vox),
          inverse_voxel_(static_cast<float>(1 / lattice.voxel_m)) {
        // Leaves, not active voxels: a leaf's box is what the blocks have to cover.
        std::vector<const Node*> nodes;
        tree_.getNodes(nodes);
        for (const Node* node : nodes)
            for (auto leaf = node->cbeginChildOn(); leaf; ++leaf)
                box_.expand(leaf.getCoord(), BlockSampler::kLeaf);
    }
    openvdb::CoordBBox bounds() const override { return box_; }

    std::unique_ptr<BlockSampler> open(const Coord& block, Cover& cover) const override {
        const Node* node = tree_.probeConstNode<Node>(block);
        cover = node ? cover_of(*node, block) : tile_side(tree_.getValue(block));
        if (cover != Cover::surface)
            return nullptr;
        return std::make_unique<LevelSetBlock>(*node, half_width_, inverse_voxel_);
    }

private:
    static Cover cover_of(const Node& node, const Coord& block) {
        constexpr int kAcross = BlockSampler::kBlock / BlockSampler::kLeaf;
        const openvdb::Index first = Node::coordToOffset(block);
        const Cover side = tile_side(node.getTable()[first].getValue());
        for (openvdb::Index i = 0; i < kAcross; ++i)
            for (openvdb::Index j = 0; j < kAcross; ++j)
                for (openvdb::Index k = 0; k < kAcross; ++k) {
                    const openvdb::Index n = first + ((i * 16 + j) * 16 + k);
                    if (node.isChildMaskOn(n) || tile_side(node.getTable()[n].getValue()) != side)
                        return Cover::surface;
                }
        return side;
    }

    const openvdb::FloatTree& tree_;
    float half_width_, inverse_voxel_;
    openvdb::CoordBBox box_;
};

} // namespace

LevelSetField::LevelSetField(openvdb::FloatGrid::ConstPtr grid) : grid_(std::move(grid)) {
    lattice_of(*grid_);
}

std::unique_ptr<LatticeField> LevelSetField::on(const Lattice& lattice,
                                                const openvdb::CoordBBox&) const {
    const Lattice own = lattice_of(*grid_);
    const double offset = length(own.origin - lattice.origin);
    if (std::fabs(own.voxel_m - lattice.voxel_m) > 1e-9 * own.voxel_m ||
        offset > 1e-9 * own.voxel_m || own.half_width_vox + 1e-3f < lattice.half_width_vox)
        throw Error(Fault::bad_argument,
                    "grid '" + grid_->getName() + "': sampled at " + std::to_string(own.voxel_m) +
                        " m, asked for " + std::to_string(lattice.voxel_m) +
                        " m; use its own voxel size, or voxelize the mesh again");
    return std::make_unique<LatticeLevelSet>(*grid_, lattice);
}

} // namespace taihu
