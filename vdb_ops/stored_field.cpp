#include "vdb_ops/stored_field.h"

#include "stats/core/error.h"
#include "vdb_ops/kernels_detail.h"
#include "vdb_ops/leaf_detail.h"

namespace taihu {
namespace {

using openvdb::Coord;

class StoredBlock final : public BlockSampler {
public:
    StoredBlock(std::unique_ptr<BlockSampler> of, const Lattice& lattice)
        : of_(std::move(of)), half_width_(lattice.half_width_vox),
          voxel_(static_cast<float>(lattice.voxel_m)),
          inverse_voxel_(static_cast<float>(1 / lattice.voxel_m)),
          background_(static_cast<float>(lattice.half_width_vox * lattice.voxel_m)) {
        leaf_.allocate();
    }

    Cover cover(const Coord& leaf) const override { return of_->cover(leaf); }

    void values(const Coord& leaf, float* out) override {
        const Leaf& in = *stored(leaf);
        take_values(in.buffer().data(), active_bits(in), half_width_, inverse_voxel_, out);
    }

    const Leaf* stored(const Coord& leaf) const override {
        if (leaf_.origin() == leaf && filled_)
            return &leaf_;
        float* out = leaf_.buffer().data();
        LeafBits active;
        if (const Leaf* own = of_->stored(leaf)) {
            active = copy_band(own->buffer().data(), active_bits(*own), background_, out);
        } else {
            alignas(64) float values[512];
            of_->values(leaf, values);
            active = to_band(values, half_width_, voxel_, background_, out);
        }
        Leaf::NodeMaskType mask;
        for (openvdb::Index n = 0; n < 8; ++n)
            mask.getWord<std::uint64_t>(n) = active.word[n];
        leaf_.setValueMask(mask);
        leaf_.setOrigin(leaf);
        filled_ = true;
        return &leaf_;
    }

private:
    std::unique_ptr<BlockSampler> of_;
    float half_width_, voxel_, inverse_voxel_, background_;
    mutable Leaf leaf_; ///< the one asked for last
    mutable bool filled_ = false;
};

class LatticeStored final : public LatticeField {
public:
    LatticeStored(std::unique_ptr<LatticeField> of, const Lattice& lattice)
        : of_(std::move(of)), lattice_(lattice) {}
    openvdb::CoordBBox bounds() const override { return of_->bounds(); }
    std::unique_ptr<BlockSampler> open(const Coord& block, Cover& cover) const override {
        auto of = of_->open(block, cover);
        return of ? std::make_unique<StoredBlock>(std::move(of), lattice_) : nullptr;
    }

private:
    std::unique_ptr<LatticeField> of_;
    Lattice lattice_;
};

} // namespace

StoredField::StoredField(std::shared_ptr<const Field> of) : of_(std::move(of)) {
    if (!of_)
        throw Error(Fault::bad_argument, "StoredField: no field; give one");
}

std::unique_ptr<LatticeField> StoredField::on(const Lattice& lattice,
                                              const openvdb::CoordBBox& region) const {
    return std::make_unique<LatticeStored>(of_->on(lattice, region), lattice);
}

} // namespace taihu
