#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "mesh_out/io/binary_detail.h"
#include "mesh_out/io/mesh_formats_detail.h"
#include "mesh_out/io/polygons_detail.h"
#include "mesh_out/io/text_cursor_detail.h"
#include "stats/core/error.h"

namespace taihu {
namespace {

enum class Scalar { i8, u8, i16, u16, i32, u32, f32, f64 };
enum class Encoding { ascii, little, big };

struct Property {
    std::string name;
    Scalar type = Scalar::f32;
    std::optional<Scalar> count_type; ///< of a list
};

struct Element {
    std::string name;
    std::uint64_t n = 0;
    std::vector<Property> properties;
};

struct Header {
    Encoding encoding = Encoding::ascii;
    std::vector<Element> elements;
    std::string recipe;
};

constexpr std::size_t size_of(Scalar type) {
    constexpr std::array<std::size_t, 8> kSizes = {1, 1, 2, 2, 4, 4, 4, 8};
    return kSizes[static_cast<std::size_t>(type)];
}

bool is_whole(Scalar type) {
    return type != Scalar::f32 && type != Scalar::f64;
}

Scalar read_type(TextCursor& cursor) {
    static constexpr std::array<std::string_view, 16> kNames = {
        "char", "uchar", "short", "ushort", "int",   "uint",   "float",   "double",
        "int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"};
    const std::string_view word = cursor.word();
    for (std::size_t i = 0; i < kNames.size(); ++i)
        if (word == kNames[i])
            return static_cast<Scalar>(i % 8);
    cursor.fail_word("a type", word, "a PLY type");
}

void read_property(TextCursor& cursor, Header& header) {
    if (header.elements.empty())
        cursor.fail("a property before any element", "mend the header");
    Property property;
    TextCursor ahead = cursor;
    if (ahead.word() == "list") {
        cursor.word();
        property.count_type = read_type(cursor);
        if (!is_whole(*property.count_type))
            cursor.fail("the length of a list is not a whole number", "mend the header");
    }
    property.type = read_type(cursor);
    property.name = cursor.word();
    if (property.name.empty())
        cursor.fail_word("the name of a property", "", "");
    header.elements.back().properties.push_back(std::move(property));
}

void read_element(TextCursor& cursor, Header& header) {
    Element element;
    element.name = cursor.word();
    for (const Element& other : header.elements)
        if (other.name == element.name)
            cursor.fail("a second element '" + printable(element.name) + "'", "mend the header");
    if (header.elements.size() == 64) // so that looking for the second one stays cheap
        cursor.fail("more than 64 elements", "mend the header");
    const std::int64_t n = cursor.integer("the number of an element");
    if (n < 0)
        cursor.fail("element '" + printable(element.name) + "' has " + std::to_string(n) + " items",
                    "mend the header");
    element.n = static_cast<std::uint64_t>(n);
    header.elements.push_back(std::move(element));
}

Encoding read_encoding(TextCursor& cursor) {
    const std::string_view name = cursor.word();
    if (const std::string_view version = cursor.word(); version != "1.0")
        cursor.fail_word("the PLY version", version, "1.0");
    if (name == "ascii")
        return Encoding::ascii;
    if (name == "binary_little_endian")
        return Encoding::little;
    if (name == "binary_big_endian")
        return Encoding::big;
    cursor.fail_word("the format", name, "ascii, binary_little_endian or binary_big_endian");
}

/// Leaves the cursor at the first byte of the body.
Header read_header(TextCursor& cursor) {
    Header header;
    std::optional<Encoding> encoding;
    cursor.next_word(); // some files begin with an empty line
    if (const std::string_view magic = cursor.word(); magic != "ply")
        cursor.fail("the file begins with '" + printable(magic) + "'",
                    "a PLY file begins with ply");
    for (;;) {
        cursor.end_line();
        if (!cursor.next_line())
            cursor.fail("the header has no end_header", "the file is cut short or damaged");
        const std::string_view keyword = cursor.word();
        if (keyword == "comment") {
            take_recipe_line(cursor.rest_of_line(), header.recipe);
        } else if (keyword == "obj_info") {
            cursor.rest_of_line();
        } else if (keyword == "format") {
            encoding = read_encoding(cursor);
        } else if (keyword == "element") {
            read_element(cursor, header);
        } else if (keyword == "property") {
            read_property(cursor, header);
        } else if (keyword == "end_header") {
            break;
        } else if (!keyword.empty()) {
            cursor.fail("unknown keyword '" + printable(keyword) + "'", "mend the header");
        }
    }
    if (!encoding)
        cursor.fail("the header states no format", "mend the header");
    header.encoding = *encoding;
    // The body begins right behind this line's end: a blank more would be its first byte.
    const std::string_view end = cursor.left();
    if (!end.starts_with('\n') && !end.starts_with("\r\n"))
        cursor.fail("end_header is not followed by a line end", "mend the header");
    cursor.next_line();
    return header;
}

/// The values of the body one after the other, whatever their encoding. A copy remembers a place.
class Body {
public:
    Body(std::string_view bytes, const std::string& where, Encoding encoding,
         const TextCursor& text, Progress* progress)
        : bytes_(bytes), where_(&where), encoding_(encoding), text_(text),
          at_(bytes.size() - text.bytes_left()), progress_(progress) {}

