// A tile as a solid of its own: cut off at the faces of its box.
#include <algorithm>
#include <cmath>

#include "vdb_ops/combine_field.h"
#include "vdb_ops/level_set_field.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/solids_field.h"
#include "vdb_ops/tiles.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;

/// Beyond its box a tile goes on as at the nearest voxel in it: still 1-Lipschitz.
class ContinuedBlock final : public BlockSampler {
public:
    ContinuedBlock(const openvdb::FloatGrid& tile, const CoordBBox& box, float inverse_voxel)
        : accessor_(tile.getConstAccessor()), box_(box), inverse_voxel_(inverse_voxel) {}

    Cover cover(const Coord& leaf) const override {
        if (!box_.isInside(leaf) || accessor_.probeConstLeaf(leaf))
            return Cover::surface;
        return accessor_.getValue(leaf) < 0 ? Cover::inside : Cover::outside;
    }

    void values(const Coord& leaf, float* out) override {
        for (int v = 0; v < 512; ++v) {
            Coord at = leaf.offsetBy(v / 64, v / 8 % 8, v % 8);
            at.maxComponent(box_.min());
            at.minComponent(box_.max());
            out[v] = accessor_.getValue(at) * inverse_voxel_;
        }
    }

private:
    openvdb::FloatGrid::ConstAccessor accessor_;
    CoordBBox box_;
    float inverse_voxel_;
};

class LatticeContinued final : public LatticeField {
public:
    LatticeContinued(const openvdb::FloatGrid& tile, const CoordBBox& box, double voxel_m)
        : tile_(tile), box_(box), inverse_voxel_(static_cast<float>(1 / voxel_m)) {}
    CoordBBox bounds() const override {
        CoordBBox all = box_;
        all.expand(kBlock);
        return all;
    }
    std::unique_ptr<BlockSampler> open(const Coord&, Cover& cover) const override {
        cover = Cover::surface;
        return std::make_unique<ContinuedBlock>(tile_, box_, inverse_voxel_);
    }

private:
    static constexpr int kBlock = BlockSampler::kBlock;
    const openvdb::FloatGrid& tile_;
    CoordBBox box_;
    float inverse_voxel_;
};

class ContinuedField final : public Field {
public:
    ContinuedField(const openvdb::FloatGrid& tile, const CoordBBox& box) : tile_(tile), box_(box) {}
    std::unique_ptr<LatticeField> on(const Lattice& lattice, const CoordBBox&) const override {
        return std::make_unique<LatticeContinued>(tile_, box_, lattice.voxel_m);
    }
    Primitive n_primitives() const override { return 1; }
    std::unique_ptr<FieldProbe> probe(const Box& region_m, double reach_m) const override {
        return LevelSetField(tile_.copy()).probe(region_m, reach_m);
    }

private:
    const openvdb::FloatGrid& tile_;
    CoordBBox box_;
};

} // namespace

openvdb::FloatGrid::Ptr tile_solid(const openvdb::FloatGrid& tile, const CoordBBox& box,
                                   Progress* progress) {
    const Lattice lattice = lattice_of(tile);
    const auto world = [&](const Coord& c) {
        return lattice.origin + lattice.voxel_m * Vec3{double(c.x()), double(c.y()), double(c.z())};
    };
    // Half a voxel within the outermost voxels, so that the faces are between samples.
    const Vec3 lo = world(box.min()), hi = world(box.max());
    const Vec3 half = 0.5 * (hi - lo) - 0.5 * lattice.voxel_m * Vec3{1, 1, 1};
    const auto cut = std::make_shared<SolidsField>(
        std::vector<AnalyticSolid>{{BoxSolid{half, 0}, Similarity::translation(0.5 * (lo + hi))}});
    const CombineField both(Combine::intersect, {std::make_shared<ContinuedField>(tile, box), cut});
    return rasterize(both, lattice, progress);
}

} // namespace taihu
