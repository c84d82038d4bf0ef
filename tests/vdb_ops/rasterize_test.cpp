#include "vdb_ops/rasterize.h"

#include <tbb/global_control.h>

#include "stats/core/rng.h"
#include "tests/support/errors.h"
#include "tests/support/grids.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/level_set_field.h"

namespace taihu {
namespace {

TEST(Rasterize, BallIsExactInItsBandAndSignedEverywhere) {
    const Vec3 center{0.13, -0.27, 0.41};
    const BallsField field(std::array<Sphere, 1>{{{center, 1}}});
    const auto grid = rasterize(field, {0.05, {}, 3});
    const auto accessor = grid->getConstAccessor();
    for (int i = -30; i <= 30; ++i)
        for (int j = -30; j <= 30; ++j)
            for (int k = -30; k <= 30; ++k) {
                const double exact = length(Vec3{i * 0.05, j * 0.05, k * 0.05} - center) - 1;
                const float value = accessor.getValue(openvdb::Coord(i, j, k));
                ASSERT_EQ(value < 0, exact < 0) << i << ' ' << j << ' ' << k;
                // Float: 1e-6 voxel relative to coordinates of a few tens of voxels.
                ASSERT_NEAR(value, std::clamp(exact, -0.15, 0.15), 1e-6);
                ASSERT_EQ(accessor.isValueOn(openvdb::Coord(i, j, k)), std::fabs(value) < 0.15f);
            }
}

TEST(Rasterize, InsideOfALargeSolidIsFilledBetweenFarLeaves) {
    const auto grid = ball_rock(10, 0.05); // 400 voxels across: uniform nodes in the middle
    const auto accessor = grid->getConstAccessor();
    for (int i = -190; i <= 190; i += 10)
        for (int j = -60; j <= 60; j += 10)
            ASSERT_LT(accessor.getValue(openvdb::Coord(i / 2, j, i / 2)), 0) << i << ' ' << j;
    EXPECT_GT(accessor.getValue(openvdb::Coord(0, 0, 230)), 0);
}

TEST(Rasterize, IsBitIdenticalOnOneThreadAndMany) {
    const std::string many = grid_hash(*ball_rock(1, 0.01));
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(grid_hash(*ball_rock(1, 0.01)), many);
}

TEST(Rasterize, HonoursTheOriginOfTheLattice) {
    const BallsField field(std::array<Sphere, 1>{{{{1, 2, 3}, 0.5}}});
    const auto here = rasterize(field, {0.05, {0.01, 0.02, 0.03}, 3});
    EXPECT_NEAR(here->tree().getValue(here->transform().worldToIndexCellCentered({1, 2, 3.5})), 0,
                0.03);
    const Lattice lattice = lattice_of(*here);
    EXPECT_NEAR(lattice.origin.z, 0.03, 1e-12);
    EXPECT_NEAR(lattice.voxel_m, 0.05, 1e-12);
}

TEST(Rasterize, RefusesLatticesOutOfRange) {
    const BallsField field(std::array<Sphere, 1>{{{{}, 1}}});
    expect_error(Fault::bad_argument, "voxel_m is 0", [&] { rasterize(field, {0, {}, 3}); });
    expect_error(Fault::bad_argument, "half_width_vox", [&] { rasterize(field, {0.1, {}, 1}); });
    expect_error(Fault::bad_argument, "1.5e-5 m", [&] { rasterize(field, {1e-10, {}, 3}); });
}

/// Expects two fields to say the same in a block, and returns how many leaves have a surface.
int expect_same_block(const LatticeField& a, const LatticeField& b, const openvdb::Coord& block) {
    Cover cover_a{}, cover_b{};
    const auto in_a = a.open(block, cover_a), in_b = b.open(block, cover_b);
    EXPECT_EQ(cover_a, cover_b);
    int n_surface = 0;
    for (int i = 0; in_a && in_b && i < 512; ++i) {
        const openvdb::Coord leaf = block.offsetBy(i / 64 * 8, i / 8 % 8 * 8, i % 8 * 8);
        EXPECT_EQ(in_a->cover(leaf), in_b->cover(leaf));
        if (in_a->cover(leaf) != Cover::surface)
            continue;
        std::vector<float> values_a(512), values_b(512);
        in_a->values(leaf, values_a.data());
        in_b->values(leaf, values_b.data());
        EXPECT_EQ(values_a, values_b);
        ++n_surface;
    }
    return n_surface;
}

TEST(DifferenceField, ABlockAloneEqualsTheSameBlockOfTheWhole) {
    std::vector<Sphere> holes;
    for (std::uint64_t i = 0; i < 2000; ++i) {
        const Rng rng{2, 2};
        holes.push_back(
            {{2 * rng.uniform(i, 0) - 1, 2 * rng.uniform(i, 1) - 1, 2 * rng.uniform(i, 2) - 1},
             0.15 * rng.uniform(i, 3)});
    }
    const DifferenceField field(std::make_shared<BallsField>(std::array<Sphere, 1>{{{{}, 1}}}),
                                std::make_shared<BallsField>(holes));
    const Lattice lattice{0.01, {}, 3};
    const auto whole = field.on(lattice, openvdb::CoordBBox::inf());
    for (const openvdb::Coord block : {openvdb::Coord(0), {64, -64, 0}, {-128, 0, 64}}) {
        const auto alone = field.on(lattice, openvdb::CoordBBox::createCube(block, 64));
        EXPECT_GT(expect_same_block(*whole, *alone, block), 10);
        // A region that only touches the block opens all of it.
        const auto touched = field.on(lattice, openvdb::CoordBBox::createCube(block, 1));
        EXPECT_GT(expect_same_block(*whole, *touched, block), 10);
    }
}

TEST(BallsField, BallsFarApartAreFoundAllTheSame) {
    // Blocks of 64^3 would be 3e9 here.
    const Sphere near{{10, 20, 30}, 5}, far{{90000, 90000, 90000}, 700};
    const BallsField both(std::array<Sphere, 2>{near, far});
    const Lattice lattice{1, {}, 3};
    const auto all = both.on(lattice, openvdb::CoordBBox::inf());
    const BallsField only_near(std::array<Sphere, 1>{near}), only_far(std::array<Sphere, 1>{far});
    EXPECT_GT(expect_same_block(*all, *only_near.on(lattice, openvdb::CoordBBox::inf()),
                                openvdb::Coord(0)),
              3);
    EXPECT_GT(expect_same_block(*all, *only_far.on(lattice, openvdb::CoordBBox::inf()),
                                openvdb::Coord(89984, 89984, 90688)),
              50);
}

TEST(LevelSetField, GivesItsOwnGridBack) {
    const auto grid = ball_rock();
    EXPECT_EQ(grid_hash(*rasterize(LevelSetField(grid), lattice_of(*grid))), grid_hash(*grid));
}

TEST(LevelSetField, BandsStayBandsAtAnyVoxelSize) {
    for (const double voxel : {0.037, 0.041, 0.053, 1.1 / 160}) {
        const auto grid = ball_rock(1, voxel);
        const auto again = rasterize(LevelSetField(grid), lattice_of(*grid));
        EXPECT_EQ(again->activeVoxelCount(), grid->activeVoxelCount()) << voxel;
        for (auto it = grid->cbeginValueOn(); it;
             ++it) // to voxels and back: the last bit of a float
            ASSERT_NEAR(again->tree().getValue(it.getCoord()), *it, 1e-6 * voxel);
    }
}

TEST(LatticeOf, RefusesTurnedMirroredAndUnevenVoxels) {
    for (const openvdb::Vec3d& scale :
         {openvdb::Vec3d(1e-4, 1e-4, 1.004e-4), openvdb::Vec3d(1e-4, -1e-4, 1e-4)}) {
        const auto grid = ball_rock();
        grid->setTransform(openvdb::math::Transform::Ptr(new openvdb::math::Transform(
            openvdb::math::MapBase::Ptr(new openvdb::math::ScaleMap(scale)))));
        expect_error(Fault::bad_argument, "not upright cubes", [&] { lattice_of(*grid); });
    }
    const auto turned = ball_rock();
    turned->transform().preRotate(0.3, openvdb::math::X_AXIS);
    expect_error(Fault::bad_argument, "not upright cubes", [&] { lattice_of(*turned); });
}

TEST(LevelSetField, RefusesAnotherLattice) {
    const auto grid = ball_rock();
    const LevelSetField field(grid);
    expect_error(Fault::bad_argument, "sampled at 0.05", [&] { rasterize(field, {0.04, {}, 3}); });
}

TEST(LatticeOf, NamesAGridThatIsNoLevelSet) {
    auto fog = openvdb::FloatGrid::create(0);
    fog->setName("density");
    expect_error(Fault::bad_argument, "grid 'density': not a level set", [&] { lattice_of(*fog); });
}

} // namespace
} // namespace taihu
