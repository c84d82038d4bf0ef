#include "mesh_out/corner_table_detail.h"

#include <gtest/gtest.h>

#include "mesh_out/certificate.h"
#include "tests/support/cube_mesh.h"
#include "tests/support/errors.h"

namespace taihu {
namespace {

constexpr const char* kNotClosed = "here: the mesh of";

std::vector<Triangle> left(const CornerTable& table) {
    std::vector<Triangle> out;
    for (std::size_t t = 0; t < table.n_triangles(); ++t)
        if (table.has_triangle(t))
            out.push_back(table.triangle(t));
    return out;
}

/// What the links say agrees with what the vertices say.
void expect_consistent(const CornerTable& table) {
    for (std::uint32_t c = 0; c < 3 * table.n_triangles(); ++c) {
        if (!table.has_triangle(c / 3))
            continue;
        const std::uint32_t d = table.opposite(c);
        ASSERT_EQ(table.opposite(d), c);
        EXPECT_EQ(table.vertex(CornerTable::next(c)), table.vertex(CornerTable::previous(d)));
        EXPECT_EQ(table.vertex(CornerTable::previous(c)), table.vertex(CornerTable::next(d)));
    }
    for (std::uint32_t v = 0; v < table.n_vertices(); ++v)
        if (table.has_vertex(v)) {
            EXPECT_EQ(table.vertex(table.corner(v)), v);
        }
}

TEST(CornerTable, LinksEveryCornerOfACube) {
    const TriMesh mesh = cube();
    expect_consistent(CornerTable(mesh.positions.size(), mesh.triangles, "here"));
}

TEST(CornerTable, RingsNameTheOtherVerticesOfTheirTriangles) {
    const TriMesh mesh = cube();
    const CornerTable table(mesh.positions.size(), mesh.triangles, "here");
    for (std::uint32_t v = 0; v < table.n_vertices(); ++v) {
        CornerTable::Ring ring;
        ASSERT_TRUE(table.ring(v, ring));
        std::size_t k = 0;
        EXPECT_TRUE(ring.each([&](std::uint32_t p, std::uint32_t q) {
            const std::uint32_t c = ring.corners[k++];
            EXPECT_EQ(p, table.vertex(CornerTable::next(c)));
            EXPECT_EQ(q, table.vertex(CornerTable::previous(c)));
            return true;
        }));
        EXPECT_EQ(k, ring.n);
    }
}

TEST(CornerTable, RefusesWhatIsNotAClosedManifold) {
    TriMesh open = cube();
    open.triangles.pop_back();
    TriMesh turned = cube();
    std::swap(turned.triangles[3][0], turned.triangles[3][1]);
    TriMesh touching = cube(); // two cubes that share one vertex by index
    append(touching, cube({2, 0, 0}));
    for (Triangle& t : touching.triangles)
        for (std::uint32_t& v : t)
            v = v == 8 ? 0 : v;
    TriMesh out_of_range = cube();
    out_of_range.triangles[0][0] = 99;
    for (const TriMesh& mesh : {open, turned, touching, out_of_range, TriMesh{}})
        expect_error(Fault::bad_argument, kNotClosed,
                     [&] { CornerTable(mesh.positions.size(), mesh.triangles, "here"); });
}

TEST(CornerTable, SplitsKeepTheSurfaceClosed) {
    TriMesh mesh = cube();
    CornerTable table(mesh.positions.size(), mesh.triangles, "here");
    for (std::uint32_t c = 0; c < 60; c += 7) {
        const std::uint32_t a = table.vertex(CornerTable::next(c)),
                            b = table.vertex(CornerTable::previous(c));
        mesh.positions.push_back((mesh.positions[a] + mesh.positions[b]) * .5);
        table.split(c);
    }
    expect_consistent(table);
    mesh.triangles = left(table);
    EXPECT_EQ(mesh.triangles.size(), 12u + 2 * 9);
    const Certificate certificate = certify(mesh);
    EXPECT_TRUE(certificate.closed() && certificate.manifold() && certificate.outward());
    EXPECT_NEAR(certificate.volume_m3, 1, 1e-12); // middles of edges: the same cube
}

TEST(CornerTable, CollapsesDownToATetrahedronAndNoFurther) {
    const TriMesh mesh = shape_mesh({.kind = ShapeKind::sphere, .size_m = {2, 2, 2}});
    CornerTable table(mesh.positions.size(), mesh.triangles, "here");
    std::size_t n = mesh.triangles.size();
    for (bool any = true; any;) {
        any = false;
        for (std::uint32_t c = 0; c < 3 * table.n_triangles(); ++c) {
            if (!table.has_triangle(c / 3))
                continue;
            const std::uint32_t a = table.vertex(c), b = table.vertex(CornerTable::next(c));
            CornerTable::Ring ring_a, ring_b;
            if (!table.ring(a, ring_a) || !table.ring(b, ring_b))
                continue;
            const std::uint32_t at = table.collapsible(a, b, ring_a, ring_b);
            if (at == CornerTable::kNone)
                continue;
            table.collapse(at, ring_a);
            n -= 2;
            any = true;
        }
    }
    expect_consistent(table);
    EXPECT_EQ(left(table).size(), n);
    EXPECT_EQ(n, 4u);
}

} // namespace
} // namespace taihu
