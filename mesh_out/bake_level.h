#pragma once
#include <cstddef>
#include <vector>

#include "mesh_out/bake.h"
#include "mesh_out/lod.h"

namespace taihu {

struct BakeLevelSettings {
    double reach_m = 0; ///< cage, as in BakeSettings
    int side_px = 2048; ///< of the maps, 64..8192,
    double texel_m = 0; ///< halved while no texel is larger than this and normals come out within 5
                        ///< degrees; 0: as it is
    int most_side_px = 0; ///< doubled up to this while normals are more than 5 degrees off; 0:
                          ///< up to side_px, where it was halved
    int gutter_px = 3;    ///< around each chart, 1..16
    double grain_m = 0;   ///< as in BakeSettings
    double grain_contrast = 0.4;
    bool occlusion = true; ///< an occlusion texture in the file
    bool masters = true;   ///< all maps, else those of the file alone
    bool vertices = false; ///< _CURVATURE and _DISPLACEMENT of each vertex, as the maps have them
};

/// A level with its texture, as the decoded file holds it.
struct BakedLevel {
    EncodedLevel encoded; ///< Draco bytes, texture points, tangents and images
    BakedMaps maps;
    RelitError relit;
    std::size_t n_charts = 0;
    double texel_m = 0, used_rel = 0, most_stretch = 0, stretched_area_rel = 0; ///< of ChartAtlas
};

/// Cut a level along the seams of a chart atlas, code it on its own grid, decode it, certify it
/// again (closed once equal positions are welded) and bake what it lost onto what was decoded. It
/// has no openness in its vertices: the occlusion texture says the same.
/// \throws Error as chart_atlas(), encode_draco() and bake(); numeric: it would not hold its
/// certificate.
BakedLevel bake_level(const LodLevel& level, const BakeSource& fine,
                      const BakeLevelSettings& settings, Progress* progress = nullptr);

/// The same of any mesh, closed or not, that has normals; nothing is asked of what is decoded.
/// \param grid  that its positions lie on.
BakedLevel bake_mesh(const TriMesh& mesh, const PositionGrid& grid, const BakeSource& fine,
                     const BakeLevelSettings& settings, Progress* progress = nullptr);

/// The surface of a solid, with normals, dense enough for openness at its vertices.
TriMesh fine_surface(const openvdb::FloatGrid& solid, const Field& field,
                     Progress* progress = nullptr);

/// The fine surface of a solid, for all of its levels. \param field  what the solid was made of.
/// \param n_rays  of the openness; 0: none is worked out, and all is open.
/// \throws Error as extract() and BakeSource.
BakeSource bake_source(const openvdb::FloatGrid& solid, const Field& field, double reach_m,
                       int n_rays, Progress* progress = nullptr);

} // namespace taihu
