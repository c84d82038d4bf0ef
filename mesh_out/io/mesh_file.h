#pragma once
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "stats/core/progress.h"
#include "stats/core/tri_mesh.h"

namespace taihu {

enum class MeshFormat { obj, ply, stl, off, glb, drc };

/// The extensions of all of them, for messages and help texts.
inline constexpr const char* kMeshExtensions = ".obj .ply .stl .off .glb .drc";

/// The format that the extension of `path` names, or nothing.
std::optional<MeshFormat> mesh_format(const std::filesystem::path& path);

/// Which axis of the file points up; the result is always +Y up, right-handed.
enum class UpAxis { y, z };

struct MeshReadSettings {
    double unit_m = 1; ///< length of one file unit [m], > 0; 1 for a glTF that keeps to its rules
    UpAxis up = UpAxis::y; ///< z: (x, y, z) becomes (x, z, -y)
    bool is_own = false; ///< bytes that this program has just made: Draco's decoder may trust them
};

/// What a mesh file held. Every face becomes triangles, is counted in n_degenerate_faces, or is an
/// error.
struct MeshFile {
    MeshFormat format = MeshFormat::obj;
    std::vector<TriMesh> levels; ///< a GLB with MSFT_lod has one per level, finest first; else one
    std::vector<double> coverages; ///< MSFT_screencoverage, or empty
    bool draco = false;            ///< at least one primitive was Draco-compressed, or a DRC
    std::size_t n_polygons = 0;    ///< faces in the file that had more than three corners
    /// Faces left out because fewer than three different corners remained: they have no inside, and
    /// a surface is the same without them. (A zero-area face of three different corners stays.)
    std::size_t n_degenerate_faces = 0;
    std::string recipe;    ///< the recipe (JSON text) that made the file, or empty
    std::string generator; ///< asset.generator of a GLB, or empty
};

/// Read a mesh. The content decides between ascii and binary; the extension names the format, and a
/// content that contradicts it is an error. Quads and n-gons are triangulated (planar convex ones
/// as fans, quads along the shorter diagonal, others by ear clipping in their best plane); corners
/// that repeat their neighbour are dropped first. Equal positions of an STL become one vertex.
/// Colours, texture coordinates and materials are skipped, and normals too (they follow from the
/// faces), but for those of a DRC, or of a GLB when every primitive has them.
///
/// GLB: all triangle primitives of the default scene with their node transforms; points
/// and lines, skins and morph targets are ignored; at most 2^24 vertices and triangles, or one per
/// byte. A GLB whose Draco data do not match its accessors is refused; accessor minima and maxima
/// may be off by 1/256 of the largest side, because many encoders state those of their input. Draco
/// streams are decoded in a program of their own (stats/core/foreign.h).
/// \throws Error bad_input `<file>:<line or byte>: <what>; <remedy>` for anything cut short, a word
///   for a number, a non-finite coordinate, an index out of range, a count that the size of the
///   file cannot hold, or no face at all; as read_foreign(); io; unsupported for an unknown
///   extension or a required glTF extension that is not known here.
MeshFile read_mesh(const std::filesystem::path& path, const MeshReadSettings& settings = {},
                   Progress* progress = nullptr);

/// The same from bytes; `where` stands for the file's name in messages.
MeshFile parse_mesh(std::string_view bytes, MeshFormat format, const std::string& where,
                    const MeshReadSettings& settings = {}, Progress* progress = nullptr);

/// The bytes of a file: OBJ and OFF as text with 9 significant digits, PLY and STL binary
/// little-endian float, GLB uncompressed (float positions; normals and openness if there are any),
/// DRC on the coarsest position grid that holds all positions, else moved onto one of 18 bits.
/// `recipe` is kept where the format has a place for it (OBJ, OFF: '#' comment; PLY: comment; GLB:
/// asset.extras; DRC: metadata), and given back by parse_mesh (from a GLB as compact JSON); an STL
/// has none.
///
/// \throws Error bad_argument: an empty mesh, an index out of range, a position that float cannot
///   hold, normals that are not one unit vector per position.
std::string format_mesh(const TriMesh& mesh, MeshFormat format, const std::string& recipe = {});

} // namespace taihu
