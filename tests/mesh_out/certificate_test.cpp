#include "mesh_out/certificate.h"

#include <limits>
#include <map>
#include <numbers>
#include <optional>

#if defined(__GNUC__) && !defined(__clang__)
// GCC sees uninitialised limbs in Boost's moves when a sanitizer is on; there are none.
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#include <boost/multiprecision/cpp_int.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "mesh_out/crossings_detail.h"
#include "stats/core/error.h"
#include "stats/core/rng.h"

namespace taihu {
namespace {

using boost::multiprecision::cpp_rational;
using testing::ElementsAre;
using testing::HasSubstr;

TriMesh tetrahedron(const Vec3& at = {}, double size = 1) {
    TriMesh mesh;
    for (const Vec3& p : {Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}})
        mesh.positions.push_back(at + p * size);
    mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    return mesh;
}

TriMesh turned_inside_out(TriMesh mesh) {
    for (Triangle& t : mesh.triangles)
        std::swap(t[1], t[2]);
    return mesh;
}

TriMesh joined(TriMesh a, const TriMesh& b) {
    const auto offset = static_cast<std::uint32_t>(a.positions.size());
    a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
    for (const Triangle& t : b.triangles)
        a.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
    return a;
}

/// A torus of n x m quads with the hole along z, split into triangles.
TriMesh torus(std::uint32_t n, std::uint32_t m) {
    TriMesh mesh;
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t k = 0; k < m; ++k) {
            const double u = 2 * std::numbers::pi * i / n, v = 2 * std::numbers::pi * k / m;
            const double r = 1 + 0.3 * std::cos(v);
            mesh.positions.push_back({r * std::cos(u), r * std::sin(u), 0.3 * std::sin(v)});
            const std::uint32_t i1 = (i + 1) % n, k1 = (k + 1) % m;
            mesh.triangles.push_back({i * m + k, i1 * m + k, i1 * m + k1});
            mesh.triangles.push_back({i * m + k, i1 * m + k1, i * m + k1});
        }
    return mesh;
}

/// The octahedron, each face split in four `depth` times, on the unit sphere.
TriMesh ball(int depth) {
    TriMesh mesh;
    mesh.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                      {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (; depth > 0; --depth) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [it, is_new] = middles.try_emplace(
                std::minmax(a, b), static_cast<std::uint32_t>(mesh.positions.size()));
            if (is_new)
                mesh.positions.push_back(normalized(mesh.positions[a] + mesh.positions[b]));
            return it->second;
        };
        std::vector<Triangle> finer;
        for (const auto& [a, b, c] : mesh.triangles) {
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
        mesh.triangles = finer;
    }
    return mesh;
}

// Brute force in rationals, by another way than the library's: one triangle is cut down to what the
// other contains, and the corners of what is left are looked at.
using Exact3 = std::array<cpp_rational, 3>;

