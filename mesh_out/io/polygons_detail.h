#pragma once
#include <cstdint>
#include <vector>

#include "mesh_out/io/mesh_file.h"
#include "stats/core/polygon.h"

namespace taihu {

/// Add one face of a file to its only level and count it. `corners` are in range; those that repeat
/// their neighbour are removed from it. \return false as triangulate().
[[nodiscard]] bool add_face(MeshFile& file, std::vector<std::uint32_t>& corners);

/// Add a triangle, or count it when it repeats a corner.
void add_triangle(MeshFile& file, TriMesh& level, const Triangle& triangle);

/// What a reader says when add_face() returns false.
inline constexpr const char* kTooManyCorners = "a concave face of more than 4096 corners";
inline constexpr const char* kTriangulateFirst = "triangulate the mesh before exporting it";

} // namespace taihu
