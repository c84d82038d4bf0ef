#include "mesh_out/io/mesh_file.h"

#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "mesh_out/io/mesh_formats_detail.h"
#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/text.h"

namespace taihu {
namespace {

constexpr std::array<std::string_view, 6> kExtensions = {".obj", ".ply", ".stl",
                                                         ".off", ".glb", ".drc"};
constexpr std::array<const char*, 6> kNames = {"OBJ", "PLY", "STL", "OFF", "GLB", "DRC"};
constexpr double kMostPlace_m = 1e12; // what is multiplied and summed of it stays finite
constexpr std::string_view kRecipeMarker = "taihu_recipe ";

const char* name_of(MeshFormat format) {
    return kNames[static_cast<std::size_t>(format)];
}

/// The format that the first bytes name beyond doubt.
std::optional<MeshFormat> format_by_content(std::string_view bytes) {
    if (bytes.starts_with("glTF"))
        return MeshFormat::glb;
    if (bytes.starts_with("DRACO"))
        return MeshFormat::drc;
    if (bytes.starts_with("ply\n") || bytes.starts_with("ply\r\n"))
        return MeshFormat::ply;
    if (bytes.starts_with("OFF\n") || bytes.starts_with("OFF\r\n"))
        return MeshFormat::off;
    if (bytes.starts_with("solid "))
        return MeshFormat::stl;
    return std::nullopt;
}

MeshFile parse_as(std::string_view bytes, MeshFormat format, const std::string& where, bool is_own,
                  Progress* progress) {
    switch (format) {
    case MeshFormat::obj:
        return parse_obj(bytes, where, progress);
    case MeshFormat::ply:
        return parse_ply(bytes, where, progress);
    case MeshFormat::stl:
        return parse_stl(bytes, where, progress);
    case MeshFormat::off:
        return parse_off(bytes, where, progress);
    case MeshFormat::drc:
        return parse_drc(bytes, where, is_own, progress);
    case MeshFormat::glb:
        break;
    }
    return parse_glb(bytes, where, is_own, progress);
}

} // namespace

std::optional<MeshFormat> mesh_format(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    for (char& c : extension)
        if (c >= 'A' && c <= 'Z')
            c = static_cast<char>(c - 'A' + 'a');
    for (std::size_t i = 0; i < kExtensions.size(); ++i)
        if (extension == kExtensions[i])
            return static_cast<MeshFormat>(i);
    return std::nullopt;
}

MeshFile read_mesh(const std::filesystem::path& path, const MeshReadSettings& settings,
                   Progress* progress) {
    const auto format = mesh_format(path);
    if (!format)
        throw Error(Fault::unsupported, base_name(path) +
                                            ": not a mesh format that is read here; give one of " +
                                            kMeshExtensions);
    return parse_mesh(read_file(path), *format, base_name(path), settings, progress);
}

MeshFile parse_mesh(std::string_view bytes, MeshFormat format, const std::string& where,
                    const MeshReadSettings& settings, Progress* progress) {
    if (!(settings.unit_m > 0) || !std::isfinite(settings.unit_m))
        throw Error(Fault::bad_argument, "read_mesh: unit_m is " + std::to_string(settings.unit_m) +
                                             ", must be finite and > 0; give the length of one "
                                             "file unit in metres");
    report_stage(progress, "read mesh");
    check_cancelled(progress);
    if (bytes.empty())
        throw Error(Fault::bad_input, where + ":1: the file is empty; copy or export it again");
    const auto content = format_by_content(bytes);
    // A binary STL may begin with any 80 bytes.
    if (content && *content != format && format != MeshFormat::stl)
        throw Error(Fault::bad_input, where + ":1: the content is " + name_of(*content) +
                                          ", the name says " + name_of(format) + "; rename it");
    MeshFile file = parse_as(bytes, format, where, settings.is_own, progress);
    file.format = format;
    for (TriMesh& level : file.levels) {
        if (level.triangles.empty())
            throw Error(Fault::bad_input,
                        where + ":1: no face" +
                            (file.n_degenerate_faces > 0 ? " with an inside" : "") +
                            "; export the mesh with its faces");
        for (Vec3& p : level.positions) {
            p *= settings.unit_m;
            if (settings.up == UpAxis::z)
                p = {p.x, p.z, -p.y};
            for (int axis = 0; axis < 3; ++axis)
                if (!(std::abs(p[axis]) <= kMostPlace_m))
                    throw Error(Fault::bad_input,
                                where + ":1: a position is beyond 1e12 m; check the unit");
        }
        if (settings.up == UpAxis::z)
            for (Vec3& n : level.normals)
                n = {n.x, n.z, -n.y};
    }
    report_fraction(progress, 1);
    return file;
}

std::string format_mesh(const TriMesh& mesh, MeshFormat format, const std::string& recipe) {
    check_writable(mesh, "format_mesh");
    switch (format) {
    case MeshFormat::obj:
        return format_obj(mesh, recipe);
    case MeshFormat::ply:
        return format_ply(mesh, recipe);
    case MeshFormat::stl:
        return format_stl(mesh);
    case MeshFormat::off:
        return format_off(mesh, recipe);
    case MeshFormat::drc:
        return format_drc(mesh, recipe);
    case MeshFormat::glb:
        break;
    }
    return format_plain_glb(mesh, recipe);
}

void check_writable(const TriMesh& mesh, const std::string& who) {
    const auto fail = [&](const std::string& what, const char* remedy) {
        throw Error(Fault::bad_argument, who + ": " + what + "; " + remedy);
    };
    if (mesh.triangles.empty())
        fail("the mesh has no triangle", "give one with faces");
    if (mesh.positions.size() > std::numeric_limits<std::uint32_t>::max())
        fail(std::to_string(mesh.positions.size()) + " positions, at most 2^32 - 1", "simplify it");
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
        for (int axis = 0; axis < 3; ++axis)
            if (!(std::abs(mesh.positions[i][axis]) <= kMostPlace_m))
                fail("positions[" + std::to_string(i) + "] is beyond 1e12 m", "scale it down");
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        for (const std::uint32_t corner : mesh.triangles[i])
            if (corner >= mesh.positions.size())
                fail("triangles[" + std::to_string(i) + "] names vertex " + std::to_string(corner) +
                         " of " + std::to_string(mesh.positions.size()),
                     "mend the mesh");
    if (!mesh.normals.empty() && mesh.normals.size() != mesh.positions.size())
        fail(std::to_string(mesh.normals.size()) + " normals for " +
                 std::to_string(mesh.positions.size()) + " positions",
             "give one for each or none");
    for (std::size_t i = 0; i < mesh.normals.size(); ++i)
        if (!(std::abs(length(mesh.normals[i]) - 1) < 1e-3))
            fail("normals[" + std::to_string(i) + "] is not a unit vector", "normalise it");
    if (!mesh.openness.empty() && mesh.openness.size() != mesh.positions.size())
        fail(std::to_string(mesh.openness.size()) + " values of openness for " +
                 std::to_string(mesh.positions.size()) + " positions",
             "give one for each or none");
    for (std::size_t i = 0; i < mesh.openness.size(); ++i)
        if (!(mesh.openness[i] >= 0 && mesh.openness[i] <= 1))
            fail("openness[" + std::to_string(i) + "] is not in 0..1", "mend it");
}

std::string recipe_comments(const std::string& recipe, std::string_view prefix) {
    std::string out;
    for (std::size_t at = 0; at < recipe.size();) {
        const std::size_t end = std::min(recipe.find('\n', at), recipe.size());
        out.append(prefix).append(kRecipeMarker).append(recipe, at, end - at) += '\n';
        at = end + 1;
    }
    return out;
}

void take_recipe_line(std::string_view comment, std::string& recipe) {
    if (comment.starts_with(' '))
        comment.remove_prefix(1);
    if (!comment.starts_with(kRecipeMarker))
        return;
    if (!recipe.empty())
        recipe += '\n';
    recipe += comment.substr(kRecipeMarker.size());
}

void append_text(std::string& out, double value) {
    char text[32];
    const auto end =
        std::to_chars(text, text + sizeof text, value, std::chars_format::general, 9).ptr;
    out.append(text, end);
}

} // namespace taihu