Exact3 exact(const Vec3& p) {
    return {cpp_rational(p.x), cpp_rational(p.y), cpp_rational(p.z)};
}
Exact3 minus(const Exact3& a, const Exact3& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Exact3 times(const Exact3& a, const Exact3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
cpp_rational inner(const Exact3& a, const Exact3& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

std::vector<Exact3> cut(const std::vector<Exact3>& polygon, const Exact3& on,
                        const Exact3& inward) {
    std::vector<Exact3> out;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Exact3 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
        const cpp_rational da = inner(minus(a, on), inward), db = inner(minus(b, on), inward);
        if (da >= 0)
            out.push_back(a);
        if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
            const cpp_rational t = da / (da - db);
            const Exact3 e = minus(b, a);
            out.push_back({a[0] + t * e[0], a[1] + t * e[1], a[2] + t * e[2]});
        }
    }
    return out;
}

bool cross_by_cutting(const std::vector<Vec3>& positions, const Triangle& f, const Triangle& g) {
    std::vector<Exact3> left, other, shared;
    for (const std::uint32_t v : f)
        left.push_back(exact(positions[v]));
    for (const std::uint32_t v : g) {
        other.push_back(exact(positions[v]));
        if (std::find(f.begin(), f.end(), v) != f.end())
            shared.push_back(other.back());
    }
    const Exact3 normal = times(minus(other[1], other[0]), minus(other[2], other[0]));
    left = cut(left, other[0], normal);
    left = cut(left, other[0], {-normal[0], -normal[1], -normal[2]});
    for (std::size_t k = 0; k < 3; ++k)
        left = cut(left, other[k], times(normal, minus(other[(k + 1) % 3], other[k])));
    if (shared.size() == 3)
        return true;
    for (const Exact3& p : left) {
        const bool at_vertex = std::find(shared.begin(), shared.end(), p) != shared.end();
        const bool on_edge =
            shared.size() == 2 &&
            times(minus(p, shared[0]), minus(shared[1], shared[0])) == Exact3{0, 0, 0};
        if (!at_vertex && !on_edge)
            return true;
    }
    return false;
}

std::size_t crossings_by_cutting(const TriMesh& mesh) {
    std::size_t n = 0;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        for (std::size_t k = i + 1; k < mesh.triangles.size(); ++k)
            n += cross_by_cutting(mesh.positions, mesh.triangles[i], mesh.triangles[k]);
    return n;
}

/// Triangles with an area between random points, all different; coordinates are multiples of
/// 1 / steps, so a small number makes touching and coplanar pairs frequent.
TriMesh soup(std::uint64_t seed, std::size_t n_points, std::size_t n_triangles, double steps) {
    const Rng rng{seed, 1};
    TriMesh mesh;
    for (std::uint64_t i = 0; mesh.positions.size() < n_points; ++i) {
        const auto w = rng.words(i);
        const auto coordinate = [&](std::size_t k) {
            return std::floor(w[k] * 0x1p-32 * steps) / steps;
        };
        const Vec3 p{coordinate(0), coordinate(1), coordinate(2)};
        if (std::find(mesh.positions.begin(), mesh.positions.end(), p) == mesh.positions.end())
            mesh.positions.push_back(p);
    }
    for (std::uint64_t i = 0; mesh.triangles.size() < n_triangles; ++i) {
        const auto w = rng.words(i, 1);
        const auto n = static_cast<std::uint32_t>(n_points);
        const Triangle t = {w[0] % n, w[1] % n, w[2] % n};
        if (!is_flat(mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]))
            mesh.triangles.push_back(t);
    }
    return mesh;
}

TEST(Certificate, OfATetrahedron) {
    const Certificate c = certify(tetrahedron());
    EXPECT_TRUE(c.holds());
    EXPECT_THAT(faults(c), testing::IsEmpty());
    EXPECT_EQ(c.n_vertices, 4u);
    EXPECT_EQ(c.n_triangles, 4u);
    EXPECT_EQ(c.n_components, 1u);
    EXPECT_EQ(c.euler, 2);
    EXPECT_EQ(c.genus, 0);
    EXPECT_DOUBLE_EQ(c.volume_m3, 1.0 / 6);
    EXPECT_DOUBLE_EQ(c.area_m2, 1.5 + std::sqrt(3.0) / 2);
    EXPECT_EQ(c.box, (Box{{0, 0, 0}, {1, 1, 1}}));
    EXPECT_EQ(c.n_self_intersections, 0u);
}

TEST(Certificate, OfATorusHasGenusOne) {
    const Certificate c = certify(torus(24, 12));
    EXPECT_TRUE(c.holds());
    EXPECT_EQ(c.euler, 0);
    EXPECT_EQ(c.genus, 1);
    EXPECT_EQ(c.n_self_intersections, 0u);
}

TEST(Certificate, AddsTheGenusOfSeparatePieces) {
    TriMesh far = torus(8, 6);
    for (Vec3& p : far.positions)
        p.x += 5;
    const Certificate c = certify(joined(joined(torus(8, 6), far), tetrahedron({0, 5, 0})));
    EXPECT_TRUE(c.holds());
    EXPECT_EQ(c.n_components, 3u);
    EXPECT_EQ(c.genus, 2);
}

TEST(Certificate, WeldsEqualPositionsZeroOfEitherSignIncluded) {
    TriMesh loose; // every corner its own position, some with -0
    const TriMesh whole = tetrahedron();
    for (const Triangle& t : whole.triangles) {
        const auto n = static_cast<std::uint32_t>(loose.positions.size());
        for (const std::uint32_t v : t) {
            const Vec3& p = whole.positions[v];
            loose.positions.push_back(n % 2 ? p : Vec3{p.x + -0.0, p.y == 0 ? -0.0 : p.y, p.z});
        }
        loose.triangles.push_back({n, n + 1, n + 2});
    }
    const Certificate c = certify(loose);
    EXPECT_TRUE(c.holds());
    EXPECT_EQ(c.n_vertices, 4u);
    EXPECT_EQ(c.n_merged_positions, 8u);
    loose.positions[0].x += 1e-300; // next to nothing is not equal
    EXPECT_FALSE(certify(loose).closed());
}

