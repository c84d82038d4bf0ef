#pragma once
#include <cstdint>

#include "vdb_ops/field.h"
#include "vdb_ops/solids.h"

namespace taihu {

/// An analytic solid in the voxel coordinates of a lattice.
struct VoxelSolid {
    enum class Kind : std::int8_t {
        ball,      ///< size: radius
        ellipsoid, ///< semi axes / the shortest, then the shortest
        box,       ///< half extents of the core
        cylinder,  ///< radius and half height of the core
        cone,      ///< bottom and top radius, half height
        capsule,   ///< radius, half length
        torus,     ///< radius of the ring, of the tube
        half_space,
    };
    Kind kind = Kind::half_space;
    double size[4] = {}; ///< [voxels]
    double round = 0;    ///< radius of the edges, outside of the core
    double turn[3][3];   ///< row k: the solid's axis k
    double center[3];
    double lo[3], hi[3]; ///< its box

    VoxelSolid(const AnalyticSolid& solid, const Lattice& lattice);
};

/// The distances [voxels] at 8 points along z: `first`, then `step` apart.
void solid_row(const VoxelSolid& solid, const double* first, double step, double* distances);

/// The distance [voxels] at one point: as in a row of step 0.
double solid_distance(const VoxelSolid& solid, const double* point);

/// values[512] = min(values, distances) for the voxels of a leaf, whose first one is `leaf`; rows
/// farther than `half_width` from the solid's box are left alone.
void min_solid(const VoxelSolid& solid, const int* leaf, double half_width, float* values);

} // namespace taihu
