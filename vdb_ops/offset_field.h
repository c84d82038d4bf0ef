#pragma once
#include <memory>

#include "vdb_ops/field.h"

namespace taihu {

// Solids made of the distance of another. The other is asked on a band wider by the distance that
// counts: time grows with that distance, and a LevelSetField cannot do it (a PlacedLevelSetField
// can). The results' distances are exact where the other's are and the nearest point of its
// surface moves along, a bound elsewhere (1-Lipschitz, never over-estimating).

/// Grown by `by_m`, or shrunk when it is negative: the distance minus `by_m`. Growing a true
/// distance rounds convex edges; one that is only a bound there (outside the edges of an
/// intersection or a difference) grows with its edges sharp. redistance() first where that matters.
class OffsetField final : public Field {
public:
    /// \throws Error bad_argument: a null field, or a distance that is not finite.
    OffsetField(std::shared_ptr<const Field> of, double by_m);
    /// \throws Error bad_argument: more than 1000 voxels.
    std::unique_ptr<LatticeField> on(const Lattice& lattice,
                                     const openvdb::CoordBBox& region) const override;
    Primitive n_primitives() const override;
    std::unique_ptr<FieldProbe> probe(const Box& region_m, double reach_m) const override;

private:
    std::shared_ptr<const Field> of_;
    double by_m_;
};

/// A wall along the surface: where the distance is between -inwards_m and outwards_m. A shell of
/// thickness t inwards is {t, 0}, a centred one {t / 2, t / 2}.
class ShellField final : public Field {
public:
    /// \throws Error bad_argument: a null field, a distance that is negative or not finite, or both
    /// 0.
    ShellField(std::shared_ptr<const Field> of, double inwards_m, double outwards_m);
    /// \throws Error bad_argument: more than 1000 voxels.
    std::unique_ptr<LatticeField> on(const Lattice& lattice,
                                     const openvdb::CoordBBox& region) const override;
    Primitive n_primitives() const override;
    std::unique_ptr<FieldProbe> probe(const Box& region_m, double reach_m) const override;

private:
    std::shared_ptr<const Field> of_;
    double inwards_m_, outwards_m_;
};

/// Everything that is not in the other. It has no bounds: only its intersection with something
/// bounded can be rasterized.
class ComplementField final : public Field {
public:
    /// \throws Error bad_argument: a null field.
    explicit ComplementField(std::shared_ptr<const Field> of);
    std::unique_ptr<LatticeField> on(const Lattice& lattice,
                                     const openvdb::CoordBBox& region) const override;
    Primitive n_primitives() const override;
    std::unique_ptr<FieldProbe> probe(const Box& region_m, double reach_m) const override;

private:
    std::shared_ptr<const Field> of_;
};

} // namespace taihu
