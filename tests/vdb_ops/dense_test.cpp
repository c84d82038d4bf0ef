#include "vdb_ops/dense_detail.h"

#include "tests/support/dense.h"
#include "tests/support/errors.h"
#include "tests/support/grids.h"

namespace taihu {
namespace {

TEST(Dense, ALatticeHoldsItsBoxAndAMargin) {
    const auto ball = ball_rock(1, 0.05);
    const openvdb::CoordBBox box = inside_voxels(*ball, "test");
    EXPECT_EQ(box.max(), openvdb::Coord(19));
    const DenseLattice lattice = dense_lattice(*ball, box, 4.5, 1, "test");
    for (int a = 0; a < 3; ++a) {
        EXPECT_EQ(lattice.n[a], 39 + 1 + 2 * (3 + 5));
        EXPECT_NEAR(lattice.origin[a], -(19 + 8) * 0.05, 1e-12);
    }
    const auto values = dense_values(*ball, lattice, nullptr);
    EXPECT_FLOAT_EQ(values[lattice.at(27, 27, 27 + 18)], -2); // 18 voxels from the middle
    EXPECT_EQ(values[0], 3);                                  // the half width
}

TEST(Dense, EveryOtherVoxelIsTakenAsItIs) {
    const auto ball = ball_rock(1, 0.05);
    const DenseLattice lattice = dense_lattice(*ball, inside_voxels(*ball, "test"), 0, 2, "test");
    EXPECT_EQ(lattice.coarser, 2);
    EXPECT_NEAR(lattice.voxel_m, 0.1, 1e-12);
    const auto values = dense_values(*ball, lattice, nullptr);
    for (int z = 0; z < lattice.n[2]; ++z) {
        const double exact = (length(lattice.place(12, 12, z)) - 1) / 0.1;
        EXPECT_NEAR(values[lattice.at(12, 12, z)], std::clamp(exact, -1.5, 1.5), 1e-5);
    }
}

TEST(Dense, LargeBoxesTakeFewerVoxelsAndHugeOnesAreRefused) {
    const auto ball = ball_rock();
    const auto box = [](int n) { return openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(n)); };
    EXPECT_EQ(dense_lattice(*ball, box(300), 0, 1, "test").coarser, 1);
    EXPECT_EQ(dense_lattice(*ball, box(330), 0, 1, "test").coarser, 2);
    EXPECT_EQ(dense_lattice(*ball, box(5000), 0, 1, "test").coarser, 16);
    EXPECT_LE(dense_lattice(*ball, box(5000), 0, 1, "test").size(), std::size_t{1} << 25);
    expect_error(Fault::bad_input, "too many to measure even on every 16th",
                 [&] { dense_lattice(*ball, box(5200), 0, 1, "test"); });
}

TEST(Dense, BetweenSamplesItIsLinear) {
    DenseLattice lattice = cube_lattice(4);
    const auto linear = [](const Vec3& p) { return 0.3 * p.x - 0.2 * p.y + 0.1 * p.z - 0.4; };
    const auto values = sampled(lattice, linear);
    for (const Vec3& p : {Vec3{0.2, 1.7, 2.9}, Vec3{3, 3, 3}, Vec3{0, 0, 0}, Vec3{2.5, 0.1, 1}})
        EXPECT_NEAR(trilinear(lattice, values.data(), p), linear(p), 1e-6);
    EXPECT_NEAR(trilinear(lattice, values.data(), {-5, 1, 9}), linear({0, 1, 3}), 1e-6);
}

TEST(Dense, VoidsAreEnclosedWhereAPlaneShowsIt) {
    const DenseLattice lattice = cube_lattice(16);
    // A cube from 4 to 11 with a hole along z, and one with a groove along z.
    const auto marked = [&](double y_high) {
        const auto values = sampled(lattice, [&](const Vec3& p) {
            const bool cube = std::min({p.x, p.y, p.z}) > 3.5 && std::max({p.x, p.y, p.z}) < 11.5;
            const bool hole = std::abs(p.x - 7.5) < 1 && p.y > 6.5 && p.y < y_high;
            return cube && !hole ? -1 : 1;
        });
        const auto enclosed = enclosed_voids(lattice, values, nullptr);
        return std::count(enclosed.begin(), enclosed.end(), 1);
    };
    EXPECT_EQ(marked(8.5), 2 * 2 * 8); // planes across z surround it; those along it do not
    EXPECT_EQ(marked(20), 0);
}

} // namespace
} // namespace taihu
