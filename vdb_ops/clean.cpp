#include "vdb_ops/clean.h"

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/flips_detail.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/volume.h"

namespace taihu {

std::vector<std::string> cleaning_lines(const CleanCounts& counts) {
    if (counts.n_pieces_removed + counts.n_bubbles_filled == 0)
        return {};
    return {std::to_string(counts.n_pieces_removed) + " of " + std::to_string(counts.n_pieces) +
            " pieces removed (" + rounded(counts.removed_m3) + " m^3), " +
            std::to_string(counts.n_bubbles_filled) + " of " + std::to_string(counts.n_bubbles) +
            " sealed bubbles filled (" + rounded(counts.filled_m3) + " m^3)"};
}

CleanResult clean(const openvdb::FloatGrid& solid, const CleanSettings& settings,
                  Progress* progress) {
    lattice_of(solid);
    openvdb::CoordBBox box;
    if (!solid.tree().evalLeafBoundingBox(box))
        throw Error(Fault::bad_input,
                    "clean: nothing is left of the solid; use fewer or smaller holes");
    CleanResult result;
    openvdb::MaskTree removed, filled;
    {
        const Components components(solid, box, box);
        const CleanChoice choice =
            choose_parts(components.parts(), components.contacts(), settings);
        static_cast<CleanCounts&>(result) = choice.counts;
        components.mark(choice.removed, removed);
        components.mark(choice.filled, filled);
    }
    const auto everywhere = openvdb::CoordBBox::inf();
    const double before_m3 = volume_m3(solid);
    double now_m3 = before_m3;
    if (result.n_pieces_removed > 0) {
        result.solid = flip(solid, removed, everywhere, progress);
        now_m3 = volume_m3(*result.solid);
        result.removed_m3 = before_m3 - now_m3;
    }
    if (result.n_bubbles_filled > 0) {
        result.solid = flip(result.solid ? *result.solid : solid, filled, everywhere, progress);
        result.filled_m3 = volume_m3(*result.solid) - now_m3;
    }
    if (!result.solid)
        result.solid = solid.deepCopy();
    return result;
}

} // namespace taihu
