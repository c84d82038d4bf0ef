#pragma once
#include <openvdb/openvdb.h>

#include "vdb_ops/kernels_detail.h"

namespace taihu {

/// The active voxels of a leaf node.
inline LeafBits active_bits(const openvdb::FloatTree::LeafNodeType& leaf) {
    LeafBits bits;
    for (openvdb::Index n = 0; n < 8; ++n)
        bits.word[n] = leaf.valueMask().getWord<std::uint64_t>(n);
    return bits;
}

} // namespace taihu
