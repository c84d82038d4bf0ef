#include "vdb_ops/csg_field.h"

#include "vdb_ops/kernels_detail.h"

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
    DifferenceBlock(Side a, Side b) : a_(std::move(a)), b_(std::move(b)) {}

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
        const Cover a = a_.cover(leaf), b = b_.cover(leaf);
        if (b != Cover::surface) {
            a_.sampler->values(leaf, out);
            return;
        }
        alignas(64) float holes[512];
        b_.sampler->values(leaf, holes);
        if (a != Cover::surface) {
            for (int i = 0; i < 512; ++i)
                out[i] = -holes[i];
            return;
        }
        alignas(64) float base[512];
        a_.sampler->values(leaf, base);
        subtract_values(base, holes, out);
    }

private:
    Side a_, b_;
};

class LatticeDifference final : public LatticeField {
public:
    LatticeDifference(std::unique_ptr<LatticeField> a, std::unique_ptr<LatticeField> b)
        : a_(std::move(a)), b_(std::move(b)) {}
    openvdb::CoordBBox bounds() const override { return a_->bounds(); }
    std::unique_ptr<BlockSampler> open(const Coord& block, Cover& cover) const override {
        Side b(*b_, block);
        if (!b.sampler && b.whole == Cover::inside) {
            cover = Cover::outside;
            return nullptr;
        }
        Side a(*a_, block);
        if (!a.sampler && (a.whole == Cover::outside || !b.sampler)) {
            cover = a.whole;
            return nullptr;
        }
        cover = Cover::surface;
        return std::make_unique<DifferenceBlock>(std::move(a), std::move(b));
    }

private:
    std::unique_ptr<LatticeField> a_, b_;
};

} // namespace

DifferenceField::DifferenceField(std::shared_ptr<const Field> a, std::shared_ptr<const Field> b)
    : a_(std::move(a)), b_(std::move(b)) {}

std::unique_ptr<LatticeField> DifferenceField::on(const Lattice& lattice,
                                                  const openvdb::CoordBBox& region) const {
    auto a = a_->on(lattice, region);
    auto b = b_->on(lattice, a->bounds()); // what lies outside of a takes nothing away
    return std::make_unique<LatticeDifference>(std::move(a), std::move(b));
}

} // namespace taihu
