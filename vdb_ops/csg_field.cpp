#include "vdb_ops/csg_field.h"

#include <algorithm>

namespace taihu {
namespace {

using openvdb::Coord;

/// A side of the difference inside a block: a sampler, or one cover for all of it.
struct Side {
    Cover whole = Cover::outside;
    std::unique_ptr<BlockSampler> sampler;

    Side(const LatticeField& field, const Coord& block) : sampler(field.open(block, whole)) {}
    Cover cover(const Coord& leaf) const { return sampler ? sampler->cover(leaf) : whole; }
};

class DifferenceBlock final : public BlockSampler {
public:
    DifferenceBlock(Side a, Side b, float half_width)
        : a_(std::move(a)), b_(std::move(b)), half_width_(half_width) {}

    Cover cover(const Coord& leaf) const override {
        const Cover b = b_.cover(leaf);
        if (b == Cover::inside)
            return Cover::outside;
        const Cover a = a_.cover(leaf);
        if (a == Cover::outside || b == Cover::outside)
            return a;
        return Cover::surface;
    }

    void values(const Coord& leaf, float* out) override {
        if (a_.cover(leaf) == Cover::surface)
            a_.sampler->values(leaf, out);
        else
            std::fill(out, out + 512, -half_width_);
        if (b_.cover(leaf) == Cover::surface)
            b_.sampler->subtract_from(leaf, out);
    }

    const Leaf* stored(const Coord& leaf) const override {
        return a_.sampler && b_.cover(leaf) == Cover::outside ? a_.sampler->stored(leaf) : nullptr;
    }

private:
    Side a_, b_;
    float half_width_;
};

class LatticeDifference final : public LatticeField {
public:
    LatticeDifference(std::unique_ptr<LatticeField> a, std::unique_ptr<LatticeField> b,
                      float half_width)
        : a_(std::move(a)), b_(std::move(b)), half_width_(half_width) {}
    openvdb::CoordBBox bounds() const override { return a_->bounds(); }
    std::unique_ptr<BlockSampler> open(const Coord& block, Cover& cover) const override {
        Side a(*a_, block);
        if (!a.sampler && a.whole == Cover::outside) {
            cover = Cover::outside;
            return nullptr;
        }
        Side b(*b_, block);
        if (!b.sampler) {
            cover = b.whole == Cover::inside ? Cover::outside : a.whole;
            return b.whole == Cover::inside ? nullptr : std::move(a.sampler);
        }
        cover = Cover::surface;
        return std::make_unique<DifferenceBlock>(std::move(a), std::move(b), half_width_);
    }

private:
    std::unique_ptr<LatticeField> a_, b_;
    float half_width_;
};

} // namespace

DifferenceField::DifferenceField(std::shared_ptr<const Field> a, std::shared_ptr<const Field> b)
    : a_(std::move(a)), b_(std::move(b)) {}

std::unique_ptr<LatticeField> DifferenceField::on(const Lattice& lattice,
                                                  const openvdb::CoordBBox& region) const {
    auto a = a_->on(lattice, region);
    auto b = b_->on(lattice, a->bounds()); // what lies outside of a takes nothing away
    return std::make_unique<LatticeDifference>(std::move(a), std::move(b), lattice.half_width_vox);
}

} // namespace taihu
