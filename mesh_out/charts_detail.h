#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "mesh_out/chart_atlas.h"

namespace taihu {

/// The face across edge k (corners k and k + 1) of each triangle, or kNoFace at a border and where
/// more than two faces meet.
std::vector<std::array<std::uint32_t, 3>> face_neighbours(std::span<const Triangle> triangles);

/// The direction 0..5 (+X -X +Y -Y +Z -Z) of each triangle.
/// \param normals  of the triangles, of length 1. \param areas  [m^2].
std::vector<std::uint8_t> chart_directions(std::span<const Vec3> normals,
                                           std::span<const double> areas,
                                           std::span<const std::array<std::uint32_t, 3>> neighbours,
                                           const TriMesh& mesh, const AtlasSettings& settings);

struct Projection {
    Vec3 u_axis, v_axis;
};
/// Axes across a direction, seen from outside with v as far upwards as it may be; on top and bottom
/// it runs away from the one who looks along -Z.
Projection projection(const Vec3& direction);
Vec3 direction_vector(int direction);

/// The chart of each triangle, numbered from 0: connected, of one direction, none with two faces
/// whose projections overlap.
std::vector<std::uint32_t> split_charts(const TriMesh& mesh,
                                        std::span<const std::uint8_t> directions,
                                        std::span<const std::array<std::uint32_t, 3>> neighbours,
                                        Progress* progress);

/// Charts of directions of their own.
struct GrownCharts {
    std::vector<std::uint32_t> of_face; ///< numbered from 0: connected, none overlapping itself
    std::vector<Vec3> directions;       ///< of length 1
};

/// Where a surface bends much, six directions cut it into many charts; these grow from a face, as
/// far as no face is stretched more than sqrt(3) along what the first ones look in on average. Tiny
/// ones join as in chart_directions().
GrownCharts grow_charts(std::span<const Vec3> normals, std::span<const double> areas,
                        std::span<const std::array<std::uint32_t, 3>> neighbours,
                        const TriMesh& mesh, const AtlasSettings& settings, Progress* progress);

/// Width and height of a chart [m].
struct ChartSize {
    double width_m = 0, height_m = 0;
};

struct Shelves {
    double texel_m = 0;
    std::vector<std::array<int, 4>> places; ///< x, y, width, height [texels] without gutter
};

/// The charts on shelves, at the smallest texels that were found to fit; none when there is no
/// room for so many charts, however small.
std::optional<Shelves> pack_shelves(std::span<const ChartSize> charts, int side_px, int gutter_px);

} // namespace taihu
