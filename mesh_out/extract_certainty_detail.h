#pragma once
#include <optional>
#include <unordered_set>
#include <vector>

#include <openvdb/openvdb.h>

#include "stats/core/box.h"
#include "vdb_ops/field.h"

namespace taihu {

/// Where the extraction of a part of a solid is sure to be that of the whole.
///
/// Most is decided by the voxels around. What is decided together, as what becomes of triangles
/// that cross, is told here by the boxes that it looks at or changes: it is as in the whole unless
/// boxes that overlap lead from it to where that is not so.
class Certainty {
public:
    /// What depends on voxels so far away at most is decided by voxels alone.
    static constexpr int kVoxels_vox = 32;
    /// Boxes of what is decided together reach so far from it at most.
    static constexpr int kTogether_vox = 16;

    /// All of a solid is there.
    Certainty() = default;
    /// \param given  the voxels whose values are those of the whole; whole leaves.
    Certainty(const openvdb::CoordBBox& given, const Lattice& lattice);

    bool is_of_all() const { return !known_; }
    /// Takes in what was decided together where boxes [m] overlap. It is certain unless one of them
    /// overlaps what was not so before.
    void decided(const std::vector<Box>& boxes);
    /// Boxes [m] of what is not certain.
    void lose(const std::vector<Box>& boxes);
    /// What was uncertain makes what is around it so, as far as this.
    void spread(int by_vox);
    /// Whether all in a box is as in the whole.
    bool holds(const openvdb::CoordBBox& voxels) const;
    bool holds(const Box& box_m) const;

private:
    using Group = std::vector<openvdb::CoordBBox>; ///< cubes
    struct Known {
        Lattice lattice;
        openvdb::CoordBBox cubes; ///< of 8^3 voxels
    };
    bool are_certain(const openvdb::CoordBBox& cubes) const;
    void touch();
    void lose(const openvdb::CoordBBox& cubes);

    std::optional<Known> known_;
    std::unordered_set<openvdb::Coord> uncertain_; ///< cubes among those
    std::vector<Group> together_;                  ///< what is certain still
};

} // namespace taihu
