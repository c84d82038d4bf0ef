#include "mesh_out/measure.h"

#include "tests/support/errors.h"
#include "vdb_ops/shapes.h"

namespace taihu {
namespace {

TEST(Hull, OfAConvexBodyIsTheBody) {
    const TriMesh box = shape_mesh({.kind = ShapeKind::box, .size_m = {1, 2, 3}});
    EXPECT_NEAR(hull_volume_m3(box), 6, 1e-12);
    const TriMesh ball = shape_mesh({.kind = ShapeKind::icosphere, .subdivisions = 3});
    EXPECT_NEAR(hull_volume_m3(ball), signed_volume_m3(ball), 1e-12);
}

TEST(Hull, OfATorusClosesItsHole) {
    const TriMesh ring = shape_mesh(
        {.kind = ShapeKind::torus, .size_m = {1, 0.2, 1}, .tube_m = 0.2, .subdivisions = 6});
    // A disc of radius 0.4 and height 0.2 with a rounded rim: pi r^2 h + pi^2 r (h/2)^2 + 4/3 pi
    // (h/2)^3; 128 x 64 sides lose about 1e-3 of it.
    const double pi = 3.14159265358979;
    const double exact = pi * 0.16 * 0.2 + pi * pi * 0.4 * 0.01 + 4.0 / 3 * pi * 1e-3;
    EXPECT_NEAR(hull_volume_m3(ring), exact, 2e-3 * exact);
}

TEST(Hull, OfAPlaneIsNothing) {
    EXPECT_EQ(hull_volume_m3({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, {}}), 0);
    expect_error(Fault::bad_argument, "no triangle", [] { hull_volume_m3({}); });
}

} // namespace
} // namespace taihu
