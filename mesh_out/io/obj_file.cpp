#include <algorithm>
#include <array>
#include <charconv>

#include "mesh_out/io/mesh_formats_detail.h"
#include "mesh_out/io/polygons_detail.h"
#include "mesh_out/io/text_cursor_detail.h"

namespace taihu {
namespace {

/// Keywords that say nothing about faces; the most frequent ones first.
constexpr std::array<std::string_view, 24> kSkipped = {
    "vn",     "vt",     "g",   "usemtl",     "s",         "o",     "mtllib",   "vp",
    "l",      "p",      "mg",  "bevel",      "c_interp",  "ctech", "d_interp", "lod",
    "maplib", "usemap", "deg", "shadow_obj", "trace_obj", "stech", "cstype",   "bmat"};
constexpr std::array<std::string_view, 8> kFreeForm = {"surf", "curv", "curv2", "trim",
                                                       "hole", "call", "csh",   "con"};

template <std::size_t n>
bool contains(const std::array<std::string_view, n>& words, std::string_view word) {
    return std::find(words.begin(), words.end(), word) != words.end();
}

void read_vertex(TextCursor& cursor, TriMesh& mesh) {
    Vec3 p;
    p.x = cursor.number("x");
    p.y = cursor.number("y");
    p.z = cursor.number("z");
    mesh.positions.push_back(p);
    // A weight, a colour, or both may follow.
    int n_more = 0;
    while (!cursor.line_done()) {
        cursor.number("a number after z");
        ++n_more;
    }
    if (n_more != 0 && n_more != 1 && n_more != 3 && n_more != 4)
        cursor.fail("a vertex of " + std::to_string(3 + n_more) + " numbers",
                    "give x y z, x y z w or x y z r g b");
}

/// The vertex of a corner `v`, `v/vt`, `v//vn` or `v/vt/vn`; negative indices count back.
std::uint32_t read_corner(TextCursor& cursor, std::string_view word, std::size_t n_vertices) {
    const char *at = word.data(), *const end = at + word.size();
    std::int64_t index = 0;
    auto read = std::from_chars(at, end, index);
    bool right = read.ec == std::errc();
    at = read.ptr;
    for (int n_slashes = 0; right && at != end; ++n_slashes) {
        std::int64_t unused = 0;
        right = *at == '/' && n_slashes < 2;
        if (right && ++at != end && *at != '/') {
            read = std::from_chars(at, end, unused);
            right = read.ec == std::errc();
            at = read.ptr;
        }
    }
    if (!right)
        cursor.fail_word("a corner", word, "not v, v/vt, v//vn or v/vt/vn");
    const auto n = static_cast<std::int64_t>(n_vertices);
    if (index < -n || index > n || index == 0)
        cursor.fail("a face names vertex " + std::to_string(index) + ", but " + std::to_string(n) +
                        " vertices stand before it, counted from 1",
                    "mend the index or put the vertices first");
    return static_cast<std::uint32_t>(index > 0 ? index - 1 : n + index);
}

} // namespace

MeshFile parse_obj(std::string_view bytes, const std::string& where, Progress* progress) {
    MeshFile file;
    TriMesh& mesh = file.levels.emplace_back();
    TextCursor cursor(bytes, where, {.hash_comments = true, .continuations = true}, progress);
    std::vector<std::uint32_t> corners;
    do {
        const std::string_view keyword = cursor.word();
        if (keyword == "v") {
            read_vertex(cursor, mesh);
        } else if (keyword == "f" || keyword == "fo") {
            corners.clear();
            for (auto word = cursor.word(); !word.empty(); word = cursor.word())
                corners.push_back(read_corner(cursor, word, mesh.positions.size()));
            if (corners.size() < 3)
                cursor.fail("a face of " + std::to_string(corners.size()) + " corners",
                            "give three or more");
            if (!add_face(file, corners))
                cursor.fail(kTooManyCorners, kTriangulateFirst);
        } else if (contains(kFreeForm, keyword)) {
            cursor.fail("'" + std::string(keyword) + "' (free-form surfaces) is not read",
                        "export polygons");
        } else if (keyword.empty() || contains(kSkipped, keyword)) {
            cursor.skip_line(); // continuation lines belong to it
        } else {
            cursor.fail("unknown keyword '" + printable(keyword) + "'",
                        "mend the file, or name it by its format" +
                            did_you_mean(keyword, std::span(kSkipped)));
        }
    } while (cursor.next_line());
    file.recipe = cursor.recipe();
    return file;
}

std::string format_obj(const TriMesh& mesh, const std::string& recipe) {
    std::string out = "# taihu\n" + recipe_comments(recipe, "# ");
    out.reserve(out.size() + 40 * mesh.positions.size() + 24 * mesh.triangles.size());
    for (const Vec3& p : mesh.positions) {
        out += 'v';
        for (int axis = 0; axis < 3; ++axis) {
            out += ' ';
            append_text(out, p[axis]);
        }
        out += '\n';
    }
    for (const Triangle& t : mesh.triangles)
        out += "f " + std::to_string(t[0] + std::uint64_t{1}) + ' ' +
               std::to_string(t[1] + std::uint64_t{1}) + ' ' +
               std::to_string(t[2] + std::uint64_t{1}) + '\n';
    return out;
}

} // namespace taihu
