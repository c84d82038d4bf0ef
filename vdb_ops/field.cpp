#include "vdb_ops/field.h"

#include "vdb_ops/kernels_detail.h"

namespace taihu {

void BlockSampler::subtract_from(const openvdb::Coord& leaf, float* values) {
    alignas(64) float own[512];
    this->values(leaf, own);
    subtract_values(values, own, values);
}

const BlockSampler::Leaf* BlockSampler::stored(const openvdb::Coord&) const {
    return nullptr;
}

} // namespace taihu
