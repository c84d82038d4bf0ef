#pragma once
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "stats/core/progress.h"
#include "vdb_ops/field.h"
#include "vdb_ops/foot.h"

namespace taihu {

struct CleanSettings {
    std::optional<std::size_t> n_pieces =
        1;                    ///< keep this many of the largest solids; all when absent
    bool fill_bubbles = true; ///< fill voids that no way leads to from outside
    /// Parts that hang on by necks thinner than this alone are pieces of their own [m]; 0: none
    /// are. Needs `n_pieces`, and the whole in memory.
    double min_neck_m = 0;
    /// Cut flat below, so that it stands tilted by up to this (foot.h) [degrees], 0..60; 0: not
    /// cut. Needs the whole in memory. What the cut sets free is cleaned again.
    double foot_deg = 0;
};

/// What was found and done.
struct CleanCounts {
    std::size_t n_necked = 0; ///< parts on thin necks, cut off before all else
    double necked_m3 = 0;     ///< volume that went with them
    std::size_t n_pieces = 0; ///< found
    std::size_t n_pieces_removed = 0;
    std::size_t n_bubbles = 0; ///< found, once the pieces are gone
    std::size_t n_bubbles_filled = 0;
    double before_m3 = 0;     ///< volume that pieces and bubbles were looked for in
    double removed_m3 = 0;    ///< volume of the pieces that went
    double filled_m3 = 0;     ///< volume of the bubbles that were filled
    std::optional<Foot> foot; ///< when it was asked for; cut_m is of all cuts together
    double foot_m3 = 0;       ///< volume that was cut off for it
};

/// \throws Error bad_argument: a setting out of range.
void check_clean_settings(const CleanSettings& settings);

/// The field of what clean() made of a solid: cut flat where that was. Pieces removed and bubbles
/// filled are still in it. Null, as when `field` is, where necks were cut: no field has that
/// surface.
std::shared_ptr<const Field> cleaned_field(std::shared_ptr<const Field> field,
                                           const CleanCounts& counts);

/// What it stands on, for people; of counts that have a foot.
std::string foot_line(const CleanCounts& counts);

/// For people, where more than a twentieth of the solid went as loose pieces.
std::optional<std::string> crumbled_line(const CleanCounts& counts);

/// A line for people on each kind of thing that was removed or filled; none where nothing was.
std::vector<std::string> cleaning_lines(const CleanCounts& counts);

struct CleanResult : CleanCounts {
    openvdb::FloatGrid::Ptr solid; ///< a new grid on the same lattice
};

/// Loose fragments away and sealed bubbles shut. Solid and void voxels connect over faces; the
/// largest piece is the one of most voxels, at ties the one that begins first. Distances near what
/// went are rebuilt from the surface that stays (within 0.2 voxel there, unchanged elsewhere). The
/// same bits on any number of threads. O(leaves), plus 1 KiB a leaf. \throws Error bad_argument as
/// lattice_of(), or a thickness that is negative, or given with all pieces; bad_input: nothing
/// solid is there, or the box of the solid
///   holds more than 2^31 leaves; numeric: no foot lets it stand.
CleanResult clean(const openvdb::FloatGrid& solid, const CleanSettings& settings = {},
                  Progress* progress = nullptr);

} // namespace taihu
