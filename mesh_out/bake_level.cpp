#include "mesh_out/bake_level.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "mesh_out/chart_atlas.h"
#include "mesh_out/extract.h"
#include "stats/core/error.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

constexpr int kLeastSide_px = 64;
constexpr double kMostRelit_deg = 5; ///< from which on a map is made finer, up to its side

/// An atlas no larger than its texels need be.
ChartAtlas coarse_enough(const TriMesh& mesh, const BakeLevelSettings& settings,
                         Progress* progress) {
    AtlasSettings s{.side_px = settings.side_px, .gutter_px = settings.gutter_px};
    ChartAtlas atlas = chart_atlas(mesh, s, progress);
    while (atlas.texel_m < settings.texel_m && s.side_px >= 2 * kLeastSide_px) {
        s.side_px /= 2;
        try {
            ChartAtlas half = chart_atlas(mesh, s, progress);
            if (half.texel_m > settings.texel_m)
                break;
            atlas = std::move(half);
        } catch (const Error& e) { // no room for so many charts
            if (e.fault() != Fault::numeric)
                throw;
            break;
        }
    }
    return atlas;
}

std::vector<VertexValues> vertex_values(const TriMesh& mesh, const BakeSource& fine, double reach_m,
                                        Progress* progress) {
    std::vector<VertexValues> out = {{"_CURVATURE", std::vector<float>(mesh.positions.size())},
                                     {"_DISPLACEMENT", std::vector<float>(mesh.positions.size())}};
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, mesh.positions.size(), 256), [&](const auto& range) {
            check_cancelled(progress);
            for (std::size_t i = range.begin(); i < range.end(); ++i) {
                const auto place =
                    fine.meet(mesh.positions[i], normalized(mesh.normals[i]), reach_m);
                out[0].values[i] = static_cast<float>(fine.curvature_at(place.point));
                out[1].values[i] = static_cast<float>(place.offset_m);
            }
        });
    return out;
}

BakedLevel bake_atlas(const ChartAtlas& atlas, const PositionGrid& grid, const BakeSource& fine,
                      const BakeLevelSettings& settings, Progress* progress) {
    BakedLevel out;
    out.n_charts = atlas.charts.size();
    out.texel_m = atlas.texel_m;
    out.used_rel = atlas.used_rel;
    out.most_stretch = atlas.most_stretch;
    out.stretched_area_rel = atlas.stretched_area_rel;
    std::vector<VertexValues> values;
    if (settings.vertices)
        values = vertex_values(atlas.textured.mesh, fine, settings.reach_m, progress);
    out.encoded = encode_draco(atlas.textured, grid, values);
    check_cancelled(progress);
    const TexturedMesh decoded{out.encoded.decoded, out.encoded.texture, out.encoded.tangents};
    report_stage(progress, "baking");
    out.maps = bake(decoded, fine,
                    {.reach_m = settings.reach_m,
                     .side_px = atlas.side_px,
                     .gutter_px = settings.gutter_px,
                     .masters = settings.masters,
                     .grain_m = settings.grain_m,
                     .grain_contrast = settings.grain_contrast},
                    progress);
    report_stage(progress, "judging the maps");
    out.relit = relit_error(decoded, fine, out.maps, settings.reach_m, progress);
    out.encoded.normal_png = normal_png(out.maps);
    if (settings.occlusion)
        out.encoded.occlusion_png = occlusion_png(out.maps);
    if (settings.grain_m > 0)
        out.encoded.colour_png = colour_png(out.maps);
    return out;
}

} // namespace

BakedLevel bake_mesh(const TriMesh& given, const PositionGrid& grid, const BakeSource& fine,
                     const BakeLevelSettings& settings, Progress* progress) {
    TriMesh mesh = given;
    mesh.openness.clear(); // a texture says it
    ChartAtlas atlas = coarse_enough(mesh, settings, progress);
    BakedLevel out = bake_atlas(atlas, grid, fine, settings, progress);
    // Texels that are small beside the bound may still be large beside the bends.
    const int most_px = std::max(settings.side_px, settings.most_side_px);
    while (out.relit.mean_deg > kMostRelit_deg && 2 * atlas.side_px <= most_px) {
        atlas = chart_atlas(mesh, {.side_px = 2 * atlas.side_px, .gutter_px = settings.gutter_px},
                            progress);
        out = bake_atlas(atlas, grid, fine, settings, progress);
    }
    return out;
}

BakedLevel bake_level(const LodLevel& level, const BakeSource& fine,
                      const BakeLevelSettings& settings, Progress* progress) {
    BakedLevel out = bake_mesh(level.encoded.decoded, level.grid, fine, settings, progress);
    require_certificate(certify(out.encoded.decoded, {.self_intersections = false}), "bake");
    return out;
}

TriMesh fine_surface(const openvdb::FloatGrid& solid, const Field& field, Progress* progress) {
    report_stage(progress, "extracting the fine surface");
    // Vertices dense enough for openness everywhere, not only where the surface bends.
    const LabelledMesh fine =
        extract(solid, &field, {.bound_vox = 0.1, .most_spacing = 2}, progress);
    const double voxel_m = lattice_of(solid).voxel_m;
    TriMesh surface{fine.positions, fine.triangles, {}};
    const auto probe = field.probe(bounds(surface).dilated(voxel_m), voxel_m);
    surface.normals = surface_normals(fine, *probe);
    return surface;
}

BakeSource bake_source(const openvdb::FloatGrid& solid, const Field& field, double reach_m,
                       int n_rays, Progress* progress) {
    TriMesh surface = fine_surface(solid, field, progress);
    if (n_rays == 0)
        surface.openness.assign(surface.positions.size(), 1);
    return {field,
            std::move(surface),
            {.voxel_m = lattice_of(solid).voxel_m,
             .reach_m = reach_m,
             .n_rays = n_rays == 0 ? 1 : n_rays},
            progress};
}

} // namespace taihu
