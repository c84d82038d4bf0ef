#include "vdb_ops/rasterize.h"

#include <atomic>
#include <cmath>
#include <vector>

#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/kernels_detail.h"

namespace taihu {
namespace {

using openvdb::Coord;
using Leaf = openvdb::FloatTree::LeafNodeType;
constexpr int kBlock = BlockSampler::kBlock;
constexpr int kLeaf = BlockSampler::kLeaf;
constexpr float kLeastWidth = 2, kMostWidth = 16; // half bands [voxels]
constexpr double kLeastVoxel_m = 1.5e-5;          // OpenVDB takes 3e-15 m^3 for no volume
constexpr double kMostBlocks = 0x1p27;

/// A leaf node from its distances in voxels, or null when none of them lies in the band.
std::unique_ptr<Leaf> make_leaf(const Coord& origin, const float* values, const Lattice& lattice) {
    Leaf::NodeMaskType mask;
    bool any = false;
    for (openvdb::Index64 word = 0; word < 8; ++word) {
        const std::uint64_t bits = band_bits(values + word * 64, lattice.half_width_vox);
        mask.getWord<openvdb::Index64>(static_cast<openvdb::Index>(word)) = bits;
        any |= bits != 0;
    }
    if (!any)
        return nullptr;
    auto leaf = std::make_unique<Leaf>(openvdb::PartialCreate(), origin);
    leaf->allocate();
    scale_values(values, static_cast<float>(lattice.voxel_m), leaf->buffer().data());
    leaf->setValueMask(mask);
    return leaf;
}

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

/// How many blocks of 64^3 voxels the box of the solid has.
std::size_t count_blocks(const openvdb::CoordBBox& box) {
    double n = 1;
    for (int axis = 0; axis < 3; ++axis) {
        if (box.min()[axis] < -(1 << 30) || box.max()[axis] > (1 << 30))
            throw Error(
                Fault::bad_argument,
                "rasterize: the solid reaches beyond voxel 2^30; use a larger voxel, or move "
                "the solid nearer to the origin");
        n *= (box.max()[axis] >> 6) - (box.min()[axis] >> 6) + 1.0;
    }
    if (n > kMostBlocks)
        throw Error(Fault::unsupported,
                    "rasterize: the box of the solid holds " + shortest(n) +
                        " blocks of 64^3 voxels, at most 2^27 are handled; use a "
                        "larger voxel");
    return static_cast<std::size_t>(n);
}

} // namespace

openvdb::FloatGrid::Ptr rasterize(const Field& field, const Lattice& lattice, Progress* progress) {
    check_lattice(lattice);
    const std::unique_ptr<LatticeField> sampled = field.on(lattice, openvdb::CoordBBox::inf());
    const openvdb::CoordBBox box = sampled->bounds();
    const auto background = static_cast<float>(lattice.half_width_vox * lattice.voxel_m);
    auto grid = openvdb::FloatGrid::create(background);
    auto transform = openvdb::math::Transform::createLinearTransform(lattice.voxel_m);
    transform->postTranslate({lattice.origin.x, lattice.origin.y, lattice.origin.z});
    grid->setTransform(transform);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    if (box.empty())
        return grid;

    const Coord first(box.min().x() >> 6, box.min().y() >> 6, box.min().z() >> 6);
    const Coord last(box.max().x() >> 6, box.max().y() >> 6, box.max().z() >> 6);
    const Coord n(last.x() - first.x() + 1, last.y() - first.y() + 1, last.z() - first.z() + 1);
    const std::size_t n_blocks = count_blocks(box);
    std::vector<std::vector<std::unique_ptr<Leaf>>> leaves(n_blocks);
    std::atomic<std::size_t> n_done{0};
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n_blocks, 1), [&](const auto& range) {
        alignas(64) float values[512];
        for (std::size_t b = range.begin(); b < range.end(); ++b) {
            check_cancelled(progress);
            const auto ny = static_cast<std::size_t>(n.y()), nz = static_cast<std::size_t>(n.z());
            const Coord block((first.x() + static_cast<int>(b / (ny * nz))) * kBlock,
                              (first.y() + static_cast<int>(b / nz % ny)) * kBlock,
                              (first.z() + static_cast<int>(b % nz)) * kBlock);
            Cover cover = Cover::outside;
            const auto sampler = sampled->open(block, cover);
            for (int i = 0; sampler && i < kBlock; i += kLeaf)
                for (int j = 0; j < kBlock; j += kLeaf)
                    for (int k = 0; k < kBlock; k += kLeaf) {
                        const Coord origin = block.offsetBy(i, j, k);
                        if (sampler->cover(origin) != Cover::surface)
                            continue;
                        sampler->values(origin, values);
                        if (auto leaf = make_leaf(origin, values, lattice))
                            leaves[b].push_back(std::move(leaf));
                    }
            const std::size_t done = ++n_done;
            if (done * 100 / n_blocks != (done - 1) * 100 / n_blocks)
                report_fraction(progress,
                                static_cast<double>(done) / static_cast<double>(n_blocks));
        }
    });
    auto accessor = grid->getAccessor();
    for (auto& list : leaves)
        for (auto& leaf : list)
            accessor.addLeaf(leaf.release());
    // Tiles take the side of the leaves beside them; leaves hold both sides already.
    openvdb::tools::signedFloodFill(grid->tree(), true, 1, 1);
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
