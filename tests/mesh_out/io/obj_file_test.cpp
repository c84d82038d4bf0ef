#include "tests/mesh_out/io/mesh_bytes.h"

#include "stats/core/file.h"
#include "tests/support/scratch.h"

namespace taihu {
namespace {

MeshFile parse(std::string_view text, const MeshReadSettings& settings = {}) {
    return parse_mesh(text, MeshFormat::obj, "rock", settings);
}

const std::string kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

TEST(ObjFile, ReadsAllFormsOfCornersAndSkipsTheRest) {
    const MeshFile file = parse("\xEF\xBB\xBF# a comment\nmtllib ../../etc/passwd\no rock\ng a b\n"
                                "v 0 0 0 1\nv +1 0 0 0.5 0.5 0.5\r\nv\t0 1e0 0\n"
                                "\nv 0 0 1 # behind\nvt 0 0\nvn 0 0 1\nusemtl none\ns off\n"
                                "f 1 2 3\nf 1/1 2/1 4/1\nf 1//1 -2//1 -1//1\nf -3/1/1 \\\n 3/1/1 "
                                "\\\r\n4/1/1");
    EXPECT_EQ(file.format, MeshFormat::obj);
    ASSERT_EQ(file.levels.size(), 1u);
    EXPECT_EQ(file.levels[0].positions,
              (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}));
    EXPECT_EQ(file.levels[0].triangles,
              (std::vector<Triangle>{{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {1, 2, 3}}));
}

TEST(ObjFile, TurnsAndScalesIntoMetresWithYUp) {
    const MeshFile file =
        parse("v 1 2 3\nv 4 0 0\nv 0 4 0\nf 1 2 3\n", {.unit_m = 0.01, .up = UpAxis::z});
    EXPECT_EQ(file.levels[0].positions[0], (Vec3{0.01, 0.03, -0.02}));
    EXPECT_THROW(parse(kTriangle, {.unit_m = 0}), Error);
}

TEST(ObjFile, CountsPolygonsAndFacesWithoutInside) {
    const MeshFile file = parse("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
                                "f 1 2 3 4\nf 1 1 2\nf 1 2 2 1\nf 1 2 1 3\nf 1 2 2 3\nf 1 2 3 1\n");
    EXPECT_EQ(file.n_polygons, 5u);
    EXPECT_EQ(file.n_degenerate_faces, 3u);
    EXPECT_EQ(file.levels[0].triangles,
              (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {0, 1, 2}, {0, 1, 2}}));
}

TEST(ObjFile, NamesTheLineOfWhatIsWrong) {
    const auto refused = [](const std::string& text, const std::string& line,
                            const std::string& part) {
        expect_refused(text, MeshFormat::obj, Fault::bad_input, {"rock:" + line + ": ", part});
    };
    refused("", "1", "empty");
    refused("# nothing\n", "1", "no face");
    refused("v 0 0 0\nv 1 0 0\nv 0 1 0\n", "1", "no face");
    refused("v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3\n", "2", "z is missing");
    refused("v 0 0 0\nv 1 0,5 0\n", "2", "y is '0,5', not a finite number");
    refused("v 0 0 nan\n", "1", "'nan'");
    refused("v 0 0 1e999\n", "1", "'1e999'");
    refused("v 0 0 0 1 2\n", "1", "a vertex of 5 numbers");
    refused("v 0 0 0 red\n", "1", "'red'");
    refused(kTriangle + "f 1 2 4\n", "5", "names vertex 4, but 3 vertices");
    refused(kTriangle + "f 1 2 -4\n", "5", "names vertex -4");
    refused(kTriangle + "f 0 1 2\n", "5", "names vertex 0");
    refused("f 1 2 3\n" + kTriangle, "1", "put the vertices first");
    refused(kTriangle + "f 1 2\n", "5", "a face of 2 corners");
    refused(kTriangle + "f 1 2 x\n", "5", "a corner is 'x'");
    refused(kTriangle + "f 1 2 3/1/1/1\n", "5", "'3/1/1/1'");
    refused(kTriangle + "f 1 2 99999999999999999999\n", "5", "'99999999999999999999'");
    refused(kTriangle + "f 1 2 \\\n\\\n9\n", "7", "vertex 9");
    refused(kTriangle + "usemlt stone\n", "5", "did you mean 'usemtl'?");
    refused(kTriangle + "surf 0 1 0 1\n", "5", "export polygons");
    refused("\xFF\xFEv", "1", "UTF-8");
    refused("v 1e200 0 0\nv 1e308 1 1\nv 1 0 0\nf 1 2 x\x01\n", "4", "\\x01");
}

TEST(ObjFile, RefusesAContentOfAnotherFormat) {
    expect_refused("ply\nformat ascii 1.0\n", MeshFormat::obj, Fault::bad_input,
                   {"the content is PLY, the name says OBJ"});
}

TEST(ObjFile, WritesFloatsBitForBitAndKeepsTheRecipe) {
    TriMesh mesh = tetrahedron();
    mesh.positions[0] = {0.1f, -1.2345678e-20f, 3.4e11f};
    const std::string recipe = "{\n  \"seed\": 1,\n\n  \"dim\": 64\n}";
    const MeshFile back = parse(format_mesh(mesh, MeshFormat::obj, recipe));
    for (std::size_t i = 0; i < 4; ++i)
        for (int axis = 0; axis < 3; ++axis)
            EXPECT_EQ(static_cast<float>(back.levels[0].positions[i][axis]),
                      static_cast<float>(mesh.positions[i][axis]));
    EXPECT_EQ(back.levels[0].triangles, mesh.triangles);
    EXPECT_EQ(back.recipe, recipe);
}

TEST(ObjFile, ReadsAFileByItsExtension) {
    const Scratch scratch;
    write_file(scratch / "rock.OBJ", kTriangle);
    EXPECT_EQ(read_mesh(scratch / "rock.OBJ").levels[0].triangles.size(), 1u);
    try {
        read_mesh(scratch / "rock.fbx");
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::unsupported);
        EXPECT_THAT(e.what(), testing::HasSubstr("rock.fbx: not a mesh format"));
    }
}

