#pragma once
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
    /// The same without rims: the nearest point of the face at `p`, held to the cell.
    LabelledPoint on_face(const Vec3& p, const Box& cell) const;
    /// The face at a point.
    PrimitiveSet label(const Vec3& p) const { return PrimitiveSet(field_.at(p).primitive); }
    bool is_on(const Vec3& p) const;
    /// Whether faces of a negative and a positive pair of corners join those inside: by the saddle
    /// between the voxels a, b, c, d round a face, of which a and c are inside or b and d are.
    bool joins(const std::array<openvdb::Coord, 4>& corners) const;

private:
    // Without a place in the tree's list of accessors.
    openvdb::tree::ValueAccessor<const openvdb::FloatTree, false> accessor_;
    const FieldProbe& field_;
    Lattice lattice_;
};

/// `p` held to a box.
Vec3 held(const Vec3& p, const Box& box);
Vec3 mean_of(std::span<const Crossing> crossings);

} // namespace taihu
