#include <cmath>

#include "mesh_out/io/glb.h"
#include "tests/mesh_out/io/grid_ball.h"
#include "tests/mesh_out/io/mesh_bytes.h"

namespace taihu {
namespace {

const TriMesh kBall = grid_ball(10, 1, 0x1p-10);

MeshFile parse(std::string_view bytes) {
    return parse_mesh(bytes, MeshFormat::drc, "rock");
}

TEST(Drc, RoundTripsWithNormalsAndRecipe) {
    const MeshFile file = parse(format_mesh(kBall, MeshFormat::drc, "{\"seed\": 7}"));
    EXPECT_TRUE(file.draco);
    EXPECT_EQ(file.recipe, "{\"seed\": 7}");
    const TriMesh& mesh = file.levels.at(0);
    EXPECT_EQ(mesh.triangles.size(), kBall.triangles.size());
    EXPECT_EQ(mesh.normals.size(), mesh.positions.size());
    EXPECT_EQ(bounds(mesh), bounds(kBall)); // on a grid: to the bit
    EXPECT_NEAR(signed_volume_m3(mesh), signed_volume_m3(kBall), 1e-12);
}

TEST(Drc, PositionsOffAnyGridMoveBy18Bits) {
    TriMesh mesh = kBall;
    for (Vec3& p : mesh.positions)
        p *= 1 / 3.0;
    const TriMesh read = parse(format_mesh(mesh, MeshFormat::drc)).levels.at(0);
    const double step = 0x1p-17; // of a box 2/3 long
    EXPECT_LE(length(bounds(read).lo - bounds(mesh).lo), step);
    EXPECT_NEAR(signed_volume_m3(read), signed_volume_m3(mesh), 4 * M_PI / 9 * step);
}

TEST(Drc, ReadsUnitsAndAxes) {
    const MeshFile file = parse_mesh(format_mesh(kBall, MeshFormat::drc), MeshFormat::drc, "rock",
                                     {.unit_m = 0.5, .up = UpAxis::z});
    EXPECT_EQ(bounds(file.levels.at(0)).size().y, bounds(kBall).size().z / 2);
}

TEST(Drc, IsKnownByItsContent) {
    const std::string bytes = format_mesh(kBall, MeshFormat::drc);
    expect_refused(bytes, MeshFormat::obj, Fault::bad_input, {"the content is DRC", "rename it"});
    expect_refused("ply\n", MeshFormat::drc, Fault::bad_input, {"the content is PLY"});
    expect_refused("DRAC", MeshFormat::drc, Fault::bad_input, {"not a Draco stream"});
    expect_refused(bytes.substr(0, bytes.size() / 2), MeshFormat::drc, Fault::bad_input,
                   {"rock:byte 0: "});
}

} // namespace
} // namespace taihu
