#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "stats/core/tri_mesh.h"

namespace taihu {

/// Sign of det(b - a, c - a, d - a), exact: +1 when d lies on the side that the normal of the
/// counter-clockwise triangle abc points to, 0 when the four points lie in one plane.
/// \param a,b,c,d  finite.
int orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// Whether the triangle abc has exactly zero area. \param a,b,c  finite.
bool is_flat(const Vec3& a, const Vec3& b, const Vec3& c);

/// Whether two triangles, as closed sets, meet anywhere but in the vertices, or the edge, that they
/// share by index. So counted are: an edge that pierces the other face or touches it, faces in one
/// plane that overlap, a face folded onto the neighbour across an edge, two faces on the same three
/// vertices. Exact signs, no tolerance.
/// \param positions  no two of them equal, finite where the faces use them.
/// \param f,g        with an area that is not zero.
bool faces_cross(std::span<const Vec3> positions, Triangle f, Triangle g);

/// Number of pairs of `faces` for which faces_cross() holds; the same on any number of threads.
/// Time O(n log n + pairs whose boxes overlap), memory about 100 bytes per face.
std::size_t count_crossings(std::span<const Vec3> positions, std::span<const Triangle> faces);

/// The pairs themselves, lower index first, ascending; faces without area are left out. Time and
/// memory as for the picked faces alone, and a look-up for each of the others. \param picked  one
/// flag per face, or empty for all: pairs with at least one picked face.
std::vector<std::pair<std::uint32_t, std::uint32_t>>
crossing_pairs(std::span<const Vec3> positions, std::span<const Triangle> faces,
               std::span<const std::uint8_t> picked = {});

} // namespace taihu
