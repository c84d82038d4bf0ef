#include "vdb_ops/solids_field.h"

#include <numbers>

#include <tbb/global_control.h>

#include "tests/support/errors.h"
#include "tests/support/fields.h"
#include "tests/support/grids.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;

PrimitiveSolid shape(std::uint64_t i, double r) {
    switch (i % 7) {
    case 0:
        return BallSolid{r};
    case 1:
        return EllipsoidSolid{{r, 0.4 * r, 0.7 * r}};
    case 2:
        return BoxSolid{{r, 0.5 * r, 0.6 * r}, 0.1 * r};
    case 3:
        return CylinderSolid{0.6 * r, r, 0.2 * r};
    case 4:
        return ConeSolid{0.8 * r, 0.1 * r, r};
    case 5:
        return CapsuleSolid{0.4 * r, r};
    default:
        return TorusSolid{r, 0.4 * r};
    }
}

std::vector<AnalyticSolid> many(std::uint64_t n, double r = 0.12) {
    std::vector<AnalyticSolid> solids;
    for (std::uint64_t i = 0; i < n; ++i)
        solids.push_back({shape(i, r * (0.3 + random_number(i, 10))),
                          Similarity::translation(random_vec(i)) *
                              Similarity::rotation(random_vec(i, 3), 6 * random_number(i, 6))});
    return solids;
}

double union_m(const std::vector<AnalyticSolid>& solids, const Vec3& p) {
    double d = 1e300;
    for (const AnalyticSolid& s : solids)
        d = std::min(d, distance_m(s, p));
    return d;
}

const Lattice kLattice{0.05, {0.01, -0.02, 0.003}, 3};
const CoordBBox kBox(Coord(-24), Coord(24));

TEST(SolidsField, IsTheClampedDistanceAtEveryVoxel) {
    const auto solids = many(24);
    expect_distances(
        SolidsField(solids), kLattice, kBox, [&](const Vec3& p) { return union_m(solids, p); },
        1e-6); // floats below 3
}

TEST(SolidsField, IsRightForWideBandsAndSolidsOfAllSizes) {
    auto solids = many(12, 0.02); // below a voxel
    solids.push_back({BallSolid{30}, Similarity::translation({31, 0.2, 0})});
    solids.push_back({CapsuleSolid{0.1, 40}, Similarity::rotation({1, 0, 0.2}, 0.6)});
    const Lattice wide{0.05, {}, 12};
    expect_distances(
        SolidsField(solids), wide, kBox, [&](const Vec3& p) { return union_m(solids, p); },
        1e-5); // floats below 12
}

TEST(SolidsField, IsOneLipschitz) {
    EXPECT_LE(steepest(sample(SolidsField(many(60)), kLattice, kBox)), 1 + 1e-6);
}

TEST(SolidsField, BlocksAloneEqualTheWhole) {
    expect_blocks_equal_the_whole(SolidsField(many(60)), {0.012, {}, 3});
}

TEST(SolidsField, OrderAndThreadsChangeNoBit) {
    auto solids = many(200);
    const auto hash = [&] { return grid_hash(*rasterize(SolidsField(solids), {0.02, {}, 3})); };
    const std::string forward = hash();
    std::reverse(solids.begin(), solids.end());
    EXPECT_EQ(hash(), forward);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(hash(), forward);
}

TEST(SolidsField, OfBallsIsABallsField) {
    std::vector<AnalyticSolid> solids;
    std::vector<Sphere> balls;
    for (std::uint64_t i = 0; i < 300; ++i) {
        balls.push_back({random_vec(i), 0.02 + 0.1 * random_number(i, 5)});
        solids.push_back(
            {BallSolid{balls.back().radius_m}, Similarity::translation(balls.back().center)});
    }
    const DenseField a = sample(SolidsField(solids), kLattice, kBox);
    const DenseField b = sample(BallsField(balls), kLattice, kBox);
    for (std::size_t i = 0; i < a.values.size(); ++i)
        ASSERT_NEAR(a.values[i], b.values[i], 1e-5); // floats of coordinates up to 64
}

