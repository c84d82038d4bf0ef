#include "vdb_ops/rasterize.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <span>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/leaf_detail.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
using Leaf = BlockSampler::Leaf;
using TopNode = openvdb::FloatTree::RootNodeType::ChildNodeType; // 4096^3 voxels
using Node = TopNode::ChildNodeType;                             // 128^3 voxels, 16^3 leaves
constexpr int kBlock = BlockSampler::kBlock;
constexpr int kLeaf = BlockSampler::kLeaf;
constexpr int kNode = static_cast<int>(Node::DIM);
constexpr int kBlocksAcross = kNode / kBlock; // of a node
constexpr int kBlocksPerNode = kBlocksAcross * kBlocksAcross * kBlocksAcross;
constexpr float kLeastWidth = 2, kMostWidth = 16; // half bands [voxels]
constexpr double kLeastVoxel_m = 1.5e-5;          // OpenVDB takes 3e-15 m^3 for no volume
constexpr double kMostBlocks = 0x1p27;

/// What becomes of a block: one side, or leaves and the cubes of their size that lie inside.
struct BlockResult {
    Cover whole = Cover::outside;
    std::vector<std::unique_ptr<Leaf>> leaves;
    std::vector<openvdb::Index> inside; ///< places in the block's node
};

/// What becomes of a node: one side, or a node of the tree.
struct NodeResult {
    bool inside = false;
    std::unique_ptr<Node> node;
};

/// The blocks and nodes of one rasterisation. Each is a function of the field alone, so it is the
/// same whatever is computed beside it.
class Rasterizer {
public:
    /// \param region  whole leaves; what lies outside of it is left out.
    Rasterizer(const LatticeField& field, const Lattice& lattice, const CoordBBox& region)
        : field_(field), box_(field.bounds()), half_width_(lattice.half_width_vox),
          voxel_(static_cast<float>(lattice.voxel_m)),
          background_(static_cast<float>(lattice.half_width_vox * lattice.voxel_m)) {
        box_.intersect(region);
        if (box_.empty())
            return;
        box_ = CoordBBox(box_.min() & ~(kLeaf - 1), box_.max() | (kLeaf - 1));
    }

    float background() const { return background_; }
    const CoordBBox& box() const { return box_; }

    BlockResult block(const Coord& origin) const {
        BlockResult result;
        if (!box_.hasOverlap(CoordBBox::createCube(origin, kBlock)))
            return result;
        const auto sampler = field_.open(origin, result.whole);
        const Cover whole = result.whole;
        if (!sampler &&
            (whole == Cover::outside || box_.isInside(CoordBBox::createCube(origin, kBlock))))
            return result;
        result.whole = Cover::surface;
        std::unique_ptr<Leaf> leaf;
        for (int i = 0; i < kBlock; i += kLeaf)
            for (int j = 0; j < kBlock; j += kLeaf)
                for (int k = 0; k < kBlock; k += kLeaf) {
                    const Coord at = origin.offsetBy(i, j, k);
                    if (!box_.isInside(at))
                        continue;
                    Cover cover = sampler ? sampler->cover(at) : whole;
                    if (cover == Cover::surface)
                        cover = sample(*sampler, at, leaf);
                    if (cover == Cover::surface)
                        result.leaves.push_back(std::move(leaf));
                    else if (cover == Cover::inside)
                        result.inside.push_back(Node::coordToOffset(at));
                }
        return result;
    }

    /// Puts the blocks of a node together, z fastest.
    NodeResult node(const Coord& origin, std::span<BlockResult> blocks) const {
        std::size_t n_leaves = 0, n_inside = 0;
        for (const BlockResult& b : blocks) {
            n_leaves += b.leaves.size();
            n_inside += b.whole == Cover::inside ? kLeavesPerBlock : b.inside.size();
        }
        if (n_leaves == 0 && (n_inside == 0 || n_inside == Node::NUM_VALUES))
            return {n_inside != 0, nullptr};
        auto node = std::make_unique<Node>(origin, background_, false);
        for (std::size_t b = 0; b < blocks.size(); ++b) {
            if (blocks[b].whole == Cover::inside)
                node->fill(CoordBBox::createCube(block_origin(origin, b), kBlock), -background_,
                           false);
            for (const openvdb::Index place : blocks[b].inside)
                node->addTile(place, -background_, false);
            for (auto& leaf : blocks[b].leaves)
                node->addChild(leaf.release());
        }
        return {false, std::move(node)};
    }

