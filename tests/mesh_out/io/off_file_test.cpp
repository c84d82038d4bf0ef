#include "tests/mesh_out/io/mesh_bytes.h"

namespace taihu {
namespace {

MeshFile parse(std::string_view text) {
    return parse_mesh(text, MeshFormat::off, "rock");
}

const std::string kVertices = "0 0 0\n1 0 0\n0 1 0\n";

TEST(OffFile, TakesCommentsColoursAndValuesSpreadOverLines) {
    const std::vector<std::string> same = {
        "OFF\n3 1 3\n" + kVertices + "3 0 1 2\n",
        "OFF 3 1 3\n" + kVertices + "3 0 1 2 255 0 0\n",
        "# first\nOFF # name\n\n3 # vertices\n1\n3\n0\n0 0\n1\n0\n0\n0 1 0\n# faces\n3\n0\n1\n2",
        "OFF\r\n3 1 0\r\n0 0 0\r\n1 0 0\r\n0 1 0\r\n3 0 1 2 0.5 0.5 0.5 1\r\n",
        "COFF\n3 1 0\n0 0 0 255 0 0 255\n1 0 0 255 0 0 255\n0 1 0 1.0 0 0\n3 0 1 2\n",
        "NOFF\n3 1 0\n0 0 0 0 0 1\n1 0 0\n0 0 1\n0 1 0 0 0 1\n3 0 1 2\n",
        "CNOFF\n3 1 0\n0 0 0 0 0 1 1 1 1 1\n1 0 0 0 0 1 1 1 1 1\n0 1 0 0 0 1 1 1 1 1\n3 0 1 2\n"};
    for (const std::string& text : same) {
        const MeshFile file = parse(text);
        EXPECT_EQ(file.levels[0].positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}))
            << text;
        EXPECT_EQ(file.levels[0].triangles, (std::vector<Triangle>{{0, 1, 2}})) << text;
    }
}

TEST(OffFile, CutsPolygons) {
    const MeshFile file = parse("OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n");
    EXPECT_EQ(file.n_polygons, 1u);
    EXPECT_EQ(file.levels[0].triangles.size(), 2u);
}

TEST(OffFile, NamesTheLineOfWhatIsWrong) {
    const auto refused = [](const std::string& text, const std::string& line,
                            const std::string& part) {
        expect_refused(text, MeshFormat::off, Fault::bad_input, {"rock:" + line + ": ", part});
    };
    refused("8 6 12\n", "1", "an OFF file begins with OFF");
    refused("4OFF\n", "1", "COFF, NOFF and CNOFF are read");
    refused("OFF\n", "2", "the number of vertices is missing");
    refused("OFF\n-1 1 0\n", "2", "the number of vertices is -1");
    refused("OFF\n4000000000 1 0\n" + kVertices, "2", "4000000000, but");
    refused("OFF\n3 4000000000 0\n" + kVertices, "2", "the number of faces is 4000000000");
    refused("OFF\n3 1 0\n0 0 0\n1 0 0\n0 inf 0\n3 0 1 2\n", "5", "y is 'inf'");
    refused("OFF\n3 1 0\n" + kVertices + "3 0 1 3\n", "6", "names vertex 3 of 3");
    refused("OFF\n3 1 0\n" + kVertices + "3 0 1 1.0\n", "6", "'1.0', not a whole number");
    refused("OFF\n3 1 0\n" + kVertices + "2 0 1    \n", "6", "a face of 2 corners");
    refused("OFF\n3 1 0\n" + kVertices + "1000000 0 1\n", "6", "the number of corners is 1000000");
    refused("OFF\n3 1 0\n" + kVertices + "3 0 1 2 0 0 0 0 0\n", "6", "too much on this line");
    refused("OFF\n3 1 0\n" + kVertices + "3 0 1 2\n3 2 1 0\n", "7", "'3' after the last face");
    refused("OFF\n3 2 0\n" + kVertices + "3 0 1 2 3\n2 1 0\n", "7", "a face of 2 corners");
    refused("OFF\n3 0 0\n" + kVertices, "1", "no face");
    refused("COFF\n3 1 0\n" + kVertices + "3 0 1 2\n", "3", "a vertex without its colour");
}

TEST(OffFile, RoundTripsWithItsRecipe) {
    const MeshFile back = parse(format_mesh(tetrahedron(), MeshFormat::off, "{\"seed\":1}"));
    EXPECT_EQ(back.levels[0].positions, tetrahedron().positions);
    EXPECT_EQ(back.levels[0].triangles, tetrahedron().triangles);
    EXPECT_EQ(back.recipe, "{\"seed\":1}");
}

TEST(OffFile, RefusesEveryShorterFile) {
    expect_prefixes_refused(format_mesh(tetrahedron(), MeshFormat::off), MeshFormat::off);
}

TEST(OffFile, SurvivesChangedBytes) {
    expect_mutations_safe(format_mesh(tetrahedron(), MeshFormat::off), MeshFormat::off, 3000);
}

} // namespace
} // namespace taihu