TEST(SolidsField, VolumesAreTheKnownOnes) {
    constexpr double kPi = std::numbers::pi;
    const std::pair<PrimitiveSolid, double> known[] = {
        {EllipsoidSolid{{0.5, 0.3, 0.4}}, 4.0 / 3 * kPi * 0.5 * 0.3 * 0.4},
        {BoxSolid{{0.5, 0.3, 0.4}}, 8 * 0.5 * 0.3 * 0.4},
        {CylinderSolid{0.4, 0.3}, kPi * 0.16 * 0.6},
        {ConeSolid{0.4, 0.2, 0.3}, kPi / 3 * 0.6 * (0.16 + 0.08 + 0.04)},
        {CapsuleSolid{0.2, 0.3}, kPi * 0.04 * 0.6 + 4.0 / 3 * kPi * 0.008},
        {TorusSolid{0.4, 0.1}, 2 * kPi * kPi * 0.4 * 0.01}};
    for (const auto& [solid, volume] : known) {
        const SolidsField field({{solid, Similarity::rotation({3, 1, 2}, 0.9)}});
        // Edges cost a fraction of a voxel squared along their length, 1/64 of the size here.
        EXPECT_NEAR(volume_m3(*rasterize(field, {1.0 / 64, {}, 3})), volume, 3e-3 * volume)
            << solid.index();
    }
}

TEST(SolidsField, EvaluatesNoLeafInsideOrFarAway) {
    const SolidsField ball({{BallSolid{1}, {}}, {BallSolid{0.2}, {}}}); // one within the other
    const Lattice lattice{0.02, {}, 3};
    const CoordBBox box(Coord(-64), Coord(63));
    const DenseField dense = sample(ball, lattice, box);
    each_voxel(box, lattice, [&](const Coord& c, const Vec3& p) {
        const double d = std::fabs(length(p) - 1) / lattice.voxel_m;
        // Two half diagonals of a leaf, 6.07 each, round the band.
        ASSERT_TRUE(d < 3 + 12.2 || !dense.evaluated[dense.index(c)]) << c;
    });
}

TEST(SolidsField, OfNothingIsEmpty) {
    const SolidsField none({});
    EXPECT_TRUE(none.on(kLattice, kBox)->bounds().empty());
    EXPECT_EQ(rasterize(none, kLattice)->activeVoxelCount(), 0u);
}

TEST(SolidsField, AHalfSpaceHasDistancesButNoBounds) {
    const SolidsField half({{HalfSpaceSolid{}, Similarity::rotation({1, 0, 0}, 0.3)}});
    expect_distances(
        half, kLattice, kBox,
        [](const Vec3& p) { return p.y * std::cos(0.3) + p.z * std::sin(0.3); }, 1e-6);
    expect_error(Fault::bad_argument, "beyond voxel 2^30", [&] { rasterize(half, kLattice); });
}

TEST(SolidsField, FarAwayIsRefusedWhereItIsRasterizedNotBefore) {
    for (const double at : {1e9, -1e9, 1e30}) {
        const SolidsField far({{BallSolid{1}, Similarity::translation({0, at, 0})}});
        expect_error(Fault::bad_argument, "beyond voxel 2^30", [&] { rasterize(far, kLattice); });
        EXPECT_GT(sample(far, kLattice, CoordBBox(Coord(0), Coord(9))).at(Coord(3)), 0);
    }
    // One as large as all that can be: its surface passes here.
    const SolidsField huge({{BallSolid{4e7}, Similarity::translation({0, -4e7, 0})}});
    expect_distances(
        huge, kLattice, CoordBBox(Coord(-9), Coord(9)), [](const Vec3& p) { return p.y; },
        1e-5); // doubles of 8e8 voxels: 1e-7
}

TEST(SolidsField, NamesTheSolidThatIsNone) {
    auto solids = many(3);
    solids.push_back({BallSolid{0}, {}});
    expect_error(Fault::bad_argument, "solids[3].radius_m is 0", [&] { SolidsField{solids}; });
}

} // namespace
} // namespace taihu