TEST(ObjFile, AShorterFileHoldsTheFirstFacesOrIsRefused) { // OBJ states no counts
    const std::string bytes = format_mesh(tetrahedron(), MeshFormat::obj);
    const auto whole = parse(bytes).levels[0].triangles;
    for (std::size_t n = 0; n < bytes.size(); ++n)
        if (const auto file = try_parse(std::string_view(bytes).substr(0, n), MeshFormat::obj)) {
            const auto& faces = file->levels[0].triangles;
            ASSERT_LE(faces.size(), whole.size());
            EXPECT_TRUE(std::equal(faces.begin(), faces.end(), whole.begin())) << n;
        }
}

TEST(ObjFile, SurvivesChangedBytes) {
    expect_mutations_safe(format_mesh(tetrahedron(), MeshFormat::obj, "{\"seed\":1}"),
                          MeshFormat::obj, 3000);
}

TEST(ObjFile, StopsWhenToldTo) {
    struct Stop : Progress {
        void stage(std::string_view) override {}
        void fraction(double) override {}
        bool cancelled() const override { return true; }
    } stop;
    try {
        parse_mesh(kTriangle, MeshFormat::obj, "rock", {}, &stop);
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::cancelled);
    }
}

TEST(FormatMesh, RefusesWhatAFileCannotHold) {
    const auto refused = [](const TriMesh& mesh, const char* part) {
        for (const auto format :
             {MeshFormat::obj, MeshFormat::ply, MeshFormat::stl, MeshFormat::off, MeshFormat::glb})
            try {
                format_mesh(mesh, format);
                ADD_FAILURE() << "no exception";
            } catch (const Error& e) {
                EXPECT_EQ(e.fault(), Fault::bad_argument);
                EXPECT_THAT(e.what(), testing::HasSubstr(part));
            }
    };
    refused({}, "no triangle");
    TriMesh mesh = tetrahedron();
    mesh.positions[2].y = 1e39;
    refused(mesh, "positions[2]");
    mesh = tetrahedron();
    mesh.triangles[1][2] = 4;
    refused(mesh, "triangles[1] names vertex 4 of 4");
    mesh = tetrahedron();
    mesh.normals = {{0, 0, 1}};
    refused(mesh, "1 normals for 4 positions");
}

} // namespace
} // namespace taihu
