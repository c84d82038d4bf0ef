#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "stats/core/tri_mesh.h"

namespace taihu {

/// How many closed pieces of a surface face the wrong way: of positive volume though inside of
/// others, or of negative volume though not in exactly one, which makes them its cavities. Exact
/// signs; of pieces that touch or cross others it says little. O(n log n + pieces * log n).
/// \param piece_of  of each face, any number below that of the faces. \param volume  of each such
/// number, of any scale; 0 for pieces that are not judged.
std::size_t count_misplaced_pieces(std::span<const Vec3> positions, std::span<const Triangle> faces,
                                   std::span<const std::uint32_t> piece_of,
                                   std::span<const double> volume);

/// Turns those of at most 200 faces that face the wrong way: pieces of a voxel or two, whose
/// vertices changed sides when they were put on the surface.
void turn_small_pieces(std::span<const Vec3> positions, std::span<Triangle> faces);

} // namespace taihu
