#pragma once
#include <array>
#include <cstdint>

namespace taihu {

// A cube with 8 corners, inside or outside of a solid. Corner 4x + 2y + z; edge 4a + 2u + v runs
// along axis a, u and v along the axes after it; face 2a + s is the lower or upper one along a.

/// The curves in which a surface passes through the faces of a cube: which one passes each edge.
struct CellLoops {
    std::array<std::int8_t, 12> of_edge; ///< -1: the edge is not passed
    int n = 0;                           ///< 0..4
};

/// \param inside  bit c: corner c is inside.
/// \param joined  bit f: where the corners of face f alternate, those inside are joined across it.
const CellLoops& cell_loops(unsigned inside, unsigned joined);

/// The faces whose corners alternate.
unsigned alternating_faces(unsigned inside);

/// Corners and edges around a face; edge k runs from corner k to the next.
struct FaceRing {
    std::array<int, 4> corners, edges;
};
const FaceRing& face_ring(int face);

} // namespace taihu
