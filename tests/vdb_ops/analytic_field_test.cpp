#include "vdb_ops/analytic_field.h"

#include "tests/support/errors.h"
#include "tests/support/fields.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;

/// Waves on a slab: 1-Lipschitz as it is, since its slope is 1 + 0.3^2 at most.
double waves(const Vec3& p) {
    return (std::fabs(p.y + 0.1 * std::sin(3 * p.x)) - 0.2) / std::sqrt(1.09);
}

const Box kHolds{{-1, -0.4, -1}, {1, 0.4, 1}};
const Lattice kLattice{0.03, {0.01, 0, 0.02}, 3};
const CoordBBox kBox(Coord(-30), Coord(30));

TEST(AnalyticField, TakesAFunctionOfAPointOrOfManyPoints) {
    const AnalyticField one(kHolds, waves);
    std::atomic<std::size_t> n_calls{0};
    const AnalyticField many(kHolds, [&](std::span<const Vec3> points, double* out) {
        ++n_calls;
        for (std::size_t i = 0; i < points.size(); ++i)
            out[i] = waves(points[i]);
    });
    const auto inside = [](const Field& f) { // the slab goes on beyond the box
        return sample(f, kLattice, kBox).values;
    };
    EXPECT_EQ(inside(one), inside(many));
    // Blocks, their leaves' middles, and leaves near the surface; 61^3 voxels would be 226,981.
    EXPECT_LT(n_calls, 2000u);
}

TEST(AnalyticField, IsTheClampedDistanceAtEveryVoxel) {
    const AnalyticField field(kHolds, [](const Vec3& p) {
        return box_distance(p, {0.5, 0.3, 0.7});
    });
    expect_distances(
        field, kLattice, kBox,
        [](const Vec3& p) {
            return box_distance(p, {0.5, 0.3, 0.7});
        },
        1e-6);
    expect_blocks_equal_the_whole(field, {0.01, {}, 3});
}

TEST(AnalyticField, EvaluatesOnlyLeavesNearTheSurface) {
    const AnalyticField field({{-1, -1, -1}, {1, 1, 1}},
                              [](const Vec3& p) { return length(p) - 0.8; });
    const Lattice lattice{0.02, {}, 3};
    const CoordBBox box(Coord(-64), Coord(63));
    const DenseField dense = sample(field, lattice, box);
    each_voxel(box, lattice, [&](const Coord& c, const Vec3& p) {
        const double d = std::fabs(length(p) - 0.8) / lattice.voxel_m;
        ASSERT_TRUE(d < 3 + 12.2 || !dense.evaluated[dense.index(c)]) << c; // two half diagonals
    });
}

TEST(BoxDistance, IsOneLipschitzAndZeroOnTheSurface) {
    for (std::uint64_t i = 0; i < 2000; ++i) {
        const Vec3 p = random_vec(i) * 2.0, q = p + random_vec(i, 5) * 0.02;
        EXPECT_LE(std::fabs(box_distance(p, {1, 0.5, 0.7}) - box_distance(q, {1, 0.5, 0.7})),
                  length(p - q) + 1e-15);
    }
    EXPECT_EQ(box_distance({1, 0.2, 0}, {1, 0.5, 0.7}), 0);
    EXPECT_NEAR(box_distance({1.3, 0.9, 0}, {1, 0.5, 0.7}), 0.5, 1e-15);
}

} // namespace
} // namespace taihu
