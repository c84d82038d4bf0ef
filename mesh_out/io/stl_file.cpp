#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <limits>
#include <random>

#include "mesh_out/io/binary_detail.h"
#include "mesh_out/io/mesh_formats_detail.h"
#include "mesh_out/io/polygons_detail.h"
#include "mesh_out/io/text_cursor_detail.h"
#include "stats/core/error.h"

namespace taihu {
namespace {

constexpr std::size_t kHeaderBytes = 80, kFirstRecord = 84, kRecordBytes = 50;

/// Gives bit-equal positions one index, in the order of their first appearance: a hash table with
/// open addressing, because a large STL has tens of millions of corners. Its hash is one drawn from
/// a universal family (multiply and shift), so that no file can be made whose positions all fall
/// together; the indices do not depend on it.
class Welder {
public:
    explicit Welder(std::vector<Vec3>& positions) : positions_(positions), slots_(64, kEmpty) {
        std::random_device random;
        for (std::uint64_t& key : keys_)
            key = std::uint64_t{random()} << 32 | random();
    }

    std::uint32_t index(Vec3 p) {
        p += Vec3{0, 0, 0}; // -0 becomes +0
        std::size_t slot = first_slot(p);
        while (slots_[slot] != kEmpty) {
            if (positions_[slots_[slot]] == p)
                return slots_[slot];
            slot = (slot + 1) & (slots_.size() - 1);
        }
        slots_[slot] = static_cast<std::uint32_t>(positions_.size());
        positions_.push_back(p);
        if (positions_.size() * 2 > slots_.size())
            grow();
        return static_cast<std::uint32_t>(positions_.size() - 1);
    }

private:
    static constexpr std::uint32_t kEmpty = std::numeric_limits<std::uint32_t>::max();

    std::size_t first_slot(const Vec3& p) const {
        std::uint64_t hash = keys_[6];
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto bits = std::bit_cast<std::uint64_t>(p[static_cast<int>(axis)]);
            hash += keys_[2 * axis] * (bits >> 32) + keys_[2 * axis + 1] * (bits & 0xffffffffu);
        }
        return static_cast<std::size_t>(hash >> 32) & (slots_.size() - 1);
    }

    void grow() {
        slots_.assign(slots_.size() * 2, kEmpty);
        for (std::uint32_t i = 0; i < positions_.size(); ++i) {
            std::size_t slot = first_slot(positions_[i]);
            while (slots_[slot] != kEmpty)
                slot = (slot + 1) & (slots_.size() - 1);
            slots_[slot] = i;
        }
    }

    std::vector<Vec3>& positions_;
    std::vector<std::uint32_t> slots_; ///< a power of 2 of them
    std::array<std::uint64_t, 7> keys_{};
};

void parse_binary(std::string_view bytes, const std::string& where, MeshFile& file,
                  Progress* progress) {
    TriMesh& mesh = file.levels.front();
    Welder welder(mesh.positions);
    const std::size_t n = (bytes.size() - kFirstRecord) / kRecordBytes;
    mesh.triangles.reserve(n);
    for (std::size_t i = 0; i < n; ++i) {
        const std::size_t record = kFirstRecord + i * kRecordBytes;
        Triangle triangle{};
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const std::size_t at = record + 12 * (corner + 1); // the normal comes first
            const Vec3 p{load_number<float>(bytes.data() + at),
                         load_number<float>(bytes.data() + at + 4),
                         load_number<float>(bytes.data() + at + 8)};
            if (!is_finite(p))
                throw Error(Fault::bad_input, where + ":byte " + std::to_string(at) +
                                                  ": a position is not finite; mend the file or "
                                                  "export it again");
            triangle[corner] = welder.index(p);
        }
        add_triangle(file, mesh, triangle);
        if ((i & 0xffff) == 0) {
            check_cancelled(progress);
            report_fraction(progress, static_cast<double>(i) / static_cast<double>(n));
        }
    }
}

bool same_word(std::string_view found, std::string_view lower) {
    return std::equal(found.begin(), found.end(), lower.begin(), lower.end(), [](char a, char b) {
        return std::tolower(static_cast<unsigned char>(a)) == b;
    });
}

