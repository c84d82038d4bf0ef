#include "vdb_ops/placed_level_set_field.h"

#include "tests/support/errors.h"
#include "tests/support/fields.h"
#include "tests/support/grids.h"
#include "vdb_ops/combine_field.h"
#include "vdb_ops/offset_field.h"
#include "vdb_ops/shapes.h"
#include "vdb_ops/solids_field.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;

const AnalyticSolid kBall{BallSolid{0.8}, Similarity::translation({0.1, 0.05, -0.1})};

openvdb::FloatGrid::Ptr ball_on(double voxel_m) {
    return rasterize(SolidsField({kBall}), {voxel_m, {0.003, 0.001, 0.002}, 3});
}

TEST(PlacedLevelSetField, HandsItsOwnGridOnAsItIs) {
    const auto grid = ball_on(0.037);
    const auto again = rasterize(PlacedLevelSetField(grid), lattice_of(*grid));
    EXPECT_EQ(again->activeVoxelCount(), grid->activeVoxelCount());
    for (auto it = grid->cbeginValueOn(); it; ++it) // to voxels and back: the last bit of a float
        ASSERT_NEAR(again->tree().getValue(it.getCoord()), *it, 1e-6 * 0.037);
}

TEST(PlacedLevelSetField, IsTheMovedSolidOnAnyLattice) {
    const auto grid = ball_on(0.04);
    const Similarity turn = Similarity::rotation({1, 2, 3}, 0.7);
    for (const Similarity& at :
         {Similarity(), turn, Similarity::translation({0.3, -0.2, 0.11}) * turn,
          turn * Similarity::scaling(0.5), Similarity::scaling(2.2) * turn})
        for (const double voxel : {0.04, 0.025, 0.09}) {
            const AnalyticSolid moved{kBall.shape, at * kBall.at};
            SCOPED_TRACE(std::to_string(at.scale()) + " " + std::to_string(voxel));
            // Trilinear: 3 h^2 / 8r, all in voxels of the lattice, h that of the grid placed.
            // Beyond the grid's own band the eikonal equation adds 0.1 h, and 0.03 of the way
            // there.
            const double h = 0.04 * at.scale() / voxel, r = 0.8 * at.scale() / voxel;
            const double tolerance =
                3 * h * h / (8 * r) + 0.1 * h + 0.04 * std::max(0.0, 3 - 3 * h);
            const int n = static_cast<int>(1.1 * at.scale() / voxel) + 12;
            const int step = std::min(n, 40);
            expect_distances(
                PlacedLevelSetField(grid, at), {voxel, {}, 3},
                CoordBBox(Coord(-n, -step / 2, -n / 3), Coord(n, step / 2, n)),
                [&](const Vec3& p) { return distance_m(moved, p); }, tolerance);
        }
}

TEST(PlacedLevelSetField, MayBeMuchFinerThanTheLattice) {
    const auto grid = ball_on(0.02);
    // 20 of its voxels make one: its band of 3 is widened to 62. Tolerance as above.
    expect_distances(
        PlacedLevelSetField(grid), {0.4, {}, 3}, CoordBBox(Coord(-9), Coord(9)),
        [&](const Vec3& p) { return distance_m(kBall, p); }, 0.14);
}

TEST(PlacedLevelSetField, KeepsVolumesAndSlopes) {
    const AnalyticSolid box{BoxSolid{{0.6, 0.4, 0.5}}, Similarity::rotation({0, 1, 0}, 0.3)};
    const auto grid = rasterize(SolidsField({box}), {0.03, {}, 3});
    const PlacedLevelSetField field(grid, Similarity::rotation({1, 2, 3}, 0.7));
    const auto placed_grid = rasterize(field, {0.03, {}, 3});
    EXPECT_NEAR(volume_m3(*placed_grid), 0.96, 0.01 * 0.96); // its edges, half a voxel squared each
    // At sharp edges trilinear values within the bounds are still a little steep.
    EXPECT_LE(steepest(sample(field, {0.03, {}, 3}, CoordBBox(Coord(-32), Coord(32)))), 1.1);
}

TEST(PlacedLevelSetField, BlocksAloneEqualTheWhole) {
    const auto grid = ball_on(0.04);
    expect_blocks_equal_the_whole(
        PlacedLevelSetField(grid, Similarity::rotation({1, 2, 3}, 0.7) * Similarity::scaling(1.3)),
        {0.04, {}, 3});
}

TEST(PlacedLevelSetField, NeverCallsTheBandFar) {
    // As its values on all voxels say, also where one lattice is much finer than the other.
    const auto rock = rasterize(*shape_field({.subdivisions = 3}), {0.03, {}, 3});
    for (const double scale : {0.3, 1.0, 4.0}) {
        const PlacedLevelSetField field(rock, Similarity::scaling(scale) *
                                                  Similarity::rotation({3, 1, 1}, 1));
        const Lattice lattice{0.03, {}, 3};
        const CoordBBox box(Coord(-20, -10, -60), Coord(20, 10, 60));
        const DenseField some = sample(field, lattice, box);
        // With a wide band every leaf of the box is evaluated.
        const DenseField all = sample(field, {0.03, {}, 16}, box);
        for (std::size_t i = 0; i < some.values.size(); ++i)
            ASSERT_NEAR(some.values[i], std::clamp(all.values[i], -3.f, 3.f), 1e-4) << scale;
    }
}

TEST(PlacedLevelSetField, CanBeBlendedAndGrown) {
    const auto rock = std::make_shared<PlacedLevelSetField>(ball_on(0.04));
    const auto ball = std::make_shared<SolidsField>(
        std::vector<AnalyticSolid>{{BallSolid{0.4}, Similarity::translation({0.9, 0, 0})}});
    const double k = 0.4; // wider than the file's band
    expect_distances(
        CombineField(Combine::unite, {rock, ball}, k), {0.04, {}, 3},
        CoordBBox(Coord(-30, -10, -30), Coord(40, 10, 30)),
        [&](const Vec3& p) {
            return smooth_min({distance_m(kBall, p), length(p - Vec3{0.9, 0, 0}) - 0.4}, k);
        },
        0.35); // 10 voxels away the eikonal equation is off by 0.03 a voxel
    const double grown = volume_m3(*rasterize(OffsetField(rock, 0.2), {0.04, {}, 3}));
    EXPECT_NEAR(grown, 4.0 / 3 * std::numbers::pi, 0.02 * grown); // 0.2 voxel of 25
}

TEST(PlacedLevelSetField, RefusesWhatIsNoLevelSetAndBandsBeyondReason) {
    expect_error(Fault::bad_argument, "null", [] { PlacedLevelSetField{nullptr}; });
    const auto fog = openvdb::FloatGrid::create(0);
    expect_error(Fault::bad_argument, "not a level set", [&] { PlacedLevelSetField{fog}; });
    const auto grid = ball_on(0.04);
    expect_error(Fault::bad_argument, "at most 1000 are handled", [&] {
        PlacedLevelSetField(grid).on({40, {}, 3}, CoordBBox::inf());
    });
}

TEST(PlacedLevelSetField, OfAnEmptyGridIsEmpty) {
    const auto none = rasterize(SolidsField({}), {0.1, {}, 3});
    EXPECT_TRUE(PlacedLevelSetField(none).on({0.05, {}, 3}, CoordBBox::inf())->bounds().empty());
}

} // namespace
} // namespace taihu
