#include "mesh_out/surface_distance.h"

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include "mesh_out/closest_point_detail.h"
#include "mesh_out/extract.h"
#include "stats/core/error.h"
#include "stats/core/rng.h"
#include "tests/support/level_sets.h"

namespace taihu {
namespace {

using testing::HasSubstr;

Vec3 random_point(std::uint64_t item, double size) {
    const Rng rng{.seed = 3, .stream = 1};
    return (Vec3{rng.uniform(item, 0), rng.uniform(item, 1), rng.uniform(item, 2)} -
            Vec3{0.5, 0.5, 0.5}) *
           size;
}

TriMesh soup(std::size_t n_triangles, const Vec3& where) {
    TriMesh mesh;
    for (std::uint32_t i = 0; i < 3 * n_triangles; ++i)
        mesh.positions.push_back(where + random_point(i / 3, 2) + random_point(100'000 + i, 0.2));
    for (std::uint32_t i = 0; i < n_triangles; ++i)
        mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    return mesh;
}

TriMesh square(double z) {
    return {{{0, 0, z}, {1, 0, z}, {1, 1, z}, {0, 1, z}}, {{0, 1, 2}, {0, 2, 3}}, {}};
}

TEST(ClosestPoint, IsNoFartherThanAnyPointOfADenseSampling) {
    for (std::uint64_t i = 0; i < 200; ++i) {
        const Vec3 a = random_point(4 * i, 1), b = random_point(4 * i + 1, 1),
                   c = random_point(4 * i + 2, 1), p = random_point(4 * i + 3, 3);
        const double found = length(closest_point_on_triangle(p, a, b, c) - p);
        constexpr int kSteps = 60;
        double sampled = 1e300;
        for (int u = 0; u <= kSteps; ++u)
            for (int v = 0; u + v <= kSteps; ++v) {
                const Vec3 q = a + (b - a) * (double(u) / kSteps) + (c - a) * (double(v) / kSteps);
                sampled = std::min(sampled, length(q - p));
            }
        EXPECT_LE(found, sampled + 1e-12);        // rounding
        EXPECT_GE(found, sampled - 2.0 / kSteps); // edges are at most sqrt(3) long
    }
}

TEST(SurfaceDistance, EqualsTheSearchOverAllTriangles) {
    // A kilometre from the origin float positions alone would be 6e-5 m off.
    for (const Vec3& where : {Vec3{}, Vec3{1000, -700, 300}}) {
        const TriMesh mesh = soup(400, where);
        const SurfaceDistance surface(mesh);
        for (std::uint64_t i = 0; i < 500; ++i) {
            const Vec3 p = where + random_point(500'000 + i, 4);
            double expected = 1e300;
            for (const Triangle& t : mesh.triangles)
                expected =
                    std::min(expected, length(closest_point_on_triangle(p, mesh.positions[t[0]],
                                                                        mesh.positions[t[1]],
                                                                        mesh.positions[t[2]]) -
                                              p));
            const double rounding = 1e-12; // of coordinates up to 1e3 in double, some operations
            EXPECT_NEAR(surface(p), expected, rounding);
            EXPECT_NEAR(length(surface.nearest(p) - p), expected, rounding);
            EXPECT_EQ(surface(p, 0.5 * expected), 0.5 * expected);
            EXPECT_NEAR(surface(p, 2 * expected), expected, rounding);
        }
    }
}

TEST(SurfaceDistance, NamesTheLowestOfEquallyNearTriangles) {
    EXPECT_EQ(SurfaceDistance(square(0)).nearest_triangle({0.5, 0.5, 3}), 0u); // on the diagonal
    EXPECT_EQ(SurfaceDistance(square(0)).nearest_triangle({0.1, 0.9, 3}), 1u);
}

TEST(SurfaceDistance, RefusesMeshesWithoutASurface) {
    try {
        const SurfaceDistance none{TriMesh{}};
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::bad_argument);
        EXPECT_THAT(e.what(), HasSubstr("0 triangles"));
    }
    TriMesh broken = square(0);
    broken.positions[3].y = std::nan("");
    try {
        const SurfaceDistance none(broken);
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_THAT(e.what(), HasSubstr("triangles[1] has vertex 3"));
    }
}

TEST(TwoSidedDistance, OfParallelSquaresIsTheirGap) {
    const TwoSidedDistance d = two_sided_distance(square(0), square(0.25), 0.1);
    EXPECT_DOUBLE_EQ(d.max_m, 0.25);
    EXPECT_DOUBLE_EQ(d.rms_m, 0.25);
}

TEST(TwoSidedDistance, SeesWhatOnlyOneOfTheTwoHas) {
    TriMesh with_flag = square(0); // a far triangle that the other lacks
    with_flag.positions.insert(with_flag.positions.end(), {{0, 0, 2}, {1, 0, 2}, {0, 1, 3}});
    with_flag.triangles.push_back({4, 5, 6});
    const TwoSidedDistance d = two_sided_distance(square(0), with_flag, 0.1);
    EXPECT_LE(d.max_a_to_b_m, 1e-15); // rounding
    EXPECT_DOUBLE_EQ(d.max_b_to_a_m, 3);
    EXPECT_DOUBLE_EQ(d.max_m, 3);
}

TEST(TwoSidedDistance, LooksInsideFacesThatAreLongAgainstTheSpacing) {
    TriMesh dented = square(0); // a small square is sunk by 0.5 around (0.3, 0.2)
    for (Vec3& p : dented.positions)
        p = p * 0.1 + Vec3{0.25, 0.15, -0.5};
    // Its reach from the large square is 0.5; the other way the corner (1, 1, 0) is the farthest.
    EXPECT_DOUBLE_EQ(two_sided_distance(dented, square(0), 0.01).max_a_to_b_m, 0.5);
    const double far = length(Vec3{1, 1, 0} - Vec3{0.35, 0.25, -0.5});
    EXPECT_DOUBLE_EQ(two_sided_distance(dented, square(0), 0.01).max_b_to_a_m, far);
}

TEST(TwoSidedDistance, SamplesSoThatASpikeBetweenCornersIsMet) {
    // Two triangles against the same with a pyramid of height 0.2 and base 0.04 in the middle of
    // one.
    TriMesh spiked = square(0);
    spiked.positions.insert(spiked.positions.end(),
                            {{0.68, 0.28, 0}, {0.72, 0.28, 0}, {0.7, 0.32, 0}, {0.7, 0.3, 0.2}});
    for (const Triangle& t : {Triangle{4, 5, 7}, Triangle{5, 6, 7}, Triangle{6, 4, 7}})
        spiked.triangles.push_back(t);
    EXPECT_DOUBLE_EQ(two_sided_distance(spiked, square(0), 0.5).max_a_to_b_m, 0.2);
}

TEST(TwoSidedDistance, IsBitIdenticalOnOneThreadAndMany) {
    const TriMesh a = extract_uniform(*ball_grid(1, 0.1)), b = extract_uniform(*ball_grid(1, 0.13));
    const TwoSidedDistance many = two_sided_distance(a, b, 0.05);
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    const TwoSidedDistance one = two_sided_distance(a, b, 0.05);
    EXPECT_EQ(one.max_m, many.max_m);
    EXPECT_EQ(one.rms_m, many.rms_m);
    EXPECT_EQ(one.n_samples, many.n_samples);
}

TEST(TwoSidedDistance, RefusesASpacingThatWouldNeverEnd) {
    for (const double spacing : {0.0, -1.0, 1e-9, std::nan("")})
        EXPECT_THROW(two_sided_distance(square(0), square(1), spacing), Error);
}

} // namespace
} // namespace taihu
