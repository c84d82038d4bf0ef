#pragma once
#include <string>
#include <string_view>

#include "mesh_out/io/mesh_file.h"

// One reader and one writer per format, behind parse_mesh() and format_mesh(). The readers leave
// positions in the units and axes of the file.

namespace taihu {

MeshFile parse_obj(std::string_view bytes, const std::string& where, Progress* progress);
MeshFile parse_off(std::string_view bytes, const std::string& where, Progress* progress);
MeshFile parse_ply(std::string_view bytes, const std::string& where, Progress* progress);
MeshFile parse_stl(std::string_view bytes, const std::string& where, Progress* progress);
/// \param is_own  as MeshReadSettings.
MeshFile parse_glb(std::string_view bytes, const std::string& where, bool is_own,
                   Progress* progress);
MeshFile parse_drc(std::string_view bytes, const std::string& where, bool is_own,
                   Progress* progress);

std::string format_obj(const TriMesh& mesh, const std::string& recipe);
std::string format_off(const TriMesh& mesh, const std::string& recipe);
std::string format_ply(const TriMesh& mesh, const std::string& recipe);
std::string format_stl(const TriMesh& mesh);
std::string format_plain_glb(const TriMesh& mesh, const std::string& recipe);
std::string format_drc(const TriMesh& mesh, const std::string& recipe);

/// \throws Error bad_argument, when `mesh` cannot be written: empty, an index out of range,
/// positions
///   that float cannot hold, normals or openness that do not match. `who` begins the message.
void check_writable(const TriMesh& mesh, const std::string& who);

/// Each line of `recipe` behind `prefix` and a marker, for files whose comments are lines.
std::string recipe_comments(const std::string& recipe, std::string_view prefix);

/// Adds the text of a comment to `recipe` when it has that marker.
void take_recipe_line(std::string_view comment, std::string& recipe);

/// Append `value` with 9 significant digits, which give a float back bit for bit, without locale.
void append_text(std::string& out, double value);

} // namespace taihu
