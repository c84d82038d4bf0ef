#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "mesh_out/io/mesh_file.h"

namespace taihu {

/// Ear clipping takes time quadratic in the corners; longer concave polygons are refused.
inline constexpr std::size_t kMaxConcaveCorners = 4096;

/// Append the corners.size() - 2 triangles of a polygon of three corners or more to `out`.
/// Quads: along the shorter diagonal that lies inside. Convex: a fan from the first corner. Others:
/// ears in the plane of the polygon's area vector, the shortest cut first. What crosses itself or
/// has no area is cut all the same. \return false, and nothing is appended, when the polygon is
/// concave with over kMaxConcaveCorners.
[[nodiscard]] bool triangulate(std::span<const Vec3> positions,
                               std::span<const std::uint32_t> corners, std::vector<Triangle>& out);

/// Add one face of a file to its only level and count it. `corners` are in range; those that repeat
/// their neighbour are removed from it. \return false as triangulate().
[[nodiscard]] bool add_face(MeshFile& file, std::vector<std::uint32_t>& corners);

/// Add a triangle, or count it when it repeats a corner.
void add_triangle(MeshFile& file, TriMesh& level, const Triangle& triangle);

/// What a reader says when add_face() returns false.
inline constexpr const char* kTooManyCorners = "a concave face of more than 4096 corners";
inline constexpr const char* kTriangulateFirst = "triangulate the mesh before exporting it";

} // namespace taihu
