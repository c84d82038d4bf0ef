#include "vdb_ops/level_set_field.h"

#include <algorithm>
#include <cmath>

#include "stats/core/error.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

using openvdb::Coord;

class LevelSetBlock final : public BlockSampler {
public:
    LevelSetBlock(const openvdb::FloatGrid& grid, const Lattice& lattice)
        : accessor_(grid.getConstAccessor()), half_width_(lattice.half_width_vox),
          inverse_voxel_(static_cast<float>(1 / lattice.voxel_m)) {}

    Cover cover(const Coord& leaf) const override {
        if (accessor_.probeConstLeaf(leaf))
            return Cover::surface;
        return accessor_.getValue(leaf) < 0 ? Cover::inside : Cover::outside;
    }

    void values(const Coord& leaf, float* out) override {
        // Inactive voxels lie beyond the band; their values may round to a little less.
        const auto& in = *accessor_.probeConstLeaf(leaf);
        for (openvdb::Index i = 0; i < 512; ++i)
            out[i] = in.isValueOn(i)
                         ? std::clamp(in.getValue(i) * inverse_voxel_, -half_width_, half_width_)
                         : std::copysign(half_width_, in.getValue(i));
    }

private:
    openvdb::FloatGrid::ConstAccessor accessor_;
    float half_width_, inverse_voxel_;
};

class LatticeLevelSet final : public LatticeField {
public:
    LatticeLevelSet(const openvdb::FloatGrid& grid, const Lattice& lattice)
        : grid_(grid), lattice_(lattice) {
        // Leaves, not active voxels: a leaf's box is what the blocks have to cover.
        grid.tree().evalLeafBoundingBox(box_);
    }
    openvdb::CoordBBox bounds() const override { return box_; }
    std::unique_ptr<BlockSampler> open(const Coord&, Cover& cover) const override {
        cover = Cover::surface;
        return std::make_unique<LevelSetBlock>(grid_, lattice_);
    }

private:
    const openvdb::FloatGrid& grid_;
    Lattice lattice_;
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
