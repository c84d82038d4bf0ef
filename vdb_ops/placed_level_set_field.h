#pragma once
#include <functional>
#include <mutex>

#include <openvdb/openvdb.h>

#include "vdb_ops/field.h"
#include "vdb_ops/similarity.h"

namespace taihu {

/// A level set anywhere: turned, scaled, moved, on any lattice, on a band of any width.
///
/// Values between voxels are trilinear, held within what 1-Lipschitz distances through the eight
/// voxels around allow. Where the band asked for reaches farther than the grid's, the grid is
/// widened first (widen_band()), so that no clamped value is ever taken for a distance. On its own
/// lattice and not placed, the grid's values are handed on as they stand.
///
/// Details finer than a voxel of the lattice are aliased: sample a fine level set on a lattice not
/// much coarser. on() makes the widened band, of the half width asked for plus 2 of the grid's own
/// voxels; blocks are then random access. The widest band made so far is kept.
class PlacedLevelSetField final : public Field {
public:
    /// The same level set on a band of this half width [voxels].
    using Widen = std::function<openvdb::FloatGrid::ConstPtr(float half_width_vox)>;

    /// \param widen  for wider bands, where something better than widen_band() is known.
    /// \throws Error bad_argument: null, or as lattice_of().
    explicit PlacedLevelSetField(openvdb::FloatGrid::ConstPtr grid, const Similarity& at = {},
                                 Widen widen = {});
    /// \throws Error bad_argument: a band of more than 1000 of the grid's voxels; unsupported: as
    /// widen_band().
    std::unique_ptr<LatticeField> on(const Lattice& lattice,
                                     const openvdb::CoordBBox& region) const override;
    Primitive n_primitives() const override { return 1; }
    /// Tells distances up to 14 of the grid's voxels at most.
    std::unique_ptr<FieldProbe> probe(const Box& region_m, double reach_m) const override;

private:
    /// On a band of at least this half width [voxels].
    openvdb::FloatGrid::ConstPtr as_wide_as(double half_width_vox) const;

    openvdb::FloatGrid::ConstPtr grid_;
    Similarity at_;
    Widen widen_;
    mutable std::mutex mutex_;
    mutable openvdb::FloatGrid::ConstPtr widest_;
};

} // namespace taihu
