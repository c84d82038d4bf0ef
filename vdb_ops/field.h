#pragma once
#include <memory>

#include <openvdb/openvdb.h>

#include "vdb_ops/field_probe.h"

namespace taihu {

/// Where a field is sampled: voxel (i, j, k) lies at origin + voxel_m * (i, j, k).
struct Lattice {
    double voxel_m = 0;       ///< > 0
    Vec3 origin;              ///< world position of voxel (0, 0, 0) [m]
    float half_width_vox = 3; ///< distances beyond this are clamped to it [voxels], 2..16
    friend bool operator==(const Lattice&, const Lattice&) = default;
};

/// What is known of a region without evaluating it: further than the half width from the surface on
/// one side, or perhaps near it.
enum class Cover { outside, inside, surface };

/// A field inside one block of 64^3 voxels, for one thread. Leaves are cubes of 8^3 voxels, named
/// by their first voxel; their 512 values run z fastest.
class BlockSampler {
public:
    using Leaf = openvdb::FloatTree::LeafNodeType;
    static constexpr int kBlock = 64; ///< voxels along an edge of a block
    static constexpr int kLeaf = 8;   ///< and of a leaf

    virtual ~BlockSampler() = default;
    /// Conservative and cheap; `leaf` lies in this block.
    virtual Cover cover(const openvdb::Coord& leaf) const = 0;
    /// The signed distances of a leaf whose cover() is `surface` [voxels], negative inside. Beyond
    /// the half width any value beyond it will do.
    virtual void values(const openvdb::Coord& leaf, float* out) = 0;
    /// values = max(values, -own values): takes this solid away from another, for a leaf whose
    /// cover() is `surface`.
    virtual void subtract_from(const openvdb::Coord& leaf, float* values);
    /// The leaf of a level set on this very lattice [m] that values() would only repeat, or null.
    virtual const Leaf* stored(const openvdb::Coord& leaf) const;
};

/// A field prepared for one lattice. Thread-safe.
class LatticeField {
public:
    virtual ~LatticeField() = default;
    /// All voxels outside this box are outside the solid by at least the half width.
    virtual openvdb::CoordBBox bounds() const = 0;
    /// The part of the field that is enough inside the block whose first voxel is `block`: null and
    /// `cover` when the whole block is on one side.
    virtual std::unique_ptr<BlockSampler> open(const openvdb::Coord& block, Cover& cover) const = 0;
};

/// A solid as a signed distance: world units, negative inside, 1-Lipschitz, never over-estimating.
class Field {
public:
    virtual ~Field() = default;
    /// Prepare for sampling on `lattice`, in blocks that meet `region` [voxels]. The field must
    /// outlive what it returns.
    virtual std::unique_ptr<LatticeField> on(const Lattice& lattice,
                                             const openvdb::CoordBBox& region) const = 0;
    /// How many primitives bound it.
    virtual Primitive n_primitives() const = 0;
    /// Prepare for single points of a finite box. The field must outlive what it returns.
    /// \param reach_m  > 0: distances up to it are told, beyond it only the sign.
    virtual std::unique_ptr<FieldProbe> probe(const Box& region_m, double reach_m) const = 0;
};

} // namespace taihu
