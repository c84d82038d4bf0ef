#pragma once
#include <array>
#include <optional>
#include <span>

#include <openvdb/openvdb.h>

#include "vdb_ops/field.h"

namespace taihu {

/// Where a surface passes an edge between two voxels.
struct Crossing {
    Vec3 point;  ///< [m]
    Vec3 normal; ///< of length 1, or 0
    Primitive primitive = 0;
    bool known = false; ///< by the field; else it is the grid's, without normal and primitive
};

struct LabelledPoint {
    Vec3 point;
    PrimitiveSet labels;
};

/// Points of the surface of a field, of which a grid says where it is inside. For one thread.
class SurfacePoints {
public:
    SurfacePoints(const openvdb::FloatGrid& solid, const FieldProbe& field, const Lattice& lattice)
        : accessor_(solid.tree()), field_(field), lattice_(lattice) {}

    double voxel_m() const { return lattice_.voxel_m; }
    const FieldProbe& field() const { return field_; }
    Vec3 voxel(const openvdb::Coord& c) const {
        return lattice_.origin +
               Vec3{double(c.x()), double(c.y()), double(c.z())} * lattice_.voxel_m;
    }
    /// On the edge from a voxel to the next one along `axis`, of which one is inside.
    Crossing on_edge(const openvdb::Coord& voxel, int axis) const;
    /// Where the surface is in a cell, of which it passes edges at `crossings`: in a corner, on a
    /// rim or a face, up to `slack_m` outside of the cell, or else on the face in it.
    LabelledPoint place(std::span<const Crossing> crossings, const Box& cell, double slack_m) const;
    /// The same without rims: a point of the face at `p`, held to the cell.
    LabelledPoint on_face(const Vec3& p, const Box& cell) const;
    /// From a point of a rim a share of the way to the crossings of one of its faces: that with the
    /// most of them has rank 0.
    std::optional<LabelledPoint> aside(const LabelledPoint& p, std::span<const Crossing> crossings,
                                       std::size_t rank, double share) const;
    /// What is left in a cell of a point outside of it: of a corner one of its rims, of others the
    /// face.
    LabelledPoint back_in(const LabelledPoint& p, const Box& cell) const;
    /// The face at a point.
    PrimitiveSet label(const Vec3& p) const { return PrimitiveSet(field_.at(p).primitive); }
    bool is_on(const Vec3& p) const;
    /// Whether a face whose corners alternate joins those inside: where the field is inside, or
    /// outside, all along one of its diagonals; else by the saddle of its values.
    /// \param corners  the voxels in their order around it.
    bool joins(const std::array<openvdb::Coord, 4>& corners) const;

private:
    Crossing found_on_edge(const openvdb::Coord& voxel, int axis) const;
    /// The point of a face near the mean of its crossings; none where that is far off.
    std::optional<Vec3> beside(std::span<const Crossing> crossings, const Vec3& mean) const;
    std::optional<LabelledPoint> settle(PrimitiveSet set, const Vec3& from, const Box& cell,
                                        double slack_m) const;
    /// The middle of a rim that passes two faces of the cell between crossings.
    std::optional<Vec3> between_faces(const PrimitiveSet& set, std::span<const Crossing> crossings,
                                      const Box& cell) const;
    /// Where the primitives of two crossings in a face of the cell meet in that face.
    std::optional<Vec3> on_cell_face(const Crossing& a, const Crossing& b, int axis,
                                     const Box& cell) const;
    /// The nearest rim in the cell, of three primitives.
    std::optional<LabelledPoint> on_rim(const PrimitiveSet& set, const Vec3& from,
                                        const Box& cell) const;
    /// From a point of a rim along its tangent to the middle of what of that is in the cell.
    Vec3 along_rim(const PrimitiveSet& set, const Vec3& p, const Box& cell) const;
    /// Where primitives meet, in the cell if they do so there.
    std::optional<Vec3> meeting(const PrimitiveSet& set, const Vec3& from, const Box& cell,
                                double slack_m) const;

    // Without a place in the tree's list of accessors.
    openvdb::tree::ValueAccessor<const openvdb::FloatTree, false> accessor_;
    const FieldProbe& field_;
    Lattice lattice_;
};

/// `p` held to a box.
Vec3 held(const Vec3& p, const Box& box);
Vec3 mean_of(std::span<const Crossing> crossings);
/// Whether no primitive among them turns so much that it has an edge of its own.
bool is_smooth(std::span<const Crossing> crossings);

} // namespace taihu
