#include "tests/mesh_out/io/mesh_bytes.h"

#include <bit>
#include <cstring>

namespace taihu {
namespace {

MeshFile parse(std::string_view bytes) {
    return parse_mesh(bytes, MeshFormat::ply, "rock");
}

std::string header(const std::string& format, const std::string& rest) {
    return "ply\nformat " + format + " 1.0\n" + rest + "end_header\n";
}
const std::string kXyz = "property float x\nproperty float y\nproperty float z\n";
const std::string kLists = "property list uchar int vertex_indices\n";
const std::string kSmall =
    header("ascii", "element vertex 3\n" + kXyz + "element face 1\n" + kLists) +
    "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
const std::vector<Vec3> kCorners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};

/// Bytes of numbers in either order.
class Bytes {
public:
    explicit Bytes(bool big) : big_(big) {}
    template <class T>
    Bytes& put(T value) {
        char raw[sizeof(T)];
        std::memcpy(raw, &value, sizeof(T));
        if (big_ == (std::endian::native == std::endian::little))
            std::reverse(raw, raw + sizeof(T));
        text.append(raw, sizeof(T));
        return *this;
    }
    std::string text;

private:
    bool big_;
};

TEST(PlyFile, ReadsAsciiWithLineEndsOfEitherKind) {
    std::string crlf;
    for (const char c : kSmall)
        crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
    for (const std::string& text :
         {kSmall, crlf, "\n" + kSmall, kSmall.substr(0, kSmall.size() - 1)}) {
        EXPECT_EQ(parse(text).levels[0].positions, kCorners);
        EXPECT_EQ(parse(text).levels[0].triangles, (std::vector<Triangle>{{0, 1, 2}}));
    }
}

TEST(PlyFile, ReadsBinaryOfBothOrdersWithEveryTypeAndExtraData) {
    const std::string rest = "comment made by hand\nobj_info none\nelement vertex 4\n"
                             "property uchar red\nproperty double z\nproperty list short float w\n"
                             "property int16 y\nproperty uint32 id\nproperty int8 x\n"
                             "element edge 1\nproperty int a\nproperty int b\nelement nothing 9\n"
                             "element face 2\nproperty list uchar float extra\n"
                             "property list uint ushort vertex_index\nproperty char flag\n";
    for (const bool big : {false, true}) {
        Bytes body(big);
        for (int i = 0; i < 4; ++i) {
            body.put<std::uint8_t>(200).put<double>(0.25 * i).put<std::int16_t>(2);
            body.put<float>(1).put<float>(2).put<std::int16_t>(static_cast<std::int16_t>(-i));
            body.put<std::uint32_t>(4000000000).put<std::int8_t>(static_cast<std::int8_t>(-3 * i));
        }
        body.put<std::int32_t>(-1).put<std::int32_t>(7);
        body.put<std::uint8_t>(1).put<float>(3).put<std::uint32_t>(3);
        for (const std::uint16_t corner : {0, 1, 2})
            body.put(corner);
        body.put<std::int8_t>(0).put<std::uint8_t>(0).put<std::uint32_t>(4);
        for (const std::uint16_t corner : {0, 1, 3, 2})
            body.put(corner);
        body.put<std::int8_t>(0);
        const MeshFile file =
            parse(header(big ? "binary_big_endian" : "binary_little_endian", rest) + body.text);
        ASSERT_EQ(file.levels[0].positions.size(), 4u);
        EXPECT_EQ(file.levels[0].positions[3], (Vec3{-9, -3, 0.75}));
        EXPECT_EQ(file.levels[0].triangles.size(), 3u);
        EXPECT_EQ(file.n_polygons, 1u);
    }
}

TEST(PlyFile, ReadsFacesThatStandBeforeTheirVertices) {
    const MeshFile file =
        parse(header("ascii", "element face 1\n" + kLists + "element vertex 3\n" + kXyz) +
              "3 0 1 2\n0 0 0\n1 0 0\n0 1 0\n");
    EXPECT_EQ(file.levels[0].positions, kCorners);
    EXPECT_EQ(file.levels[0].triangles.size(), 1u);
}

TEST(PlyFile, UnrollsTriangleStrips) {
    const MeshFile file =
        parse(header("ascii", "element vertex 5\n" + kXyz +
                                  "element tristrips 1\nproperty list int int vertex_indices\n") +
              "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 2 0\n9 0 1 2 3 -1 1 4 4 3\n");
    EXPECT_EQ(file.levels[0].triangles, (std::vector<Triangle>{{0, 1, 2}, {2, 1, 3}}));
    EXPECT_EQ(file.n_degenerate_faces, 0u);
}

TEST(PlyFile, NamesTheLineOfWhatIsWrong) {
    const auto refused = [](const std::string& bytes, const std::string& place,
                            const std::string& part) {
        expect_refused(bytes, MeshFormat::ply, Fault::bad_input, {"rock:" + place + ": ", part});
    };
    const auto swapped = [](std::string from, const std::string& to) {
        std::string text = kSmall;
        return text.replace(text.find(from), from.size(), to);
    };
    refused("plx\n", "1", "a PLY file begins with ply");
    refused("ply\n", "2", "no end_header");
    refused(swapped("format ascii 1.0\n", ""), "8", "states no format");
    refused(swapped("ascii", "asci"), "2", "'asci'");
    refused(swapped("1.0", "2.0"), "2", "the PLY version is '2.0'");
    refused(swapped("element vertex", "elxment vertex"), "3", "unknown keyword 'elxment'");
    refused(swapped("element vertex 3\n", ""), "3", "a property before any element");
    refused(swapped("float x", "half x"), "4", "a type is 'half'");
    refused(swapped("float x", "float"), "4", "the name of a property is missing");
    refused(swapped("float x", "float q"), "10", "0 properties 'x'");
    refused(swapped("list uchar int", "list float int"), "8", "length of a list");
    refused(swapped("list uchar int", "list uchar float"), "12", "0 whole-number lists");
    refused(swapped("face 1", "vertex 1"), "7", "a second element 'vertex'");
    refused(swapped("vertex 3", "vertex -3"), "3", "has -3 items");
    refused(swapped("vertex 3", "vertex 4000000000"), "10", "4000000000 items of 'vertex'");
    refused(swapped("face 1", "face 4000000000"), "12", "4000000000 items of 'face'");
    refused(swapped("face 1", "face 0"), "13", "follow the last element");
    refused(swapped("1 0 0\n", "1 0\n"), "11", "z is missing");
    refused(swapped("1 0 0\n", "1 0 0 0\n"), "11", "'0' is too much on this line");
    refused(swapped("1 0 0\n", "1 nan 0\n"), "11", "y is 'nan'");
    refused(swapped("3 0 1 2", "3 0 1 3"), "13", "names vertex 3 of 3");
    refused(swapped("3 0 1 2", "3 0 1 -1"), "13", "names vertex -1 of 3");
    refused(swapped("3 0 1 2", "2 0 1 2"), "13", "a face of 2 corners");
    refused(swapped("3 0 1 2", "255 0 1 2"), "13", "of 255 items");
    refused(kSmall + "x", "14", "1 bytes follow");
    refused(header("ascii", "element vertex 3\n" + kXyz) + "0 0 0\n1 0 0\n0 1 0\n", "1", "no face");
}

TEST(PlyFile, NamesTheByteOfWhatIsWrong) {
    std::string bytes = format_mesh(tetrahedron(), MeshFormat::ply);
    const std::size_t body = bytes.find("end_header\n") + 11;
    const auto refused = [](const std::string& changed, std::size_t place,
                            const std::string& part) {
        expect_refused(changed, MeshFormat::ply, Fault::bad_input,
                       {"rock:byte " + std::to_string(place) + ": ", part});
    };
    refused(bytes.substr(0, bytes.size() - 1), body + 48 + 40,
            "a list 'vertex_indices' of 3 items, but 11 bytes follow");
    refused(bytes + '\n', bytes.size(), "1 bytes follow");
    std::string changed = bytes;
    changed[body + 48 + 1] = 4;
    refused(changed, body + 48 + 5, "names vertex 4 of 4");
    changed = bytes;
    changed.replace(body, 4, std::string("\0\0\x80\x7f", 4));
    refused(changed, body + 4, "vertex 0 is not finite");
}

TEST(PlyFile, RoundTripsWithItsRecipe) {
    const MeshFile back = parse(format_mesh(tetrahedron(), MeshFormat::ply, "{\n \"seed\": 1\n}"));
    EXPECT_EQ(back.levels[0].positions, tetrahedron().positions);
    EXPECT_EQ(back.levels[0].triangles, tetrahedron().triangles);
    EXPECT_EQ(back.recipe, "{\n \"seed\": 1\n}");
}

TEST(PlyFile, RefusesEveryShorterFile) {
    expect_prefixes_refused(kSmall, MeshFormat::ply);
    expect_prefixes_refused(format_mesh(tetrahedron(), MeshFormat::ply), MeshFormat::ply);
}

TEST(PlyFile, SurvivesChangedBytes) {
    expect_mutations_safe(kSmall, MeshFormat::ply, 3000);
    expect_mutations_safe(format_mesh(tetrahedron(), MeshFormat::ply), MeshFormat::ply, 3000);
}

} // namespace
} // namespace taihu
