#include <algorithm>
#include <cmath>
#include <string>

#include <tbb/parallel_for.h>

#include "mesh_out/cell_sizes_detail.h"
#include "mesh_out/dual_surface_detail.h"
#include "mesh_out/extract.h"
#include "mesh_out/extract_mesher_detail.h"
#include "mesh_out/extract_parts_detail.h"
#include "mesh_out/level_set_check_detail.h"
#include "mesh_out/piece_sides_detail.h"
#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/level_set_probe_detail.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

constexpr double kReach_vox = 1.25; // a level set of half width 3 tells that much between voxels

void check_settings(const ExtractSettings& settings) {
    if (!(settings.bound_vox > 0) || !std::isfinite(settings.bound_vox))
        throw Error(Fault::bad_argument, "extract: bound_vox is " + shortest(settings.bound_vox) +
                                             ", must be finite and > 0; 0.1 is usual");
    if (settings.most_spacing != 1 && settings.most_spacing != 2 && settings.most_spacing != 4)
        throw Error(Fault::bad_argument, "extract: most_spacing is " +
                                             std::to_string(settings.most_spacing) +
                                             ", must be 1, 2 or 4; 4 is usual");
}

/// All blocks and what vertices may reach from them.
Box region_of(const CellBlocks& blocks, const Lattice& lattice) {
    Box box;
    for (std::size_t b = 0; b < blocks.size(); ++b)
        for (const int end : {0, 8}) {
            const auto c = blocks[b].origin.offsetBy(end);
            box.include(lattice.origin +
                        Vec3{double(c.x()), double(c.y()), double(c.z())} * lattice.voxel_m);
        }
    return box.dilated(4 * lattice.voxel_m);
}

/// Whether all edges that the surface passes have values at both ends.
bool in_band(const CellBlocks& blocks, const DualSurface& surface,
             const openvdb::FloatGrid& solid) {
    auto accessor = solid.getConstAccessor();
    return std::all_of(surface.edges().begin(), surface.edges().end(), [&](const auto& e) {
        openvdb::Coord c = blocks[e.block].origin + CellBlocks::local(e.key % 512);
        const float one = accessor.getValue(c);
        ++c[e.key / 512];
        const float other = accessor.getValue(c);
        return std::fabs(one) < solid.background() && std::fabs(other) < solid.background();
    });
}

} // namespace

LabelledMesh extract(const openvdb::FloatGrid& solid, const Field* field,
                     const ExtractSettings& settings, Progress* progress) {
    constexpr int kMostAttempts = 4;
    check_settings(settings);
    require_level_set(solid);
    const Lattice lattice = lattice_of(solid);
    CellBlocks blocks(solid, progress);
    if (blocks.size() == 0)
        refuse_empty(solid);
    const auto probe = field
                           ? field->probe(region_of(blocks, lattice), kReach_vox * lattice.voxel_m)
                           : level_set_probe({openvdb::FloatGrid::ConstPtr(), &solid});
    const SurfacePoints points(solid, *probe, lattice);
    SmallCells small;
    for (int attempt = 0;; ++attempt) {
        choose_cell_sizes(blocks, solid, {settings.most_spacing, settings.bound_vox}, small,
                          progress);
        const DualSurface surface(blocks, points);
        if (!in_band(blocks, surface, solid))
            refuse_clipped(solid);
        Mesher mesher(blocks, surface, points, small, progress);
        const std::vector<std::uint32_t> stuck = mesher.run();

        // Some cross to the last in solids that the voxels hardly resolve; the certificate counts.
        if (stuck.empty() || attempt + 1 == kMostAttempts) {
            LabelledMesh mesh = mesher.take();
            part_long_triangles(mesh, *probe, lattice, settings.bound_vox / 2, progress);
            turn_small_pieces(mesh.positions, mesh.triangles);
            return mesh;
        }
        for (const std::uint32_t v : stuck)
            for (const int size : {2, 4})
                small.insert(small_cell(surface.cell(v), size));
    }
}

std::vector<Vec3> surface_normals(const LabelledMesh& mesh, const FieldProbe& field) {
    std::vector<Vec3> normals(mesh.positions.size());
    tbb::parallel_for(std::size_t{0}, normals.size(), [&](std::size_t v) {
        PrimitiveSet labels = mesh.labels[v];
        if (labels.empty())
            labels.add(field.at(mesh.positions[v]).primitive);
        for (const Primitive p : labels.all())
            normals[v] += normalized(field.of(p, mesh.positions[v]).gradient);
        normals[v] = length(normals[v]) > 0 ? normalized(normals[v]) : Vec3{0, 1, 0};
    });
    return normals;
}

} // namespace taihu
