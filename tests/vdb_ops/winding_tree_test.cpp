#include "vdb_ops/winding_tree_detail.h"

#include <gtest/gtest.h>

#include "stats/core/rng.h"
#include "tests/support/mesh_oracle.h"
#include "vdb_ops/shapes.h"

namespace taihu {
namespace {

Vec3 random_point(std::uint64_t i, double reach) {
    const Rng rng{5, 6};
    return Vec3{rng.uniform(i, 0) - 0.5, rng.uniform(i, 1) - 0.5, rng.uniform(i, 2) - 0.5} *
           (2 * reach);
}

TEST(WindingTree, AgreesWithTheSumOverAllFaces) {
    TriMesh open = shape_mesh({.kind = ShapeKind::boulder, .subdivisions = 4});
    open.triangles.resize(open.triangles.size() / 2);
    const WindingTree tree(open.positions, open.triangles);
    double worst = 0, sum = 0;
    for (std::uint64_t i = 0; i < 500; ++i) {
        const Vec3 p = random_point(i, 0.8);
        const double off = std::fabs(tree.at(p) - mesh_winding(open.positions, open.triangles, p));
        worst = std::max(worst, off);
        sum += off;
    }
    EXPECT_LE(worst, 0.01); // dipoles from four radii
    EXPECT_LE(sum / 500, 0.001);
    EXPECT_GT(worst, 1e-9); // far clusters are not summed face by face
}

TEST(WindingTree, BoundsWhatIsNear) {
    const TriMesh patch{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, {}};
    const WindingTree tree(patch.positions, patch.triangles);
    for (std::uint64_t i = 0; i < 200; ++i) {
        const Vec3 p = random_point(i, 3);
        const double bound = tree.bound(p, 0.3);
        for (std::uint64_t k = 0; k < 5; ++k) {
            const Vec3 q = p + random_point(1000 + 5 * i + k, 0.17); // within 0.3 of it
            EXPECT_LE(std::fabs(tree.at(q)), std::max(bound, bound >= 1 ? 1.0 : 0.0) + 1e-9);
        }
    }
    EXPECT_LT(tree.bound({5, 5, 5}, 0.3), 0.01);
    EXPECT_FALSE(tree.near({5, 5, 5}, 0.3));
    EXPECT_TRUE(tree.near({0.2, 0.2, 0.29}, 0.3));
    EXPECT_GE(tree.bound({0.2, 0.2, 0.1}, 0.3), 1);
}

TEST(WindingTree, SaysWhenAPointLiesOnAFace) {
    const TriMesh patch{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, {}};
    const WindingTree tree(patch.positions, patch.triangles);
    bool on = false;
    EXPECT_EQ(tree.at({0.25, 0.25, 0}, &on), 0);
    EXPECT_TRUE(on);
    on = false;
    EXPECT_NEAR(tree.at({0.25, 0.25, -1e-6}, &on), 0.5, 1e-4); // its faces point to +z
    EXPECT_FALSE(on);
    tree.at({2, 2, 0}, &on);
    EXPECT_FALSE(on);
}

TEST(WindingTree, OfNothingIsNothing) {
    const WindingTree tree({}, {});
    EXPECT_EQ(tree.at({1, 2, 3}), 0);
    EXPECT_EQ(tree.bound({1, 2, 3}, 1), 0);
    EXPECT_FALSE(tree.near({1, 2, 3}, 1));
}

} // namespace
} // namespace taihu
