#pragma once
#include <cstddef>
#include <optional>

#include <openvdb/openvdb.h>

#include "mesh_out/labelled_mesh.h"
#include "stats/core/progress.h"
#include "stats/core/tri_mesh.h"
#include "vdb_ops/field.h"

namespace taihu {

struct ExtractSettings {
    /// Where the surface is smooth, cells grow as long as their faces stay about so near to it
    /// [voxels], > 0.
    double bound_vox = 0.1;
    int most_spacing = 4; ///< largest cells [voxels]: 1, 2 or 4
};

/// The surface of a solid, straight from its field: sharp along rims and in corners, coarser where
/// it is smooth. The grid says what is inside, so that pieces that were removed and bubbles that
/// were filled stay so; the field says where the surface is, and where it does not have the one of
/// the grid, the grid does.
///
/// One vertex for each curve in which the surface passes the faces of a cell of an octree (1, 2 or
/// 4 voxels, in blocks of 8), on the surface of the field; those that come to one place on a rim or
/// in a corner are one, and tips of fins that reach out of the cells get more. Closed, 2-manifold,
/// outward, no zero-area triangle, no two vertices in one place; of its topology nothing is lost
/// against voxel cells. Cells beside rims and where surfaces come near each other stay small.
/// Vertices whose triangles cross others move along their rim or face to between their neighbours;
/// where that does not help they step aside of their rim, or back into their cell, until none
/// cross; what does to the last, in solids that voxels hardly resolve, is for the certificate to
/// count. The same bytes on any number of threads.
///
/// \param solid  level set: cubic voxels, negative inside, half band >= 2 voxels.
/// \param field  what it was made of; null: the level set is its own.
/// \throws Error bad_argument: not a level set, nothing inside it, a setting out of range; numeric:
/// the surface leaves the narrow band (a clipped grid);
/// unsupported: 2^32 vertices; cancelled: between blocks.
LabelledMesh extract(const openvdb::FloatGrid& solid, const Field* field,
                     const ExtractSettings& settings = {}, Progress* progress = nullptr);

/// What a tile owns of a surface, and what is around it.
struct TileSurface {
    LabelledMesh mesh; ///< first the triangles that the tile owns, then those that come near them
    std::size_t n_owned = 0;
};

/// Voxels around a tile that are usually enough for extract_tile().
inline constexpr int kTileHalo_vox = 160;

/// The part of extract()'s surface that stands across the edges between voxels which begin in a
/// tile: tiles without gaps have all of its triangles, each once, bit for bit. But for two things.
/// Pieces of a voxel or two that extract() turns to face outwards stay as they are. And where
/// triangles still cross once cells were made smaller, extract() makes more of them smaller; tiles
/// stay as they are, alike on both sides of a seam, for each attempt looks 40 voxels farther.
///
/// Where vertices go depends on what is around them. Those of triangles that cross go together, so
/// a tile is only known where no chain of such places leads from it to the end of what is given.
/// \param given  a box of whole leaves in which `solid` is that of the whole.
/// \param tile   of whole leaves, in `given`.
/// \return no triangles where the tile has no surface; nothing when `given` is too small: 112
///   voxels more than the tile at each side are the least.
/// \throws Error as extract(), but for solids without a surface.
std::optional<TileSurface> extract_tile(const openvdb::FloatGrid& solid,
                                        const openvdb::CoordBBox& given,
                                        const openvdb::CoordBBox& tile, const Field* field,
                                        const ExtractSettings& settings = {},
                                        Progress* progress = nullptr);

/// Unit normals for shading, from the gradients of the primitives that vertices lie on; on rims
/// their mean.
std::vector<Vec3> surface_normals(const LabelledMesh& mesh, const FieldProbe& field);

/// The zero surface of a level set as a uniform mesh: about two triangles per surface voxel,
/// closed, 2-manifold, outward, all positions different, no zero-area triangle. OpenVDB's dual
/// mesher (volumeToMesh, adaptivity 0); its quads wind inwards and are turned and split along the
/// diagonal whose middle is nearer to the surface. Not interruptible while OpenVDB works. \param
/// solid  level set: cubic voxels, negative inside, half band >= 2 voxels. \throws Error
/// bad_argument: not a level set, or nothing inside it; numeric: the surface leaves
///   the narrow band (a clipped grid), or the mesh did not come out closed.
TriMesh extract_uniform(const openvdb::FloatGrid& solid, Progress* progress = nullptr);

/// The same mesher with larger polygons where the surface is flatter: `adaptivity` 0..1, 0 as
/// extract_uniform(). A yardstick: its error has no bound, and its triangles may cross.
TriMesh extract_openvdb(const openvdb::FloatGrid& solid, double adaptivity,
                        Progress* progress = nullptr);

/// Unit normals at `points` from the gradient of the level set (trilinear, central differences).
std::vector<Vec3> surface_normals(const openvdb::FloatGrid& solid, const std::vector<Vec3>& points);

} // namespace taihu