TEST(Certificate, FindsTheEdgesOfAHole) {
    TriMesh mesh = tetrahedron();
    mesh.triangles.pop_back();
    const Certificate c = certify(mesh);
    EXPECT_FALSE(c.closed());
    EXPECT_EQ(c.n_boundary_edges, 3u);
    EXPECT_EQ(c.euler, 1);
    EXPECT_THAT(faults(c), ElementsAre("3 boundary edges"));
}

TEST(Certificate, FindsAVertexWhereTwoSolidsTouch) {
    TriMesh mesh = joined(tetrahedron(), tetrahedron({-1, 0, 0})); // the second ends at the origin
    const Certificate c = certify(mesh);
    EXPECT_EQ(c.n_merged_positions, 1u);
    EXPECT_EQ(c.n_nonmanifold_vertices, 1u);
    EXPECT_EQ(c.n_nonmanifold_edges, 0u);
    EXPECT_EQ(c.n_components, 2u);
    EXPECT_THAT(faults(c), ElementsAre("1 vertex where separate fans of faces meet"));
}

TEST(Certificate, FindsAnEdgeOfFourFaces) {
    TriMesh mirrored = turned_inside_out(tetrahedron());
    for (Vec3& p : mirrored.positions)
        p = {-p.x, -p.y, p.z}; // shares the edge on the z axis; turned by 180 degrees
    const Certificate c = certify(joined(tetrahedron(), turned_inside_out(mirrored)));
    EXPECT_EQ(c.n_nonmanifold_edges, 1u);
    EXPECT_EQ(c.n_nonmanifold_vertices, 0u);
    EXPECT_FALSE(c.manifold());
    EXPECT_TRUE(c.closed());
    EXPECT_THAT(faults(c), ElementsAre("1 edge of three faces or more"));
}

TEST(Certificate, FindsAFaceThatLooksTheWrongWay) {
    TriMesh mesh = tetrahedron();
    std::swap(mesh.triangles[3][0], mesh.triangles[3][1]);
    const Certificate c = certify(mesh);
    EXPECT_EQ(c.n_misoriented_edges, 3u);
    EXPECT_TRUE(c.manifold());
    EXPECT_FALSE(c.outward());
}

TEST(Certificate, OfAMeshInsideOutDoesNotHold) {
    const Certificate c = certify(turned_inside_out(tetrahedron()));
    EXPECT_EQ(c.n_misoriented_edges, 0u);
    EXPECT_EQ(c.n_cavities, 1u);
    EXPECT_FALSE(c.holds());
    EXPECT_THAT(faults(c), ElementsAre("a volume of -0.166667 m^3, not above 0"));
}

TEST(Certificate, CountsCavitiesAndTakesTheirVolumeAway) {
    const Certificate c =
        certify(joined(tetrahedron(), turned_inside_out(tetrahedron({0.1, 0.1, 0.1}, 0.5))));
    EXPECT_TRUE(c.holds());
    EXPECT_EQ(c.n_components, 2u);
    EXPECT_EQ(c.n_cavities, 1u);
    EXPECT_NEAR(c.volume_m3, (1 - 0.125) / 6, 1e-15); // a dozen roundings of numbers below 1
    EXPECT_EQ(c.n_self_intersections, 0u);
}

TEST(Certificate, JudgesTheSideOfEveryPiece) {
    const TriMesh small = tetrahedron({0.1, 0.1, 0.1}, 0.5), apart = tetrahedron({3, 0, 0});
    EXPECT_TRUE(certify(joined(tetrahedron(), apart)).holds());
    const Certificate flipped =
        certify(joined(tetrahedron(), turned_inside_out(tetrahedron({3, 0, 0}, 0.5))));
    EXPECT_EQ(flipped.n_misplaced_pieces, 1u);
    EXPECT_GT(flipped.volume_m3, 0);
    EXPECT_FALSE(flipped.outward());
    EXPECT_THAT(faults(flipped), ElementsAre("1 piece that faces the wrong way"));
    EXPECT_EQ(certify(joined(tetrahedron(), small)).n_misplaced_pieces, 1u);
    // A solid in the cavity of another, beside a third.
    const TriMesh core = tetrahedron({0.15, 0.15, 0.15}, 0.25);
    EXPECT_TRUE(
        certify(joined(joined(joined(tetrahedron(), turned_inside_out(small)), core), apart))
            .holds());
    EXPECT_EQ(
        certify(joined(joined(tetrahedron(), turned_inside_out(small)), turned_inside_out(core)))
            .n_misplaced_pieces,
        1u);
}

TEST(Certificate, KeepsTheVolumeOfAPieceFarFromTheFirst) {
    const Certificate c = certify(joined(tetrahedron(), tetrahedron({1e6, 1e6, 1e6})));
    // Coordinates of 1e6 are multiples of 1.2e-10, and 1e6 + 1 is exact: only products round.
    EXPECT_NEAR(c.volume_m3, 2.0 / 6, 1e-15);
}

