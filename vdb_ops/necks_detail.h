#pragma once
#include <cstddef>

#include <openvdb/openvdb.h>

#include "stats/core/progress.h"

namespace taihu {

/// The voxels of a solid that hang on what stays by necks thinner than `min_neck_m` alone.
struct Necked {
    openvdb::MaskTree voxels;
    std::size_t n_parts = 0;
    std::size_t n_pieces = 0; ///< that hold the cores that stay: two may be in one
};

/// What is deeper than half the thickness falls into cores; the `n_stay` largest stay. The rest of
/// a solid goes with the core that is nearest on a way inside it (steps over faces, edges and
/// corners), with one that stays at ties. Solids without a core, or without one that stays, are
/// left to clean(). Deterministic. \throws Error as widen_band().
Necked find_necked(const openvdb::FloatGrid& solid, double min_neck_m, std::size_t n_stay,
                   Progress* progress);

} // namespace taihu