    static Coord block_origin(const Coord& node, std::size_t b) {
        const auto i = static_cast<int>(b);
        return node.offsetBy(i / (kBlocksAcross * kBlocksAcross) * kBlock,
                             i / kBlocksAcross % kBlocksAcross * kBlock,
                             i % kBlocksAcross * kBlock);
    }

private:
    /// Fills `leaf`, which may be left over from an earlier call, and tells what came out.
    Cover sample(BlockSampler& sampler, const Coord& origin, std::unique_ptr<Leaf>& leaf) const {
        if (!leaf) {
            leaf = std::make_unique<Leaf>(openvdb::PartialCreate(), origin);
            leaf->allocate();
        }
        float* out = leaf->buffer().data();
        LeafBits active;
        if (const Leaf* stored = sampler.stored(origin)) {
            active = copy_band(stored->buffer().data(), active_bits(*stored), background_, out);
        } else {
            alignas(64) float values[512];
            sampler.values(origin, values);
            active = to_band(values, half_width_, voxel_, background_, out);
        }
        if (std::all_of(active.word, active.word + 8, [](std::uint64_t w) { return w == 0; }))
            return out[0] < 0 ? Cover::inside : Cover::outside;
        Leaf::NodeMaskType mask;
        for (openvdb::Index n = 0; n < 8; ++n)
            mask.getWord<std::uint64_t>(n) = active.word[n];
        leaf->setValueMask(mask);
        leaf->setOrigin(origin);
        return Cover::surface;
    }

    static constexpr std::size_t kLeavesPerBlock = 512;
    const LatticeField& field_;
    CoordBBox box_;
    float half_width_, voxel_, background_;
};

void check_lattice(const Lattice& lattice) {
    const auto refuse = [](const std::string& what) {
        throw Error(Fault::bad_argument, "rasterize: " + what);
    };
    if (!(lattice.voxel_m > 0) || !std::isfinite(lattice.voxel_m))
        refuse("voxel_m is " + shortest(lattice.voxel_m) +
               ", must be finite and > 0; give a voxel size");
    if (lattice.voxel_m < kLeastVoxel_m)
        refuse(
            "a voxel of " + shortest(lattice.voxel_m) +
            " m is below the 1.5e-5 m that a level set holds; use a larger voxel, or a larger unit "
            "of length");
    if (!(lattice.half_width_vox >= kLeastWidth && lattice.half_width_vox <= kMostWidth))
        refuse("half_width_vox is " + shortest(static_cast<double>(lattice.half_width_vox)) +
               ", must be 2..16; 3 is usual");
}

/// The nodes of 128^3 voxels that the box of a solid meets.
class NodeLattice {
public:
    explicit NodeLattice(const CoordBBox& box) {
        double n_blocks = 1;
        for (int axis = 0; axis < 3; ++axis) {
            if (box.min()[axis] < -(1 << 30) || box.max()[axis] > (1 << 30))
                throw Error(
                    Fault::bad_argument,
                    "rasterize: the solid reaches beyond voxel 2^30; use a larger voxel, or "
                    "move the solid nearer to the origin");
            n_blocks *= (box.max()[axis] >> 6) - (box.min()[axis] >> 6) + 1.0;
            first_[axis] = box.min()[axis] >> Node::TOTAL;
            n_[axis] =
                static_cast<std::size_t>((box.max()[axis] >> Node::TOTAL) - first_[axis] + 1);
        }
        if (n_blocks > kMostBlocks)
            throw Error(Fault::unsupported,
                        "rasterize: the box of the solid holds " + shortest(n_blocks) +
                            " blocks of 64^3 voxels, at most 2^27 are handled; use a "
                            "larger voxel");
    }
    std::size_t size() const { return n_[0] * n_[1] * n_[2]; }
    Coord origin(std::size_t n) const {
        return Coord(first_.x() + static_cast<int>(n / (n_[1] * n_[2])),
                     first_.y() + static_cast<int>(n / n_[2] % n_[1]),
                     first_.z() + static_cast<int>(n % n_[2]))
               << Node::TOTAL;
    }

private:
    Coord first_;
    std::size_t n_[3] = {};
};

} // namespace