TEST(Certificate, CountsDuplicateFacesOfEitherOrientation) {
    TriMesh mesh = tetrahedron();
    mesh.triangles.push_back({1, 2, 0}); // the first face, turned round
    mesh.triangles.push_back({2, 1, 0}); // and again as it was
    const Certificate c = certify(mesh);
    EXPECT_EQ(c.n_duplicate_faces, 2u);
    EXPECT_FALSE(c.manifold());
}

TEST(Certificate, CountsFacesWithoutArea) {
    TriMesh mesh = tetrahedron();
    mesh.triangles.push_back({1, 1, 2});
    const Certificate collapsed = certify(mesh);
    EXPECT_EQ(collapsed.n_degenerate_faces, 1u);
    EXPECT_TRUE(collapsed.closed()) << "a face that is an edge opens nothing";
    EXPECT_THAT(faults(collapsed), ElementsAre("1 face without area"));

    TriMesh line; // 0.1, 0.2, 0.3 are not on one line in double; 0.125, 0.25, 0.375 are
    line.positions = {{0.1, 0.1, 0.3}, {0.2, 0.2, 0.3}, {0.3, 0.3, 0.3}};
    line.triangles = {{0, 1, 2}};
    EXPECT_EQ(certify(line).n_degenerate_faces, 1u) << "x equals y, whatever they are";
    line.positions = {{0.1, 0.2, 0}, {0.2, 0.4, 0}, {0.3, 0.6, 0}};
    EXPECT_EQ(certify(line).n_degenerate_faces, 1u) << "y is twice x, exactly";
    line.positions[2].y = std::nextafter(0.6, 1);
    EXPECT_EQ(certify(line).n_degenerate_faces, 0u) << "one bit off the line";
}

TEST(Certificate, CountsPositionsThatAreNotFinite) {
    TriMesh mesh = joined(tetrahedron(), tetrahedron({3, 0, 0}));
    mesh.positions[1].x = std::numeric_limits<double>::quiet_NaN();
    mesh.positions[2].y = -std::numeric_limits<double>::infinity();
    const Certificate c = certify(mesh);
    EXPECT_EQ(c.n_nonfinite_positions, 2u);
    EXPECT_FALSE(c.holds());
    EXPECT_EQ(c.n_components, 2u);
    EXPECT_TRUE(std::isfinite(c.volume_m3) && std::isfinite(c.area_m2));
    EXPECT_EQ(c.box, (Box{{3, 0, 0}, {4, 1, 1}}));
    EXPECT_THAT(faults(c)[0], "2 positions that are not finite");
}

TEST(Certificate, OfNothingSaysSo) {
    const Certificate c = certify({});
    EXPECT_FALSE(c.holds());
    EXPECT_EQ(c.genus, 0);
    EXPECT_THAT(faults(c), ElementsAre("no triangles"));
}

TEST(Certificate, RefusesAnIndexPastTheEnd) {
    TriMesh mesh = tetrahedron();
    mesh.triangles[2][1] = 4;
    try {
        certify(mesh);
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::bad_input);
        EXPECT_THAT(e.what(), HasSubstr("triangles[2] has the index 4, but there are 4 positions"));
    }
}

TEST(Certificate, StatesCrossingsWithoutJudgingThem) {
    const TriMesh mesh = joined(tetrahedron(), tetrahedron({0.125, 0.125, 0.125}));
    const Certificate c = certify(mesh);
    EXPECT_EQ(c.n_self_intersections, crossings_by_cutting(mesh));
    EXPECT_GT(c.n_self_intersections, 0u);
    EXPECT_TRUE(c.holds());
    EXPECT_EQ(certify(mesh, {.self_intersections = false}).n_self_intersections, 0u);
}

TEST(Certificate, IsTheSameOnOneThreadAndMany) {
    const TriMesh mesh = soup(3, 200, 400, 64);
    const Certificate many = certify(mesh);
    tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const Certificate alone = certify(mesh);
    EXPECT_EQ(alone.n_self_intersections, many.n_self_intersections);
    EXPECT_EQ(alone.volume_m3, many.volume_m3);
    EXPECT_EQ(alone.n_boundary_edges, many.n_boundary_edges);
    EXPECT_EQ(alone.n_nonmanifold_vertices, many.n_nonmanifold_vertices);
}

TEST(Crossings, AreNoneOnABall) {
    const TriMesh mesh = ball(5);
    EXPECT_EQ(count_crossings(mesh.positions, mesh.triangles), 0u);
}

