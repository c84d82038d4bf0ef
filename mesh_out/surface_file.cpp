#include "mesh_out/surface_file.h"

#include "mesh_out/extract.h"
#include "mesh_out/lod.h"
#include "mesh_out/surface_distance.h"
#include "stats/core/error.h"

namespace taihu {
namespace {

// Rounding of positions to the grid of a file, as a share of the voxel: finer than any use of the
// mesh.
constexpr double kUniformMove = 1.0 / 64;

/// The uniform surface on a position grid, so that every format can hold it exactly.
EncodedLevel uniform_level(const openvdb::FloatGrid& solid, const TriMesh& surface) {
    const double voxel = solid.voxelSize().x();
    const PositionGrid grid = position_grid(bounds(surface).dilated(voxel), kUniformMove * voxel);
    TriMesh snapped = snap_to_grid(surface, grid).mesh;
    snapped.normals = surface_normals(solid, snapped.positions);
    return encode_draco(snapped, grid);
}

} // namespace

SurfaceFile format_surface(const openvdb::FloatGrid& solid, MeshFormat format,
                           const SurfaceSettings& settings, const std::string& recipe,
                           Progress* progress) {
    SurfaceFile file;
    EncodedLevel level;
    if (settings.uniform) {
        const TriMesh surface = extract_uniform(solid, progress);
        level = uniform_level(solid, surface);
        file.bound_m = kUniformMove * solid.voxelSize().x();
        file.error_m = two_sided_distance(level.decoded, surface, solid.voxelSize().x() / 2).max_m;
    } else {
        LodChain chain =
            make_lods(solid, {.n_levels = 1, .bound_m = settings.max_error_m}, progress);
        file.bound_m = chain.levels[0].bound_m;
        file.error_m = chain.levels[0].error_m;
        level = std::move(chain.levels[0].encoded);
    }
    const bool draco = format == MeshFormat::glb && settings.draco;
    if (draco) {
        level.screen_coverage = 1;
        file.bytes = format_glb(std::span(&level, 1), {.recipe = recipe});
    } else {
        file.bytes = format_mesh(level.decoded, format, recipe);
    }
    file.certificate = certify(parse_mesh(file.bytes, format, "output").levels.at(0));
    if (!file.certificate.holds()) {
        std::string what;
        for (const std::string& fault : faults(file.certificate))
            what += (what.empty() ? "" : ", ") + fault;
        throw Error(Fault::numeric, "mesh: the surface did not come out closed (" + what +
                                        "); use another voxel size, or --uniform");
    }
    return file;
}

} // namespace taihu
