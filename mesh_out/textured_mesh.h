#pragma once
#include <cstdint>
#include <vector>

#include "mesh_out/texture_coordinates.h"
#include "stats/core/tri_mesh.h"

namespace taihu {

/// A mesh with a place in a texture for each position; where the texture has a seam, positions are
/// repeated, bit by bit.
struct TexturedMesh {
    TriMesh mesh;                      ///< with normals
    std::vector<TexturePoint> texture; ///< one per position, 0..1, v upwards
    /// One per position: of length 1, at right angles to the normal, along growing u. With
    /// cross(normal, tangent), along growing v, it is glTF's frame: TANGENT with w = 1.
    std::vector<Vec3> tangents;
};

/// No face owns the texel.
inline constexpr std::uint32_t kNoFace = 0xffffffffu;

/// Which face's image holds the middle of each texel, the first of several; row-major, the first
/// row is v = 1. O(texels + faces). \param side_px  1..16384.
/// \throws Error bad_argument: a side out of range, not one texture point per position, or one
/// outside of 0..1.
std::vector<std::uint32_t> texel_faces(const TexturedMesh& textured, int side_px);

/// Where a texel's middle lies in the image of a face, or any other place: the weights of the
/// face's corners, of sum 1; the first corner's where the image has no area.
/// \param x_px, y_px  from the left and from the top.
std::array<double, 3> texture_weights(const TexturedMesh& textured, std::uint32_t face, double x_px,
                                      double y_px, int side_px);

} // namespace taihu
