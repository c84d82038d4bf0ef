#pragma once
#include <vector>

#include <openvdb/openvdb.h>

#include "stats/core/progress.h"
#include "vdb_ops/clean.h"
#include "vdb_ops/components_detail.h"

namespace taihu {

/// Which parts change side, and how many pieces and bubbles they are.
struct CleanChoice {
    std::vector<char> removed; ///< by part: solid that goes
    std::vector<char> filled;  ///< by part: void that is shut, once those are gone
    CleanCounts counts;        ///< without volumes
    bool any_removed() const { return counts.n_pieces_removed > 0; }
    bool any_filled() const { return counts.n_bubbles_filled > 0; }
};

/// \param kept  by part: not to be removed whatever its size; empty: by size alone.
/// \throws Error bad_input: nothing is solid.
CleanChoice choose_parts(const std::vector<Components::Part>& parts,
                         const std::vector<Components::Contact>& contacts,
                         const CleanSettings& settings, const std::vector<char>& kept = {});

/// How many blocks of 8^3 around a leaf decide what flip() makes of it.
int flip_reach_blocks(float half_width_vox);

/// What the voxels are: whole parts, or some of a part, so that a cut leaves surface where none
/// was.
enum class Flipped { parts, cut };

/// The leaves and tiles of `grid` in `region`, with the voxels of `mask` on the other side.
/// Distances near them are rebuilt from the surface that stays. A leaf depends on what is within
/// flip_reach_blocks() of it alone.
openvdb::FloatGrid::Ptr flip(const openvdb::FloatGrid& grid, const openvdb::MaskTree& mask,
                             const openvdb::CoordBBox& region, Progress* progress,
                             Flipped what = Flipped::parts);

} // namespace taihu
