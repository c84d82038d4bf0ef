#include "mesh_out/surface_file.h"

#include <cmath>

#include "mesh_out/extract.h"
#include "mesh_out/lod.h"
#include "mesh_out/openness.h"
#include "mesh_out/surface_distance.h"
#include "stats/core/error.h"

namespace taihu {
namespace {

/// The uniform surface on a position grid, so that every format can hold it exactly. Rounding to 18
/// bits is far below a voxel for all but the largest grids.
EncodedLevel uniform_level(const openvdb::FloatGrid& solid, const TriMesh& surface,
                           const PositionGrid& grid, bool shaded, Progress* progress) {
    TriMesh snapped = snap_to_grid(surface, grid).mesh;
    snapped.normals = surface_normals(solid, snapped.positions);
    if (shaded)
        snapped.openness = openness(snapped, {}, progress);
    return encode_draco(snapped, grid);
}

} // namespace

SurfaceFile format_surface(const openvdb::FloatGrid& solid, const Field* field, MeshFormat format,
                           const SurfaceSettings& settings, const std::string& recipe,
                           Progress* progress) {
    SurfaceFile file;
    EncodedLevel level;
    const bool shaded = format == MeshFormat::glb && settings.openness;
    if (settings.uniform) {
        const TriMesh surface = extract_openvdb(solid, settings.adaptivity, progress);
        const PositionGrid grid = finest_grid(bounds(surface));
        level = uniform_level(solid, surface, grid, shaded, progress);
        file.bound_m = 4 * grid.step_m; // a few steps where vertices met
        file.error_m = two_sided_distance(level.decoded, surface, solid.voxelSize().x() / 2).max_m;
    } else {
        LodChain chain = make_lods(
            solid, field,
            {.levels = {{settings.max_error_m, settings.n_triangles}}, .openness = shaded},
            progress);
        LodLevel& only = chain.levels.front();
        file.bound_m = only.bound_m;
        file.error_m = only.error_m;
        file.n_unseen = chain.unseen.size();
        file.note = std::move(chain.note);
        file.n_unresolved = only.unresolved.size();
        file.unresolved_error_m = only.unresolved_error_m;
        level = std::move(only.encoded);
    }
    const Vec3 shift = settings.at_foot ? foot_shift(bounds(level.decoded)) : Vec3{};
    const bool draco = format == MeshFormat::glb && settings.draco;
    if (draco) {
        level.screen_coverage = 1;
        file.bytes = format_glb(std::span(&level, 1), {.recipe = recipe, .shift = shift});
    } else {
        for (Vec3& p : level.decoded.positions)
            p += shift;
        file.bytes = format_mesh(level.decoded, format, recipe);
    }
    file.certificate =
        certify(parse_mesh(file.bytes, format, "output", {.is_own = true}).levels.at(0));
    require_certificate(file.certificate, "mesh");
    return file;
}

} // namespace taihu
