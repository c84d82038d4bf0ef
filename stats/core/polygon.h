#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "stats/core/tri_mesh.h"

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

} // namespace taihu
