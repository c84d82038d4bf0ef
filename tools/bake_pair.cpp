#include "tools/bake_pair.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "mesh_out/creases.h"
#include "mesh_out/io/mesh_file.h"
#include "mesh_out/position_grid.h"
#include "mesh_out/surface_distance.h"
#include "stats/core/error.h"
#include "stats/core/file.h"
#include "vdb_ops/level_set_box.h"
#include "vdb_ops/mesh_solid.h"
#include "vdb_ops/placed_level_set_field.h"
#include "vdb_ops/voxelize.h"

namespace taihu {
namespace {

constexpr double kSmooth_deg = 30; ///< edges of the fine mesh that turn by less are no creases
constexpr double kFarApart = 0.25; ///< farthest that they are taken to lie apart / the longest axis
constexpr double kMostApart = 2;   ///< likewise, where a cage is given
constexpr double kSamplesAlong = 512;
constexpr double kCageMargin = 1.1; ///< of a distance that was sampled

/// What is baked: a field, and its surface with normals.
struct High {
    std::shared_ptr<const Field> field;
    TriMesh surface;
    Measure measure;
    NormalsOf normals = NormalsOf::field;
};

High read_high(const SolidOptions& options, const Console& console) {
    if (is_vdb(options.path)) {
        SolidOptions level_set; // a unit and an axis are those of the other
        level_set.path = options.path;
        const Solid solid = read_solid(level_set, console, Surfaces::wanted);
        High high{solid.field, {}, solid.measure, NormalsOf::field};
        if (!high.field)
            high.field = std::make_shared<PlacedLevelSetField>(solid.grid);
        high.surface = fine_surface(*solid.grid, *high.field, console.progress);
        return high;
    }
    const std::string where = options.path.string();
    const TriMesh mesh =
        read_mesh(options.path, options.mesh_settings(), console.progress).levels.front();
    const double longest_m = bounds(mesh).longest();
    const double voxel_m = options.voxel.empty()
                               ? voxel_for(bounds(mesh), options.dim.value_or(kDefaultDim))
                               : length_m("--voxel", options.voxel, {0, longest_m});
    MeshSolid solid =
        mesh_solid(mesh, where, options.close_settings(), {voxel_m, {}, 3}, console.progress);
    console.say_all(where, solid.diagnosis.lines(voxel_m));
    return {std::move(solid.field),
            with_creases(mesh, kSmooth_deg).mesh,
            {voxel_m, longest_m},
            NormalsOf::surface};
}

/// The mesh on a lattice that a file holds, with normals.
std::pair<TriMesh, PositionGrid> read_low(const BakePair& pair, const Console& console) {
    const std::string where = pair.low.string();
    const MeshFile file = read_mesh(pair.low, pair.high.mesh_settings(), console.progress);
    TriMesh mesh = file.levels.front();
    if (file.levels.size() > 1)
        console.say("{}: the finest of {} levels taken", where, file.levels.size());
    if (!(bounds(mesh).longest() > 0))
        throw Error(Fault::bad_input, where + ": has no extent; export it again");
    const PositionGrid grid = grid_of(mesh).value_or(finest_grid(bounds(mesh)));
    for (Vec3& p : mesh.positions)
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = grid.origin[axis] +
                      std::round((p[axis] - grid.origin[axis]) / grid.step_m) * grid.step_m;
    CreasedMesh creased = with_creases(mesh, pair.crease_deg);
    if (creased.n_degenerate > 0)
        console.say("{}: {} triangles without area left out", where, creased.n_degenerate);
    return {std::move(creased.mesh), grid};
}

/// Two-sided distances of what the boxes hold are this or more.
double apart_at_least_m(const Box& a, const Box& b) {
    double most = 0;
    for (int axis = 0; axis < 3; ++axis)
        most =
            std::max({most, std::abs(a.lo[axis] - b.lo[axis]), std::abs(a.hi[axis] - b.hi[axis])});
    return most;
}

void refuse_far(const BakePair& pair, const High& high, double apart_m) {
    const double most = pair.cage.empty() ? kFarApart : kMostApart;
    if (apart_m > most * high.measure.longest_m)
        throw Error(Fault::bad_argument,
                    fmt::format("{}: lies up to {:.3g} m off {}, which is {:.3g} m long; put both "
                                "in one place (--unit, --up), or say how far to look (--cage)",
                                pair.low.string(), apart_m, pair.high.path.string(),
                                high.measure.longest_m));
}

/// How far from the low mesh the other is sought: as far as they are measured to lie apart.
double cage_m(const BakePair& pair, const High& high, const TwoSidedDistance& apart) {
    refuse_far(pair, high, apart.max_m);
    return !pair.cage.empty() ? length_m("--cage", pair.cage, high.measure)
                              : kCageMargin * apart.max_m + high.measure.voxel_m;
}

void tell(const std::string& where, const BakedLevel& baked, const Certificate& certificate,
          double reach_m, const Console& console) {
    console.say("{}: {}", where, certificate_line(certificate));
    console.say("{}: {} charts, {} x {} texels of {:.3g} m ({:.0f} % used), normals {:.2f} degrees "
                "off, {:.2f} without the map",
                where, baked.n_charts, baked.maps.normal.width, baked.maps.normal.height,
                baked.texel_m, 100 * baked.used_rel, baked.relit.mean_deg,
                baked.relit.plain_mean_deg);
    if (baked.maps.n_nearest > 0)
        console.say("{}: {} of {} texels met nothing along their normal within {:.3g} m and took "
                    "the nearest place; see --cage",
                    where, baked.maps.n_nearest, baked.maps.n_texels, reach_m);
}

} // namespace

nlohmann::ordered_json write_baked_pair(const BakePair& pair, const Console& console) {
    std::optional<FileSet> masters;
    if (!pair.files.maps.empty())
        masters.emplace(pair.files.maps);
    High high = read_high(pair.high, console);
    const auto [low, grid] = read_low(pair, console);
    const Measure measure = high.measure;
    report_stage(console.progress, "measuring how far apart they are");
    // One in another unit may be a thousand times as large: samples by its size, not by the voxel.
    const double spacing_m = std::max({measure.voxel_m, bounds(low).longest() / kSamplesAlong,
                                       bounds(high.surface).longest() / kSamplesAlong});
    refuse_far(pair, high, apart_at_least_m(bounds(low), bounds(high.surface))); // at once
    const TwoSidedDistance apart = two_sided_distance(low, high.surface, spacing_m);
    const double reach_m = cage_m(pair, high, apart);
    console.say("{}: {:.3g} m off {} at most, {:.3g} m on average; looking up to {:.3g} m along "
                "the normals",
                pair.low.string(), apart.max_m, pair.high.path.string(), apart.rms_m, reach_m);
    if (!pair.occlusion)
        high.surface.openness.assign(high.surface.positions.size(), 1);
    const BakeSource source(*high.field, std::move(high.surface),
                            {.voxel_m = measure.voxel_m,
                             .reach_m = std::max(reach_m, apart.max_m),
                             .n_rays = pair.maps.n_rays,
                             .normals = high.normals},
                            console.progress);
    const double grain_m = pair.grain.empty() ? 0 : length_m("--grain", pair.grain, measure);
    BakedLevel baked = bake_mesh(low, grid, source,
                                 {.reach_m = reach_m,
                                  .side_px = pair.maps.side_px.value_or(kSide_px),
                                  .most_side_px = pair.maps.side_px.value_or(kMostSide_px),
                                  .gutter_px = pair.maps.gutter_px,
                                  .grain_m = grain_m,
                                  .grain_contrast = pair.maps.grain_contrast,
                                  .occlusion = pair.occlusion,
                                  .masters = !pair.files.maps.empty(),
                                  .vertices = pair.maps.vertices},
                                 console.progress);
    const Certificate certificate = certify(baked.encoded.decoded);
    const std::string where = pair.files.out.string();
    tell(where, baked, certificate, reach_m, console);
    nlohmann::ordered_json report = {{"file", base_name(pair.files.out)},
                                     {"certificate", certificate_json(certificate)},
                                     {"apart_m", apart.max_m},
                                     {"apart_rms_m", apart.rms_m},
                                     {"cage_m", reach_m},
                                     {"maps", maps_json(baked)}};
    GlbSettings glb;
    if (pair.at_foot)
        glb.shift = foot_shift(certificate.box);
    const std::string bytes = format_glb(std::span(&baked.encoded, 1), glb);
    if (masters)
        masters->add_by(
            [&](const std::filesystem::path& folder) { write_maps(folder, "level0", baked.maps); });
    write_together(pair.files, masters, bytes, report, console);
    return report;
}

} // namespace taihu
