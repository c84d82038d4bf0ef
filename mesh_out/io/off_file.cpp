#include "mesh_out/io/mesh_formats_detail.h"
#include "mesh_out/io/polygons_detail.h"
#include "mesh_out/io/text_cursor_detail.h"

namespace taihu {
namespace {

struct OffHeader {
    bool normals = false, colours = false;
    std::size_t n_vertices = 0, n_faces = 0;
};

/// A count that the rest of the file can hold, when one thing takes `min_bytes` or more of text.
std::size_t read_count(TextCursor& cursor, const char* what, std::size_t min_bytes) {
    if (!cursor.next_word())
        cursor.fail_word(what, "", "");
    const std::int64_t n = cursor.integer(what);
    // One byte is forgiven: the last line needs no end.
    if (n < 0 || static_cast<std::uint64_t>(n) > (cursor.bytes_left() + 1) / min_bytes)
        cursor.fail(std::string(what) + " is " + std::to_string(n) + ", but " +
                        std::to_string(cursor.bytes_left()) + " bytes follow",
                    "the file is cut short or damaged");
    return static_cast<std::size_t>(n);
}

OffHeader read_header(TextCursor& cursor) {
    cursor.next_word();
    const std::string_view magic = cursor.word();
    OffHeader header;
    header.normals = magic == "NOFF" || magic == "CNOFF";
    header.colours = magic == "COFF" || magic == "CNOFF";
    if (magic != "OFF" && !header.normals && !header.colours) {
        const bool known = magic.size() <= 7 && magic.ends_with("OFF");
        cursor.fail("the file begins with '" + printable(magic) + "'",
                    known ? "of the OFF family, OFF, COFF, NOFF and CNOFF are read"
                          : "an OFF file begins with OFF");
    }
    header.n_vertices = read_count(cursor, "the number of vertices", 6); // "0 0 0\n"
    header.n_faces = read_count(cursor, "the number of faces", 8);       // "3 0 1 2\n"
    if (!cursor.next_word())
        cursor.fail_word("the number of edges", "", "");
    cursor.integer("the number of edges"); // often wrong, and of no use here
    return header;
}

double read_number(TextCursor& cursor, const char* what) {
    cursor.next_word();
    return cursor.number(what);
}

/// What may stand behind a vertex or a face on its line: up to four numbers.
int skip_colour(TextCursor& cursor) {
    int n = 0;
    for (; !cursor.line_done(); ++n) {
        if (n == 4)
            cursor.end_line();
        cursor.number("a colour");
    }
    return n;
}

void read_vertex(TextCursor& cursor, const OffHeader& header, TriMesh& mesh) {
    Vec3 p;
    p.x = read_number(cursor, "x");
    p.y = read_number(cursor, "y");
    p.z = read_number(cursor, "z");
    mesh.positions.push_back(p);
    for (int i = 0; header.normals && i < 3; ++i)
        read_number(cursor, "a normal");
    if (header.colours && skip_colour(cursor) < 3)
        cursor.fail("a vertex without its colour", "write x y z r g b a on one line");
}

void read_corners(TextCursor& cursor, std::size_t n_vertices, std::vector<std::uint32_t>& corners) {
    const std::size_t n = read_count(cursor, "the number of corners", 2);
    if (n < 3)
        cursor.fail("a face of " + std::to_string(n) + " corners", "give three or more");
    corners.clear();
    for (std::size_t i = 0; i < n; ++i) {
        cursor.next_word();
        const std::int64_t index = cursor.integer("a corner");
        if (index < 0 || static_cast<std::uint64_t>(index) >= n_vertices)
            cursor.fail("a face names vertex " + std::to_string(index) + " of " +
                            std::to_string(n_vertices) + ", counted from 0",
                        "mend the index");
        corners.push_back(static_cast<std::uint32_t>(index));
    }
}

} // namespace

MeshFile parse_off(std::string_view bytes, const std::string& where, Progress* progress) {
    MeshFile file;
    TriMesh& mesh = file.levels.emplace_back();
    TextCursor cursor(bytes, where, {.hash_comments = true}, progress);
    const OffHeader header = read_header(cursor);
    mesh.positions.reserve(header.n_vertices);
    for (std::size_t i = 0; i < header.n_vertices; ++i)
        read_vertex(cursor, header, mesh);
    mesh.triangles.reserve(header.n_faces);
    std::vector<std::uint32_t> corners;
    for (std::size_t i = 0; i < header.n_faces; ++i) {
        read_corners(cursor, header.n_vertices, corners);
        if (!add_face(file, corners))
            cursor.fail(kTooManyCorners, kTriangulateFirst);
        skip_colour(cursor);
    }
    if (cursor.next_word())
        cursor.fail("'" + printable(cursor.word()) + "' after the last face",
                    "the counts in the header do not match what follows");
    file.recipe = cursor.recipe();
    return file;
}

std::string format_off(const TriMesh& mesh, const std::string& recipe) {
    std::string out = "OFF\n" + recipe_comments(recipe, "# ") +
                      std::to_string(mesh.positions.size()) + ' ' +
                      std::to_string(mesh.triangles.size()) + " 0\n";
    for (const Vec3& p : mesh.positions)
        for (int axis = 0; axis < 3; ++axis) {
            append_text(out, p[axis]);
            out += axis < 2 ? ' ' : '\n';
        }
    for (const Triangle& t : mesh.triangles)
        out += "3 " + std::to_string(t[0]) + ' ' + std::to_string(t[1]) + ' ' +
               std::to_string(t[2]) + '\n';
    return out;
}

} // namespace taihu