openvdb::FloatGrid::Ptr rasterize(const Field& field, const Lattice& lattice, Progress* progress) {
    check_lattice(lattice);
    return rasterize(*field.on(lattice, CoordBBox::inf()), lattice, CoordBBox::inf(), progress);
}

openvdb::FloatGrid::Ptr rasterize(const LatticeField& field, const Lattice& lattice,
                                  const openvdb::CoordBBox& region, Progress* progress) {
    check_lattice(lattice);
    const Rasterizer rasterizer(field, lattice, region);
    auto grid = empty_level_set(lattice);
    if (rasterizer.box().empty())
        return grid;

    const NodeLattice nodes(rasterizer.box());
    std::vector<NodeResult> results(nodes.size());
    std::atomic<std::size_t> n_done{0};
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, nodes.size(), 1), [&](const auto& range) {
        for (std::size_t n = range.begin(); n < range.end(); ++n) {
            BlockResult blocks[kBlocksPerNode];
            tbb::parallel_for(std::size_t{0}, std::size(blocks), [&](std::size_t b) {
                check_cancelled(progress);
                blocks[b] = rasterizer.block(Rasterizer::block_origin(nodes.origin(n), b));
            });
            results[n] = rasterizer.node(nodes.origin(n), blocks);
            const std::size_t done = ++n_done;
            if (done * 100 / nodes.size() != (done - 1) * 100 / nodes.size())
                report_fraction(progress,
                                static_cast<double>(done) / static_cast<double>(nodes.size()));
        }
    });
    auto& root = grid->tree().root();
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        if (!results[n].node && !results[n].inside)
            continue;
        const Coord origin = nodes.origin(n);
        auto* top = root.probeNode<TopNode>(origin);
        if (!top) {
            top = new TopNode(origin, rasterizer.background(), false);
            root.addChild(top);
        }
        if (results[n].node)
            top->addChild(results[n].node.release());
        else
            top->addTile(TopNode::coordToOffset(origin), -rasterizer.background(), false);
    }
    return grid;
}

openvdb::FloatGrid::Ptr empty_level_set(const Lattice& lattice) {
    auto grid =
        openvdb::FloatGrid::create(static_cast<float>(lattice.half_width_vox * lattice.voxel_m));
    auto transform = openvdb::math::Transform::createLinearTransform(lattice.voxel_m);
    transform->postTranslate({lattice.origin.x, lattice.origin.y, lattice.origin.z});
    grid->setTransform(transform);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    return grid;
}

Lattice lattice_of(const openvdb::FloatGrid& grid) {
    const std::string where = "grid '" + grid.getName() + "'";
    if (grid.getGridClass() != openvdb::GRID_LEVEL_SET)
        throw Error(Fault::bad_argument, where + ": not a level set; convert it first");
    const openvdb::Vec3d voxel = grid.voxelSize(), zero = grid.indexToWorld(openvdb::Vec3d(0.0));
    bool upright = grid.transform().isLinear();
    for (int axis = 0; axis < 3; ++axis) {
        openvdb::Vec3d one(0.0);
        one[axis] = 1;
        openvdb::Vec3d off = grid.indexToWorld(one) - zero;
        off[axis] -= voxel.x();
        upright = upright && off.length() <= 1e-6 * voxel.x();
    }
    if (!upright)
        throw Error(Fault::bad_argument,
                    where + ": its voxels are not upright cubes; resample it on a uniform grid");
    Lattice lattice;
    lattice.voxel_m = voxel.x();
    lattice.origin = {zero.x(), zero.y(), zero.z()};
    lattice.half_width_vox = static_cast<float>(grid.background() / voxel.x());
    if (!(lattice.half_width_vox >= kLeastWidth && lattice.half_width_vox <= kMostWidth))
        throw Error(Fault::bad_argument, where + ": its half band is " +
                                             std::to_string(lattice.half_width_vox) +
                                             " voxels, must be 2..16; rebuild the level set");
    return lattice;
}

} // namespace taihu
