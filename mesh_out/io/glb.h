#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mesh_out/position_grid.h"
#include "mesh_out/textured_mesh.h"
#include "stats/core/tri_mesh.h"

namespace taihu {

/// A number at each position, by a name that glTF leaves to applications: `_` and capitals.
struct VertexValues {
    std::string name;
    std::vector<float> values;
};

/// A level of detail as it stands in a file.
struct EncodedLevel {
    std::string draco; ///< one Draco mesh bit stream
    TriMesh decoded;   ///< what decoding those bytes gives
    double screen_coverage =
        0; ///< MSFT_screencoverage: share of the screen down to which it is used
    // With a texture, one of these per position of `decoded`; else empty.
    std::vector<TexturePoint> texture;
    std::vector<Vec3> tangents;
    std::string normal_png, occlusion_png, colour_png; ///< its images, or empty
    std::vector<std::string> values; ///< names of the numbers that vertices have beside
};

/// Compress with Draco's ExpertEncoder: edgebreaker, positions on `grid` without loss, normals
/// (when the mesh has them) in 10 bits, openness (likewise) as grey of 8 bits, speed 3; then decode
/// the bytes again. \param recipe  kept in the stream's metadata; empty for a GLB, which has a
/// place for it. \throws Error numeric when the decoded mesh has other counts, or a position that
/// is not
///   one of the mesh's; bad_argument when a position is not on the grid.
EncodedLevel encode_draco(const TriMesh& mesh, const PositionGrid& grid,
                          const std::string& recipe = {});

/// The same with texture points, without loss, tangents in 8 bits and `values` in 12, of the range
/// of each. What is decoded is cut where
/// the texture has seams, and the connectivity of what is coded is not.
/// \throws as encode_draco(); bad_argument: texture points that lie on no grid of 18 bits in 0..1,
/// or as many others as positions; values that are not finite, or not one per position.
EncodedLevel encode_draco(const TexturedMesh& textured, const PositionGrid& grid,
                          std::span<const VertexValues> values = {});

/// \param where  stands for the file's name in messages.
/// \throws Error bad_input: not a Draco mesh, cut short, no positions, an index past the last
/// point,
///   a non-finite position.
TriMesh decode_draco(std::string_view bytes, const std::string& where);

struct GlbSettings {
    std::string name = "rock"; ///< of the node and the mesh; levels are name, name_lod1, ...
    std::string recipe{};      ///< JSON text kept in asset.extras.taihu_recipe, or empty
    double roughness = 0.9;    ///< of the one material, 0..1
    double grey = 0.56;        ///< base colour, linear, 0..1
    Vec3 shift{};              ///< added to all positions, by the nodes [m]
};

/// A GLB of Draco levels, finest first: KHR_draco_mesh_compression (required), openness as COLOR_0,
/// which viewers multiply the base colour with, texture points as TEXCOORD_0, tangents as TANGENT,
/// values by their names,
/// and the images as normalTexture, occlusionTexture and baseColorTexture of a material of the
/// level's own, and with more than one level MSFT_lod on the first node and MSFT_screencoverage in
/// its extras. Accessor counts, minima and maxima are those of the decoded arrays. The same input
/// gives the same bytes.
std::string format_glb(std::span<const EncodedLevel> levels, const GlbSettings& settings = {});

/// What brings the middle of the foot of a box to the origin, within 1/4096 of its longest side.
Vec3 foot_shift(const Box& box);

} // namespace taihu