    [[noreturn]] void fail(const std::string& what, const std::string& remedy) const {
        if (encoding_ == Encoding::ascii)
            text_.fail(what, remedy);
        throw Error(Fault::bad_input,
                    *where_ + ":byte " + std::to_string(at_) + ": " + what + "; " + remedy);
    }

    std::size_t bytes_left() const {
        return encoding_ == Encoding::ascii ? text_.bytes_left() : bytes_.size() - at_;
    }

    /// How many items the rest of the file can hold, when each takes `bytes` or more. The last line
    /// of an ascii file needs no end.
    std::size_t room_for(std::size_t bytes) const {
        return (bytes_left() + (encoding_ == Encoding::ascii ? 1 : 0)) / bytes;
    }

    /// Bytes that a value takes at least.
    std::size_t min_bytes(Scalar type) const {
        return encoding_ == Encoding::ascii ? 2 : size_of(type); // a digit and a blank
    }

    void begin_record() {
        if (encoding_ == Encoding::ascii) {
            text_.next_word();
        } else if ((++n_records_ & 0xffff) == 0) {
            check_cancelled(progress_);
            report_fraction(progress_,
                            static_cast<double>(at_) / static_cast<double>(bytes_.size()));
        }
    }
    void end_record() {
        if (encoding_ == Encoding::ascii)
            text_.end_line();
    }

    /// What follows as a number; not finite only from a binary file. Every type fits a double
    /// exactly.
    double value(const Property& property, Scalar type) {
        if (encoding_ == Encoding::ascii)
            return text_.number(property.name.c_str());
        const std::size_t size = size_of(type);
        if (bytes_.size() - at_ < size)
            fail("the file ends within '" + printable(property.name) + "'",
                 "copy or export it again");
        const char* from = bytes_.data() + at_;
        at_ += size;
        const auto order = encoding_ == Encoding::little ? std::endian::little : std::endian::big;
        switch (type) {
        case Scalar::i8:
            return load_number<std::int8_t>(from);
        case Scalar::u8:
            return load_number<std::uint8_t>(from);
        case Scalar::i16:
            return load_number<std::int16_t>(from, order);
        case Scalar::u16:
            return load_number<std::uint16_t>(from, order);
        case Scalar::i32:
            return load_number<std::int32_t>(from, order);
        case Scalar::u32:
            return load_number<std::uint32_t>(from, order);
        case Scalar::f32:
            return load_number<float>(from, order);
        case Scalar::f64:
            break;
        }
        return load_number<double>(from, order);
    }

