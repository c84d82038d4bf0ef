#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "mesh_out/textured_mesh.h"
#include "stats/core/progress.h"

namespace taihu {

struct AtlasSettings {
    int side_px = 2048; ///< of the square texture, 64..8192
    int gutter_px = 3;  ///< texels around each chart that belong to it alone, 1..16
    /// A chart of less than this share of the mesh's area joins a neighbour, 0..0.1,
    double tiny_area_rel = 5e-4;
    /// where that stretches none of its faces more than this, sqrt(3)..10.
    double merge_stretch = 3;
};

/// A part of a mesh that is seen whole from one direction.
struct Chart {
    Vec3 direction;          ///< towards the one who sees it, of length 1
    Vec3 u_axis, v_axis;     ///< of the texture; cross(u_axis, v_axis) is the direction
    double u_m = 0, v_m = 0; ///< least along them, at the left and lower border
    int x_px = 0, y_px = 0, width_px = 0, height_px = 0; ///< without gutter, y from the top
    std::size_t n_triangles = 0;
};

struct ChartAtlas {
    TexturedMesh textured;
    std::vector<Chart> charts;
    std::vector<std::uint32_t> chart_of; ///< of each triangle
    int side_px = 0;                     ///< of the texture
    double texel_m = 0;                  ///< on the plane of projection, the same everywhere
    double most_stretch = 0;             ///< of a face: its area over that of its image
    double stretched_area_rel = 0;       ///< share of the area of faces beyond sqrt(3)
    double used_rel = 0;                 ///< share of the texture that images of faces cover
};

/// A texture for a mesh of any genus: charts are connected faces, projected along one direction,
/// which stretches none more than sqrt(3) but those that joined a neighbour, and of which none
/// overlap in projection; turned so that they lie in small boxes, and packed in shelves. Two ways
/// are tried, and the one that leaves the smaller texels is taken: charts of the six axes
/// (directions follow normals smoothed over neighbours where that keeps sqrt(3); overlaps are exact
/// where positions lie on a grid of at most 24 bits), best where surfaces are large and even; and
/// charts that grow from a face along a direction of their own, best where they bend a lot.
///
/// Texture points lie on a grid of 1/16 texel or finer, so that Draco keeps them. Tangents: where
/// the surface cuts the plane of u and direction, exact for the projection. The same atlas whatever
/// the number of threads; O(faces log faces). Lobes of one chart may come nearer to each other than
/// a gutter; charts never do.
///
/// \param mesh  with unit normals.
/// \throws Error bad_argument: no face, a bad index or position, a face without area, normals that
/// do not match, a setting out of range; numeric: more charts than the texture has room for;
/// cancelled.
/// Source: own derivation.
ChartAtlas chart_atlas(const TriMesh& mesh, const AtlasSettings& settings = {},
                       Progress* progress = nullptr);

} // namespace taihu