void expect(TextCursor& cursor, const char* wanted) {
    cursor.next_word();
    const std::string_view found = cursor.word();
    if (!same_word(found, wanted))
        cursor.fail("'" + printable(found) + "' where '" + wanted + "' belongs",
                    "the file is cut short or damaged");
}

bool comes_next(TextCursor cursor, std::string_view wanted) {
    cursor.next_word();
    return same_word(cursor.word(), wanted);
}

Triangle read_facet(TextCursor& cursor, Welder& welder) {
    expect(cursor, "facet");
    expect(cursor, "normal");
    for (int i = 0; i < 3; ++i) // not judged: writers put nan where a facet has no area
        if (!cursor.next_word() || cursor.word().empty())
            cursor.fail_word("a normal", "", "");
    expect(cursor, "outer");
    expect(cursor, "loop");
    Triangle triangle{};
    for (std::uint32_t& corner : triangle) {
        expect(cursor, "vertex");
        Vec3 p;
        p.x = cursor.number("x");
        p.y = cursor.number("y");
        p.z = cursor.number("z");
        corner = welder.index(p);
    }
    expect(cursor, "endloop");
    expect(cursor, "endfacet");
    return triangle;
}

void parse_ascii(std::string_view bytes, const std::string& where, MeshFile& file,
                 Progress* progress) {
    TextCursor cursor(bytes, where, {}, progress);
    TriMesh& mesh = file.levels.front();
    Welder welder(mesh.positions);
    do { // some writers put several solids into one file
        expect(cursor, "solid");
        cursor.skip_line(); // a name of any words
        while (comes_next(cursor, "facet"))
            add_triangle(file, mesh, read_facet(cursor, welder));
        expect(cursor, "endsolid");
        cursor.skip_line();
    } while (cursor.next_word());
}

} // namespace

MeshFile parse_stl(std::string_view bytes, const std::string& where, Progress* progress) {
    MeshFile file;
    file.levels.emplace_back();
    // The size decides, because binary files may begin with "solid" too.
    const bool has_count = bytes.size() >= kFirstRecord;
    const std::uint64_t n =
        has_count ? load_number<std::uint32_t>(bytes.data() + kHeaderBytes) : std::uint64_t{0};
    if (has_count && bytes.size() == kFirstRecord + kRecordBytes * n) {
        parse_binary(bytes, where, file, progress);
        return file;
    }
    const auto first = bytes.find_first_not_of(" \t\r\n");
    if (first != std::string_view::npos && same_word(bytes.substr(first, 5), "solid")) {
        parse_ascii(bytes, where, file, progress);
        return file;
    }
    if (!has_count)
        throw Error(Fault::bad_input, where + ":byte " + std::to_string(bytes.size()) +
                                          ": the file ends within the header of a binary STL; "
                                          "copy or export it again");
    throw Error(Fault::bad_input, where + ":byte 80: " + std::to_string(n) + " triangles make " +
                                      std::to_string(kFirstRecord + kRecordBytes * n) +
                                      " bytes, the file has " + std::to_string(bytes.size()) +
                                      "; copy or export it again");
}

std::string format_stl(const TriMesh& mesh) {
    if (mesh.triangles.size() > std::numeric_limits<std::uint32_t>::max())
        throw Error(Fault::bad_argument, "format_mesh: " + std::to_string(mesh.triangles.size()) +
                                             " triangles, an STL counts to 2^32 - 1; simplify it");
    std::string out = "binary STL of taihu";
    out.resize(kHeaderBytes);
    out.reserve(kFirstRecord + kRecordBytes * mesh.triangles.size());
    append_number(out, static_cast<std::uint32_t>(mesh.triangles.size()));
    for (const Triangle& t : mesh.triangles) {
        const Vec3 &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
        const Vec3 normal = normalized(cross(b - a, c - a));
        for (const Vec3& v : {normal, a, b, c})
            for (int axis = 0; axis < 3; ++axis)
                append_number(out, static_cast<float>(v[axis]));
        append_number(out, std::uint16_t{0});
    }
    return out;
}

} // namespace taihu
