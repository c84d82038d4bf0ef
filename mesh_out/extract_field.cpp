#include <algorithm>
#include <cmath>
#include <string>

#include <tbb/parallel_for.h>

#include "mesh_out/cell_sizes_detail.h"
#include "mesh_out/dual_surface_detail.h"
#include "mesh_out/extract.h"
#include "mesh_out/extract_certainty_detail.h"
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

using openvdb::CoordBBox;
constexpr double kReach_vox = 1.25; // a level set of half width 3 tells that much between voxels
constexpr int kMostAttempts = 5, kMostAttemptsOfTile = 2; // each looks kRetry_vox farther
constexpr int kRetry_vox = 40; // what becomes of cells that were made smaller reaches so far
constexpr int kPart_vox = 16;  // parts of triangles come out of them so far at most
constexpr int kAbout_vox = 8;  // triangles reach out of the voxels of their edges so far at most

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

struct Extracted {
    LabelledMesh mesh;
    std::vector<std::uint8_t> owned; ///< by a tile: one flag per triangle
};

/// \param tile  null: owns nothing. \return no triangles where there is no surface.
Extracted extracted(const openvdb::FloatGrid& solid, const CoordBBox& given, const CoordBBox* tile,
                    const Field* field, const ExtractSettings& settings, Certainty& certainty,
                    Progress* progress) {
    Extracted result;
    const Lattice lattice = lattice_of(solid);
    CellBlocks blocks(solid, given, progress);
    if (blocks.size() == 0)
        return result;
    const auto probe = field
                           ? field->probe(region_of(blocks, lattice), kReach_vox * lattice.voxel_m)
                           : level_set_probe({openvdb::FloatGrid::ConstPtr(), &solid});
    const SurfacePoints points(solid, *probe, lattice);
    SmallCells small;
    const int most_attempts = tile ? kMostAttemptsOfTile : kMostAttempts;
    for (int attempt = 0;; ++attempt) {
        choose_cell_sizes(blocks, solid, {settings.most_spacing, settings.bound_vox}, small,
                          progress);
        const DualSurface surface(blocks, points, certainty);
        if (!in_band(blocks, surface, solid))
            refuse_clipped(solid);
        Mesher mesher(blocks, surface, points, small, certainty, progress);
        const std::vector<std::uint32_t> stuck = mesher.run();
        const bool last = attempt + 1 >= most_attempts;
        if (!last) // elsewhere some may have been stuck
            certainty.spread(kRetry_vox);

        // Some cross to the last in solids that the voxels hardly resolve; the certificate counts.
        if (stuck.empty() || last) {
            if (tile)
                result.owned = mesher.owned_by(*tile);
            result.mesh = mesher.take();
            certainty.spread(kPart_vox);
            const auto parents = part_long_triangles(result.mesh, *probe, lattice,
                                                     settings.bound_vox / 2, certainty, progress);
            for (std::size_t i = 0; tile && i < parents.size(); ++i)
                result.owned.push_back(result.owned[parents[i]]);
            return result;
        }
        for (const std::uint32_t v : stuck)
            for (const int size : {2, 4})
                small.insert(small_cell(surface.cell(v), size));
    }
}

bool meet(const Box& a, const Box& b) {
    const Box both{max(a.lo, b.lo), min(a.hi, b.hi)};
    return !both.empty();
}

bool is_of_leaves(const CoordBBox& box) {
    bool whole = !box.empty();
    for (int axis = 0; axis < 3 && whole; ++axis)
        whole = box.min()[axis] % 8 == 0 && (box.max()[axis] + 1) % 8 == 0;
    return whole;
}

/// The triangles of a tile, and those that come as near as triangles of it reach.
TileSurface of_tile(const Extracted& all, const CoordBBox& tile, const Lattice& lattice) {
    const auto world = [&](const openvdb::Coord& c) {
        return lattice.origin + Vec3{double(c.x()), double(c.y()), double(c.z())} * lattice.voxel_m;
    };
    const Box about{world(tile.min().offsetBy(-kAbout_vox)),
                    world(tile.max().offsetBy(kAbout_vox))};
    constexpr std::uint32_t kNone = 0xffffffff;
    TileSurface result;
    std::vector<std::uint32_t> renamed(all.mesh.positions.size(), kNone);
    for (const bool owned : {true, false}) {
        for (std::size_t i = 0; i < all.mesh.triangles.size(); ++i) {
            Triangle t = all.mesh.triangles[i];
            Box box;
            for (const std::uint32_t v : t)
                box.include(all.mesh.positions[v]);
            if ((all.owned[i] != 0) != owned || (!owned && !meet(box, about)))
                continue;
            for (std::uint32_t& v : t) {
                if (renamed[v] == kNone) {
                    renamed[v] = static_cast<std::uint32_t>(result.mesh.positions.size());
                    result.mesh.positions.push_back(all.mesh.positions[v]);
                    result.mesh.labels.push_back(all.mesh.labels[v]);
                }
                v = renamed[v];
            }
            result.mesh.triangles.push_back(t);
        }
        if (owned)
            result.n_owned = result.mesh.triangles.size();
    }
    return result;
}

} // namespace

LabelledMesh extract(const openvdb::FloatGrid& solid, const Field* field,
                     const ExtractSettings& settings, Progress* progress) {
    check_settings(settings);
    require_level_set(solid);
    Certainty all;
    LabelledMesh mesh =
        extracted(solid, CoordBBox::inf(), nullptr, field, settings, all, progress).mesh;
    if (mesh.triangles.empty())
        refuse_empty(solid);
    turn_small_pieces(mesh.positions, mesh.triangles);
    return mesh;
}

std::optional<TileSurface> extract_tile(const openvdb::FloatGrid& solid, const CoordBBox& given,
                                        const CoordBBox& tile, const Field* field,
                                        const ExtractSettings& settings, Progress* progress) {
    check_settings(settings);
    require_level_set(solid);
    if (!is_of_leaves(given) || !is_of_leaves(tile) || !given.isInside(tile))
        throw Error(Fault::bad_argument, "extract: a tile and what is given around it must be "
                                         "whole leaves of 8 voxels, the one in the other");
    Certainty certainty(given, lattice_of(solid));
    const Extracted all = extracted(solid, given, &tile, field, settings, certainty, progress);
    CoordBBox about = tile;
    about.expand(kAbout_vox);
    if (!certainty.holds(about))
        return std::nullopt;
    return of_tile(all, tile, lattice_of(solid));
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