TEST(Crossings, CountEveryWayInWhichTwoFacesMeet) {
    const std::vector<Vec3> p = {{0, 0, 0},   {4, 0, 0},  {0, 4, 0},  {1, 1, -1}, {1, 1, 1},
                                 {5, 5, 1},   {1, 1, 0},  {2, 0, 0},  {2, -2, 1}, {3, -2, 1},
                                 {1, 0.5, 0}, {5, 5, -1}, {0, -4, 0}, {2, -4, 2}, {-4, 0, 0}};
    const Triangle base = {0, 1, 2};
    EXPECT_TRUE(faces_cross(p, base, {3, 4, 5})) << "an edge pierces";
    EXPECT_TRUE(faces_cross(p, base, {6, 4, 5})) << "a vertex touches the inside";
    EXPECT_TRUE(faces_cross(p, base, {7, 8, 9})) << "a vertex touches an edge";
    EXPECT_TRUE(faces_cross(p, base, {0, 1, 10})) << "folded onto the neighbour";
    EXPECT_TRUE(faces_cross(p, base, {0, 6, 4})) << "one vertex shared, an edge within the face";
    EXPECT_TRUE(faces_cross(p, base, {2, 1, 0})) << "the same three vertices";
    EXPECT_TRUE(faces_cross(p, base, {10, 6, 7})) << "in one plane, overlapping";
    EXPECT_FALSE(faces_cross(p, base, {0, 1, 12})) << "unfolded neighbour in the same plane";
    EXPECT_FALSE(faces_cross(p, base, {0, 1, 4})) << "neighbour at an angle";
    EXPECT_FALSE(faces_cross(p, base, {1, 9, 13})) << "one vertex shared, else apart";
    EXPECT_FALSE(faces_cross(p, base, {0, 14, 12})) << "one vertex shared in the same plane";
    EXPECT_FALSE(faces_cross(p, base, {5, 8, 9})) << "apart";
}

TEST(Crossings, AgreeWithBruteForceInRationals) {
    std::size_t n = 0;
    // Few steps: touching, coplanar and shared vertices abound. Many: general position.
    for (const double steps : {3.0, 4.0, 7.0, 1000.0})
        for (std::uint64_t seed = 0; seed < 4; ++seed) {
            const TriMesh mesh = soup(seed, 18, 24, steps);
            const std::size_t expected = crossings_by_cutting(mesh);
            EXPECT_EQ(count_crossings(mesh.positions, mesh.triangles), expected)
                << "seed " << seed << ", steps " << steps;
            n += expected;
        }
    EXPECT_GT(n, 500u) << "the soups are too thin to say anything";
}

TEST(Crossings, StayExactWhereDoublesRound) {
    // Nearly coplanar: heights of the order of the rounding of the determinant, and an offset that
    // makes differences of coordinates inexact.
    const Rng rng{7, 2};
    std::size_t n_zero = 0;
    for (std::uint64_t i = 0; i < 300; ++i) {
        std::array<Vec3, 4> p;
        for (std::uint32_t k = 0; k < 4; ++k) {
            const double x = rng.uniform(i, 4 * k), y = rng.uniform(i, 4 * k + 1);
            p[k] = {x, y,
                    i % 3 == 0   ? 1e-17 * rng.uniform(i, 4 * k + 2)
                    : i % 3 == 1 ? x
                                 : x / 3 + y};
        }
        const Exact3 a = exact(p[0]);
        const cpp_rational det =
            inner(times(minus(exact(p[1]), a), minus(exact(p[2]), a)), minus(exact(p[3]), a));
        EXPECT_EQ(orient3d(p[0], p[1], p[2], p[3]), det > 0 ? 1 : det < 0 ? -1 : 0) << i;
        n_zero += det == 0;
    }
    EXPECT_GE(n_zero, 100u) << "z = x is a plane, exactly";
    EXPECT_LT(n_zero, 200u) << "rounded heights must leave the plane";
}

TEST(Crossings, StayExactAtTheEndsOfTheRangeOfDoubles) {
    for (const double s : {1e-310, 1e-160, 1e150, 1e307}) {
        const Vec3 a{0, 0, 0}, b{s, 0, 0}, c{0, s, 0};
        EXPECT_EQ(orient3d(a, b, c, {0, 0, s}), 1) << s;
        EXPECT_EQ(orient3d(a, b, c, {s, s, -s}), -1) << s;
        EXPECT_EQ(orient3d(a, b, c, {s, s, 0}), 0) << s;
        EXPECT_FALSE(is_flat(a, b, c)) << s;
    }
}

} // namespace
} // namespace taihu
