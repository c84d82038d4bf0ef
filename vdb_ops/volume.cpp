#include "vdb_ops/volume.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

/// Share of a tent of half width 1 about `d` that lies below 0.
float inside_share(float d) {
    const float rest = 1 - std::min(std::fabs(d), 1.f);
    return d > 0 ? 0.5f * rest * rest : 1 - 0.5f * rest * rest;
}

} // namespace

// Tents of half widths 1 and 2 have second moments 1/6 and 4/6, which cancel in (4 a - b) / 3;
// integer widths make sums over a lattice exact for planes along its axes.
double volume_m3(const openvdb::FloatGrid& solid) {
    const double voxel = lattice_of(solid).voxel_m;
    using Leaf = openvdb::FloatTree::LeafNodeType;
    std::vector<const Leaf*> leaves;
    solid.tree().getNodes(leaves);
    std::vector<double> sums(leaves.size());
    const float inverse = static_cast<float>(1 / voxel);
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, leaves.size(), 64), [&](const auto& range) {
            for (std::size_t l = range.begin(); l < range.end(); ++l) {
                const float* v = leaves[l]->buffer().data();
                double sum = 0;
                for (int i = 0; i < 512; ++i) {
                    const float d = v[i] * inverse;
                    sum += static_cast<double>(4 * inside_share(d) - inside_share(0.5f * d));
                }
                sums[l] = sum / 3;
            }
        });
    double n_voxels = 0;
    for (const double s : sums)
        n_voxels += s;
    auto tile = solid.tree().cbeginValueAll();
    tile.setMaxDepth(openvdb::FloatTree::ValueAllCIter::LEAF_DEPTH - 1);
    for (; tile; ++tile)
        if (tile.getValue() < 0)
            n_voxels += static_cast<double>(tile.getVoxelCount());
    return n_voxels * voxel * voxel * voxel;
}

} // namespace taihu
