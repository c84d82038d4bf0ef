#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mesh_out/textured_mesh.h"
#include "stats/core/progress.h"
#include "stats/core/tri_mesh.h"

namespace taihu {

/// Draco's unique ids of the attributes that encode_draco() writes.
inline constexpr std::uint32_t kDracoPositionId = 0, kDracoNormalId = 1;
/// They are numbered without a gap.
inline std::uint32_t draco_colour_id(const TriMesh& mesh) {
    return mesh.normals.empty() ? 1 : 2;
}
inline std::uint32_t draco_texture_id(const TriMesh& mesh) {
    return draco_colour_id(mesh) + (mesh.openness.empty() ? 0 : 1);
}
inline std::uint32_t draco_tangent_id(const TriMesh& mesh) {
    return draco_texture_id(mesh) + 1;
}

/// Of the first of the values that a level has beside; the others follow.
inline std::uint32_t draco_values_id(const TriMesh& mesh) {
    return draco_tangent_id(mesh) + 1;
}

/// A decoded mesh with the attribute ids that glTF refers to.
struct DracoMesh {
    TriMesh mesh;
    std::uint32_t position_id = 0;
    std::optional<std::uint32_t> normal_id, colour_id;
    std::string recipe;             ///< of the stream's metadata, or empty
    std::vector<std::uint32_t> ids; ///< of all attributes
};

/// decode_draco() and the ids.
DracoMesh decode_draco_mesh(std::string_view bytes, const std::string& where);

/// Some bytes of a file, and where they are in messages: `rock.glb:byte 1234`.
struct DracoStream {
    std::string_view bytes;
    std::string where;
};

/// decode_draco_mesh() of each: of up to 32 in one program of its own, unless they are our own.
/// \param where  the file. \param most_items  vertices and triangles of all together.
/// \throws Error bad_input: more than those; also as read_foreign().
std::vector<DracoMesh> read_draco(std::span<const DracoStream> streams, const std::string& where,
                                  bool is_own, std::size_t most_items, Progress* progress);

/// What encode_draco() made of a textured mesh.
TexturedMesh decode_textured_draco(std::string_view bytes, const std::string& where);

} // namespace taihu
