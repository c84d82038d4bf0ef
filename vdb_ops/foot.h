#pragma once
#include <optional>

#include <openvdb/openvdb.h>

#include "stats/core/vec3.h"

namespace taihu {

/// A horizontal plane that a solid, cut off below it, stands on.
struct Foot {
    double y_m = 0;        ///< of the plane
    double cut_m = 0;      ///< above the lowest point; 0: it stands as it is
    double contact_m2 = 0; ///< of the solid in the plane
    double outline_m2 = 0; ///< of the convex hull of that
    double tilt_deg = 0;   ///< it does not fall over when tilted by less than this
    Vec3 center_of_mass;   ///< of what is above
};

/// The lowest plane between two layers of voxels on which the solid above it stands tilted by up to
/// `tilt_deg`: the centre of mass of an even density stays over the convex hull of the section, the
/// smaller of the two layers'. Uncut, it stands on what is within a tenth of a voxel of its lowest
/// point. Up to half the height; nothing when there is none. Centres and hulls are those of voxels,
/// so within half a voxel. O(voxels inside) at most, O(leaves) mostly.
/// \throws Error bad_argument: as lattice_of(), a tilt out of (0, 60].
std::optional<Foot> find_foot(const openvdb::FloatGrid& solid, double tilt_deg);

/// What is above the plane `y_m`, on the same lattice.
openvdb::FloatGrid::Ptr cut_below(const openvdb::FloatGrid& solid, double y_m);

} // namespace taihu
