#pragma once
#include <vector>

#include <openvdb/openvdb.h>

#include "stats/core/progress.h"
#include "stats/core/sphere.h"

namespace taihu {

struct CoarserSettings {
    int coarser = 1;   ///< voxels of the solid along one of the result, 1..8
    double grow_m = 0; ///< 0..1 voxel of the result; from half of one on no wall is lost
};

struct CoarserSolid {
    openvdb::FloatGrid::Ptr solid; ///< half band 3 voxels; null when no voxel lies inside
    /// Where it was filled, the widest first: balls that fit into the voids of the solid there, as
    /// many as it takes to come within 2 voxels of the result of every point of them.
    std::vector<Sphere> closed;
};

/// A solid for looking at from far away, on every n-th voxel of its lattice: grown, so that walls
/// thinner than the new voxels stay whole and ways narrower than twice as much are shut; and filled
/// where then nothing leads in from outside. Voids that were sealed before stay.
///
/// The new surface lies `grow_m` off the old one, but where ways were shut; the old one lies no
/// farther from the new one but in creases, in what was filled, and in ways that were too narrow.
/// Distances are those to the places where lines of voxels cross the surface, within 3 voxels the
/// grid's own where they agree. The same bits on any number of threads. Time O(voxels of the box),
/// by parts of 256 voxels an axis: 8 bytes for each voxel of one.
/// \throws Error bad_argument: as lattice_of(), or a setting out of range; cancelled: within a
/// part.
CoarserSolid coarser_solid(const openvdb::FloatGrid& solid, const CoarserSettings& settings,
                           Progress* progress = nullptr);

} // namespace taihu
