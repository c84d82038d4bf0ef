#include "vdb_ops/estimate.h"

#include "stats/core/rng.h"
#include "tests/support/errors.h"
#include "tests/support/grids.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/shapes.h"

namespace taihu {
namespace {

double leaves(const Field& field, const Lattice& lattice) {
    return static_cast<double>(rasterize(field, lattice)->tree().leafCount());
}

TEST(Estimate, LeavesAreThoseOfTheLevelSet) {
    std::vector<Sphere> holes;
    for (std::uint64_t i = 0; i < 3000; ++i) {
        const Rng rng{9, 4};
        holes.push_back(
            {{2 * rng.uniform(i, 0) - 1, 2 * rng.uniform(i, 1) - 1, 2 * rng.uniform(i, 2) - 1},
             0.1 * rng.uniform(i, 3)});
    }
    const auto ball = std::make_shared<BallsField>(std::array<Sphere, 1>{{{{}, 1}}});
    const DifferenceField rock(ball, std::make_shared<BallsField>(holes));
    const Lattice coarse{0.02, {}, 3}, fine{2.0 / 600, {}, 3};
    // Few blocks near the surface: all are looked at, so nothing is left to chance.
    EXPECT_EQ(estimate_size(*ball, coarse).n_leaves, leaves(*ball, coarse));
    const double exact = leaves(rock, fine); // about 800 blocks, of which 256 are sampled
    EXPECT_NEAR(estimate_size(rock, fine).n_leaves, exact, 0.15 * exact);
    EXPECT_GT(estimate_size(rock, fine).seconds, 0);
    EXPECT_EQ(estimate_size(BallsField(std::vector<Sphere>{}), fine).n_leaves, 0);
}

TEST(Estimate, OfALargeLatticeSamplesAShareOfItsBlocks) {
    // 1.7 million blocks. Leaves of a ball: area / voxel^2 times 0.033 to 0.035 for 3 voxels.
    const BallsField ball(std::array<Sphere, 1>{{{{}, 1}}});
    const double voxel_m = 2.0 / 7600, area_vox = 4 * M_PI / (voxel_m * voxel_m);
    const double n = estimate_size(ball, {voxel_m, {}, 3}).n_leaves;
    EXPECT_NEAR(n, 0.034 * area_vox, 0.25 * 0.034 * area_vox);
}

TEST(Estimate, RefusesWithTheVoxelThatFits) {
    const MemoryUse use{.leaves = 1.001e6};
    refuse_if_over(use, 0.001, 5e9);
    expect_error(Fault::unsupported,
                 "refused: voxel size 0.001 m would need about 4.05 GB (limit 1.05 GB); smallest "
                 "that fits: 0.00204 m",
                 [&] { refuse_if_over(use, 0.001, 1.05e9); });
    const MemoryUse fitted{.leaves = 1.001e6 / (2.04 * 2.04)};
    refuse_if_over(fitted, 0.00204, 1.05e9);
}

TEST(Estimate, TheLimitIsTheLeastOfWhatThereIsAndWhatWasAskedFor) {
    EXPECT_EQ(memory_limit_bytes(1e6), 1e6);
    EXPECT_LT(memory_limit_bytes(), 1e15);
    EXPECT_LT(memory_limit_bytes(1e18), 1e15);
}

TEST(Estimate, SmallBoxesNeedNone) {
    const Box box{{0, 0, 0}, {1, 1, 1}};
    EXPECT_FALSE(may_exceed(box, 1.0 / 128, {.cleaned = true}, 1e9));
    EXPECT_TRUE(may_exceed(box, 1.0 / 2048, {.cleaned = true}, 1e9));
}

} // namespace
} // namespace taihu
