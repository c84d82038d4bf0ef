#include "tests/mesh_out/io/mesh_bytes.h"

#include <cstring>

namespace taihu {
namespace {

MeshFile parse(std::string_view bytes) {
    return parse_mesh(bytes, MeshFormat::stl, "rock");
}

const std::string kFacet = "facet normal -nan 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n"
                           "  vertex 0 1 -0.0\n endloop\nendfacet\n";
const std::string kSecond = "FACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX 1 0 0\nVERTEX 1 1 0\n"
                            "VERTEX 0 1 0\nENDLOOP\nENDFACET\n";

TEST(StlFile, WeldsEqualPositionsOfAnAsciiFile) {
    for (const std::string& text :
         {"solid a rock by facet\n" + kFacet + kSecond + "endsolid a rock\n",
          "solid\r\n" + kFacet + "endsolid\n\nsolid b\n" + kSecond + "endsolid b"}) {
        const MeshFile file = parse(text);
        EXPECT_EQ(file.levels[0].positions,
                  (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}));
        EXPECT_EQ(file.levels[0].triangles, (std::vector<Triangle>{{0, 1, 2}, {1, 3, 2}}));
    }
}

TEST(StlFile, RoundTripsAsAnIndexedMesh) {
    const std::string bytes = format_mesh(tetrahedron(), MeshFormat::stl);
    EXPECT_EQ(bytes.size(), 84u + 50 * 4);
    const MeshFile back = parse(bytes);
    EXPECT_EQ(back.levels[0].positions.size(), 4u);
    EXPECT_EQ(back.levels[0].triangles.size(), 4u);
    EXPECT_EQ(signed_volume_m3(back.levels[0]), signed_volume_m3(tetrahedron()));
}

TEST(StlFile, WeldsAsManyPositionsAsTheMeshHad) { // the table grows several times
    TriMesh mesh;
    const std::uint32_t n = 60;
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t j = 0; j < n; ++j) {
            mesh.positions.push_back({i * 0.125, j * 0.125, 0});
            const std::uint32_t a = i * n + j;
            if (i + 1 < n && j + 1 < n) {
                mesh.triangles.push_back({a, a + n, a + 1});
                mesh.triangles.push_back({a + 1, a + n, a + n + 1});
            }
        }
    const MeshFile back = parse(format_mesh(mesh, MeshFormat::stl));
    EXPECT_EQ(back.levels[0].positions.size(), mesh.positions.size());
    ASSERT_EQ(back.levels[0].triangles.size(), mesh.triangles.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k)
            EXPECT_EQ(back.levels[0].positions[back.levels[0].triangles[i][k]],
                      mesh.positions[mesh.triangles[i][k]]);
}

TEST(StlFile, IsBinaryBySizeEvenWhenItSaysSolid) {
    std::string bytes = format_mesh(tetrahedron(), MeshFormat::stl);
    std::memcpy(bytes.data(), "solid rock", 10);
    EXPECT_EQ(parse(bytes).levels[0].triangles.size(), 4u);
}

TEST(StlFile, CountsFacetsWithoutInside) {
    const MeshFile file = parse("solid\n" + kFacet +
                                "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 0\n"
                                "vertex 0 1 0\nendloop\nendfacet\nendsolid\n");
    EXPECT_EQ(file.n_degenerate_faces, 1u);
    EXPECT_EQ(file.levels[0].triangles.size(), 1u);
}

TEST(StlFile, NamesThePlaceOfWhatIsWrong) {
    const auto refused = [](const std::string& bytes, const std::string& place,
                            const std::string& part) {
        expect_refused(bytes, MeshFormat::stl, Fault::bad_input, {"rock:" + place + ": ", part});
    };
    refused("so", "byte 2", "within the header of a binary STL");
    refused("solid\nendsolid\n", "1", "no face");
    refused("solid\n" + kFacet, "9", "'' where 'endsolid' belongs");
    refused("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 zero\n", "4", "z is 'zero'");
    refused("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nendloop\n", "5",
            "'endloop' where 'vertex' belongs");
    std::string bytes = format_mesh(tetrahedron(), MeshFormat::stl);
    refused(bytes + "x", "byte 80", "4 triangles make 284 bytes, the file has 285");
    bytes[83] = '\x7f';
    refused(bytes, "byte 80", "make 106");
    bytes = format_mesh(tetrahedron(), MeshFormat::stl);
    std::memcpy(bytes.data() + 84 + 12, "\0\0\xc0\x7f", 4);
    refused(bytes, "byte 96", "a position is not finite");
}

TEST(StlFile, RefusesEveryShorterFile) {
    expect_prefixes_refused(format_mesh(tetrahedron(), MeshFormat::stl), MeshFormat::stl);
    expect_prefixes_refused("solid rock\n" + kFacet + kSecond + "endsolid rock\n", MeshFormat::stl);
}

TEST(StlFile, SurvivesChangedBytes) {
    expect_mutations_safe(format_mesh(tetrahedron(), MeshFormat::stl), MeshFormat::stl, 3000);
    expect_mutations_safe("solid rock\n" + kFacet + kSecond + "endsolid rock\n", MeshFormat::stl,
                          3000);
}

} // namespace
} // namespace taihu
