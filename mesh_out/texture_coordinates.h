#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "stats/core/box.h"
#include "stats/core/tri_mesh.h"

namespace taihu {

/// A place in a texture: u to the right, v upwards, the texture in 0..1, repeated beyond.
struct TexturePoint {
    double u = 0, v = 0;
};

enum class TextureMap {
    planar,      ///< along Z: the frame's front is the texture
    spherical,   ///< u the longitude about the frame's middle, v the latitude from -Y to +Y
    cylindrical, ///< u the longitude about the frame's upright axis, v the height
    cubic        ///< each face by the side of the frame that it looks at most
};

/// Of corners, not of positions, because a position on a seam has several.
struct TextureCoordinates {
    std::vector<std::array<TexturePoint, 3>> corners; ///< one per triangle
    std::vector<std::uint8_t> sides;                  ///< cubic: +X -X +Y -Y +Z -Z of each
                                                      ///< triangle; else empty
};

/// Where the corners of a mesh lie in a texture that is laid around it. Longitude is 0.5 towards +Z
/// and runs to the right as seen from outside; its seam is at -Z, where corners of one triangle go
/// beyond 1 rather than back across the whole texture. A corner on the axis takes the mean
/// longitude of the others. Cubic sides are seen from outside with +Y up; on top and bottom v runs
/// away from the one who looks along -Z.
///
/// Limits: a triangle with the axis through its inside has no longitude that fits all corners; a
/// mesh that is not seen whole from the middle gets the same place twice. O(triangles).
/// \param frame  what the texture is laid around: the bounds of the mesh, or one for many meshes.
/// \throws Error bad_argument: a frame without extent; an index or a position that is bad.
/// Source: the four functions that Deix, "Real-time rendering of fractal rocks", section 5, names;
/// their conventions are ours.
TextureCoordinates texture_coordinates(const TriMesh& mesh, TextureMap map, const Box& frame);

} // namespace taihu
