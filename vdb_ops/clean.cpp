#include "vdb_ops/clean.h"

#include <cmath>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/combine_field.h"
#include "vdb_ops/flips_detail.h"
#include "vdb_ops/necks_detail.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/solids_field.h"
#include "vdb_ops/volume.h"

namespace taihu {

std::string foot_line(const CleanCounts& counts) {
    const Foot& foot = *counts.foot;
    return "stands tilted by up to " + rounded(foot.tilt_deg) + " degrees: " +
           (foot.cut_m > 0 ? rounded(foot.cut_m) + " m cut off below (" + rounded(counts.foot_m3) +
                                 " m^3), a foot of "
                           : "nothing to cut, a foot of ") +
           rounded(foot.contact_m2) + " m^2";
}

std::optional<std::string> crumbled_line(const CleanCounts& counts) {
    const double share = counts.removed_m3 / counts.before_m3;
    if (!(share > 0.05))
        return std::nullopt;
    return "but a share of " + rounded(share) +
           " of the solid was in these pieces; where its walls are thinner than a voxel, a smaller "
           "voxel keeps them";
}

std::vector<std::string> cleaning_lines(const CleanCounts& counts) {
    std::vector<std::string> lines;
    if (counts.n_necked > 0)
        lines.push_back(std::to_string(counts.n_necked) + " parts on thin necks cut off (" +
                        rounded(counts.necked_m3) + " m^3)");
    if (counts.n_pieces_removed + counts.n_bubbles_filled > 0)
        lines.push_back(
            std::to_string(counts.n_pieces_removed) + " of " + std::to_string(counts.n_pieces) +
            " pieces removed (" + rounded(counts.removed_m3) + " m^3), " +
            std::to_string(counts.n_bubbles_filled) + " of " + std::to_string(counts.n_bubbles) +
            " sealed bubbles filled (" + rounded(counts.filled_m3) + " m^3)");
    if (const auto line = crumbled_line(counts))
        lines.push_back(*line);
    if (counts.foot)
        lines.push_back(foot_line(counts));
    return lines;
}

void check_clean_settings(const CleanSettings& settings) {
    if (!(settings.min_neck_m >= 0) || !std::isfinite(settings.min_neck_m))
        throw Error(Fault::bad_argument,
                    "clean: min_neck_m is " + shortest(settings.min_neck_m) + ", must be >= 0");
    if (settings.min_neck_m > 0 && !settings.n_pieces)
        throw Error(Fault::bad_argument, "clean: thin necks are cut to drop what hangs on them; "
                                         "say how many pieces stay, not all");
    if (!(settings.foot_deg >= 0 && settings.foot_deg <= 60))
        throw Error(Fault::bad_argument,
                    "clean: foot_deg is " + shortest(settings.foot_deg) + ", must be 0..60");
}

std::shared_ptr<const Field> cleaned_field(std::shared_ptr<const Field> field,
                                           const CleanCounts& counts) {
    if (!field || counts.n_necked > 0)
        return nullptr;
    if (!counts.foot || counts.foot->cut_m == 0)
        return field;
    auto below = std::make_shared<SolidsField>(std::vector<AnalyticSolid>{
        {HalfSpaceSolid{}, Similarity::translation({0, counts.foot->y_m, 0})}});
    return std::make_shared<CombineField>(
        Combine::subtract,
        std::vector<std::shared_ptr<const Field>>{std::move(field), std::move(below)});
}

namespace {

/// Cut until what is left stands: what a cut sets free moves the centre of mass.
void stand(CleanResult& result, const CleanSettings& settings, Progress* progress) {
    constexpr int kMostCuts = 16;
    CleanSettings rest = settings;
    rest.min_neck_m = rest.foot_deg = 0;
    double cut_m = 0; // of the cuts before
    for (int i = 0; i < kMostCuts; ++i) {
        report_stage(progress, "looking for a foot");
        result.foot = find_foot(*result.solid, settings.foot_deg);
        if (!result.foot)
            break;
        const bool stands = result.foot->cut_m == 0;
        cut_m = result.foot->cut_m += cut_m;
        if (stands)
            return;
        const auto cut = cut_below(*result.solid, result.foot->y_m);
        result.foot_m3 += volume_m3(*result.solid) - volume_m3(*cut);
        const CleanResult again = clean(*cut, rest, progress);
        result.n_pieces_removed += again.n_pieces_removed;
        result.removed_m3 += again.removed_m3;
        result.n_bubbles_filled += again.n_bubbles_filled;
        result.filled_m3 += again.filled_m3;
        result.solid = again.solid;
    }
    throw Error(Fault::numeric, "clean: the solid stands tilted by " + shortest(settings.foot_deg) +
                                    " degrees on no cut below half its height; ask for less, or "
                                    "turn it");
}

} // namespace

CleanResult clean(const openvdb::FloatGrid& solid, const CleanSettings& settings,
                  Progress* progress) {
    lattice_of(solid);
    check_clean_settings(settings);
    if (settings.foot_deg > 0) {
        CleanSettings rest = settings;
        rest.foot_deg = 0;
        CleanResult result = clean(solid, rest, progress);
        stand(result, settings, progress);
        return result;
    }
    if (settings.min_neck_m > 0) {
        CleanSettings rest = settings;
        rest.min_neck_m = 0;
        const Necked necked = find_necked(solid, settings.min_neck_m, *settings.n_pieces, progress);
        if (necked.n_pieces > 0)
            rest.n_pieces = necked.n_pieces;
        if (necked.n_parts == 0)
            return clean(solid, rest, progress);
        const auto cut =
            flip(solid, necked.voxels, openvdb::CoordBBox::inf(), progress, Flipped::cut);
        CleanResult result = clean(*cut, rest, progress);
        result.n_necked = necked.n_parts;
        result.necked_m3 = volume_m3(solid) - volume_m3(*cut);
        return result;
    }
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
    const double before_m3 = result.before_m3 = volume_m3(solid);
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