    /// The length of a list, which the rest of the file can hold.
    std::size_t list_length(const Property& property) {
        const double n = value(property, *property.count_type);
        if (!(n >= 0) || n != std::floor(n) ||
            n > static_cast<double>(room_for(min_bytes(property.type))))
            fail("a list '" + printable(property.name) + "' of " + number_text(n) + " items, but " +
                     std::to_string(bytes_left()) + " bytes follow",
                 "the file is cut short or damaged");
        return static_cast<std::size_t>(n);
    }

    static std::string number_text(double value) {
        std::string text;
        append_text(text, value);
        return text;
    }

private:
    std::string_view bytes_;
    const std::string* where_;
    Encoding encoding_;
    TextCursor text_; ///< the place in an ascii body
    std::size_t at_;  ///< the place in a binary one
    Progress* progress_;
    std::uint64_t n_records_ = 0;
};

void skip(Body& body, const Property& property) {
    const std::size_t n = property.count_type ? body.list_length(property) : 1;
    for (std::size_t i = 0; i < n; ++i)
        body.value(property, property.type);
}

/// Refuses a count of items that the rest of the file cannot hold.
void check_count(const Body& body, const Element& element) {
    std::size_t record = 0;
    for (const Property& property : element.properties)
        record += body.min_bytes(property.count_type ? *property.count_type : property.type);
    if (record > 0 && element.n > body.room_for(record))
        body.fail(std::to_string(element.n) + " items of '" + printable(element.name) +
                      "' cannot stand in the " + std::to_string(body.bytes_left()) +
                      " bytes that follow",
                  "the file is cut short or damaged");
}

template <class TakeProperty>
void read_records(Body& body, const Element& element, const TakeProperty& take) {
    check_count(body, element);
    if (element.properties.empty())
        return;
    for (std::uint64_t i = 0; i < element.n; ++i) {
        body.begin_record();
        for (const Property& property : element.properties)
            if (!take(property))
                skip(body, property);
        body.end_record();
    }
}

void read_vertices(Body& body, const Element& element, TriMesh& mesh) {
    static constexpr std::array<std::string_view, 3> kAxes = {"x", "y", "z"};
    for (const std::string_view axis : kAxes) {
        int n = 0;
        for (const Property& property : element.properties)
            n += property.name == axis && !property.count_type;
        if (n != 1)
            body.fail("the vertices have " + std::to_string(n) + " properties '" +
                          std::string(axis) + "'",
                      "one is needed; mend the header");
    }
    check_count(body, element);
    mesh.positions.reserve(element.n);
    Vec3 p;
    std::size_t n_read = 0;
    read_records(body, element, [&](const Property& property) {
        if (property.name.size() != 1 || property.count_type)
            return false;
        const int axis = property.name[0] - 'x';
        if (axis < 0 || axis > 2)
            return false;
        p[axis] = body.value(property, property.type);
        if (!std::isfinite(p[axis]))
            body.fail("a coordinate of vertex " + std::to_string(mesh.positions.size()) +
                          " is not finite",
                      "mend the file or export it again");
        if (++n_read % 3 == 0)
            mesh.positions.push_back(p);
        return true;
    });
}

/// One index of a face or a strip; `lowest` is -1 where a strip may end.
std::int64_t read_index(Body& body, const Property& property, std::size_t n_vertices, int lowest) {
    const double index = body.value(property, property.type);
    if (index != std::floor(index) || index < lowest || index >= static_cast<double>(n_vertices))
        body.fail("a face names vertex " + Body::number_text(index) + " of " +
                      std::to_string(n_vertices) + ", counted from 0",
                  "mend the index");
    return static_cast<std::int64_t>(index);
}

void read_face(Body& body, const Property& property, std::vector<std::uint32_t>& corners,
               MeshFile& file) {
    const std::size_t n = body.list_length(property);
    if (n < 3)
        body.fail("a face of " + std::to_string(n) + " corners", "give three or more");
    corners.clear();
    for (std::size_t i = 0; i < n; ++i)
        corners.push_back(static_cast<std::uint32_t>(
            read_index(body, property, file.levels.front().positions.size(), 0)));
    if (!add_face(file, corners))
        body.fail(kTooManyCorners, kTriangulateFirst);
}

/// Every corner from the third on makes a triangle, turned every other time; -1 begins a new strip.
/// Triangles that repeat a corner only carry the strip on: they are no faces and are not counted.
void read_strip(Body& body, const Property& property, TriMesh& mesh) {
    const std::size_t n = body.list_length(property);
    std::size_t length = 0;
    Triangle last{};
    for (std::size_t i = 0; i < n; ++i) {
        const std::int64_t index = read_index(body, property, mesh.positions.size(), -1);
        if (index < 0) {
            length = 0;
            continue;
        }
        last = {last[1], last[2], static_cast<std::uint32_t>(index)};
        if (++length >= 3 && last[0] != last[1] && last[1] != last[2] && last[2] != last[0])
            mesh.triangles.push_back(length % 2 == 1 ? last : Triangle{last[1], last[0], last[2]});
    }
}

void read_faces(Body& body, const Element& element, MeshFile& file) {
    const bool strips = element.name == "tristrips";
    const auto holds_corners = [](const Property& property) {
        return property.name == "vertex_indices" || property.name == "vertex_index";
    };
    int n_lists = 0;
    for (const Property& property : element.properties)
        n_lists += holds_corners(property) && property.count_type && is_whole(property.type);
    if (n_lists != 1)
        body.fail("'" + element.name + "' has " + std::to_string(n_lists) +
                      " whole-number lists 'vertex_indices'",
                  "one is needed; mend the header");
    std::vector<std::uint32_t> corners;
    read_records(body, element, [&](const Property& property) {
        if (!holds_corners(property) || !property.count_type)
            return false;
        if (strips)
            read_strip(body, property, file.levels.front());
        else
            read_face(body, property, corners, file);
        return true;
    });
}

} // namespace

MeshFile parse_ply(std::string_view bytes, const std::string& where, Progress* progress) {
    TextCursor cursor(bytes, where, {}, progress);
    Header header = read_header(cursor);
    MeshFile file;
    file.recipe = std::move(header.recipe);
    TriMesh& mesh = file.levels.emplace_back();
    Body body(bytes, where, header.encoding, cursor, progress);
    // Faces may stand before the vertices that they name: they are passed over and read afterwards.
    std::vector<std::pair<Body, const Element*>> early;
    bool has_vertices = false;
    for (const Element& element : header.elements) {
        const bool faces = element.name == "face" || element.name == "tristrips";
        if (element.name == "vertex") {
            read_vertices(body, element, mesh);
            has_vertices = true;
        } else if (faces && has_vertices) {
            read_faces(body, element, file);
        } else {
            if (faces)
                early.emplace_back(body, &element);
            read_records(body, element, [](const Property&) { return false; });
        }
    }
    for (auto& [place, element] : early)
        read_faces(place, *element, file);
    body.begin_record();
    if (body.bytes_left() > 0)
        body.fail(std::to_string(body.bytes_left()) + " bytes follow the last element",
                  "the counts in the header do not match the body");
    return file;
}

std::string format_ply(const TriMesh& mesh, const std::string& recipe) {
    std::string out = "ply\nformat binary_little_endian 1.0\n" +
                      recipe_comments(recipe, "comment ") + "element vertex " +
                      std::to_string(mesh.positions.size()) +
                      "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                      std::to_string(mesh.triangles.size()) +
                      "\nproperty list uchar uint vertex_indices\nend_header\n";
    out.reserve(out.size() + 12 * mesh.positions.size() + 13 * mesh.triangles.size());
    for (const Vec3& p : mesh.positions)
        for (int axis = 0; axis < 3; ++axis)
            append_number(out, static_cast<float>(p[axis]));
    for (const Triangle& t : mesh.triangles) {
        out += '\3';
        for (const std::uint32_t corner : t)
            append_number(out, corner);
    }
    return out;
}

} // namespace taihu
