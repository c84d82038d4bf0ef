#include "vdb_ops/offset_field.h"

#include <limits>
#include <numbers>

#include "tests/support/errors.h"
#include "tests/support/fields.h"
#include "tests/support/grids.h"
#include "vdb_ops/combine_field.h"
#include "vdb_ops/shapes.h"
#include "vdb_ops/solids_field.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;

const Lattice kLattice{0.05, {0.01, -0.02, 0.003}, 3};
const CoordBBox kBox(Coord(-25), Coord(25));
const AnalyticSolid kBrick{BoxSolid{{0.5, 0.3, 0.4}}, Similarity::rotation({1, 2, 3}, 0.7)};

std::shared_ptr<const Field> brick() {
    return std::make_shared<SolidsField>(std::vector{kBrick});
}

double volume(const Field& field) {
    return volume_m3(*rasterize(field, {1.0 / 64, {}, 3}));
}

TEST(OffsetField, IsTheShiftedDistanceAtEveryVoxel) {
    for (const double by : {0.3, 0.01, 0.0, -0.05, -0.2}) {
        SCOPED_TRACE(by);
        expect_distances(
            OffsetField(brick(), by), kLattice, kBox,
            [&](const Vec3& p) { return distance_m(kBrick, p) - by; },
            2e-6); // floats below the wide band of 9 voxels
    }
}

TEST(OffsetField, GrowsAndShrinksToKnownSolids) {
    constexpr double kPi = std::numbers::pi;
    // Steiner: V + A r + (sum of edges) pi r^2 / 4 + 4/3 pi r^3.
    const Vec3 s{1, 0.6, 0.8};
    const double r = 0.15, area = 2 * (s.x * s.y + s.y * s.z + s.z * s.x);
    const double grown =
        s.x * s.y * s.z + area * r + kPi * r * r * (s.x + s.y + s.z) + 4.0 / 3 * kPi * r * r * r;
    EXPECT_NEAR(volume(OffsetField(brick(), r)), grown, 1e-3 * grown);
    const double shrunk = (s.x - 2 * r) * (s.y - 2 * r) * (s.z - 2 * r);
    EXPECT_NEAR(volume(OffsetField(brick(), -r)), shrunk, 5e-3 * shrunk); // its edges
    EXPECT_EQ(rasterize(OffsetField(brick(), -0.5), kLattice)->activeVoxelCount(), 0u);
}

TEST(ShellField, IsAWallOfItsThickness) {
    const auto ball =
        std::make_shared<SolidsField>(std::vector<AnalyticSolid>{{BallSolid{0.8}, {}}});
    expect_distances(
        ShellField(ball, 0.2, 0.1), kLattice, kBox,
        [](const Vec3& p) {
            const double d = length(p) - 0.8;
            return std::max(d - 0.1, -0.2 - d);
        },
        2e-6);
    const auto of_radius = [](double r) { return 4.0 / 3 * std::numbers::pi * r * r * r; };
    EXPECT_NEAR(volume(ShellField(ball, 0.1, 0)), of_radius(0.8) - of_radius(0.7), 1e-3);
    EXPECT_NEAR(volume(ShellField(ball, 0.05, 0.05)), of_radius(0.85) - of_radius(0.75), 1e-3);
    const double in = rasterize(ShellField(ball, 0.1, 0), {1.0 / 64, {}, 3})->tree().getValue({});
    EXPECT_GT(in, 0) << "the middle of a shell is outside";
}

TEST(ComplementField, TurnsTheSidesRound) {
    const ComplementField outside(brick());
    expect_distances(
        outside, kLattice, kBox, [](const Vec3& p) { return -distance_m(kBrick, p); }, 1e-6);
    expect_error(Fault::bad_argument, "beyond voxel 2^30", [&] { rasterize(outside, kLattice); });
    const auto twice =
        std::make_shared<ComplementField>(std::make_shared<ComplementField>(brick()));
    const auto large =
        std::make_shared<SolidsField>(std::vector<AnalyticSolid>{{BallSolid{2}, {}}});
    EXPECT_EQ(grid_hash(*rasterize(CombineField(Combine::intersect, {large, twice}), kLattice)),
              grid_hash(*rasterize(*brick(), kLattice)));
}

TEST(OffsetFields, AreLipschitzAndRandomAccess) {
    const std::shared_ptr<const Field> rock = shape_field({.subdivisions = 3});
    const auto cut = std::make_shared<CombineField>(
        Combine::subtract, std::vector<std::shared_ptr<const Field>>{rock, brick()}, 0.1);
    for (const std::shared_ptr<const Field>& f :
         {std::shared_ptr<const Field>(std::make_shared<OffsetField>(cut, 0.1)),
          std::shared_ptr<const Field>(std::make_shared<OffsetField>(rock, -0.1)),
          std::shared_ptr<const Field>(std::make_shared<ShellField>(cut, 0.1, 0))}) {
        EXPECT_LE(steepest(sample(*f, {0.03, {}, 3}, kBox)), 1 + 1e-4); // floats of a mesh
        expect_blocks_equal_the_whole(*f, {0.03, {}, 3});
    }
}

TEST(OffsetFields, RefuseWhatIsNone) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    expect_error(Fault::bad_argument, "offset: the field is null", [] { OffsetField(nullptr, 1); });
    expect_error(Fault::bad_argument, "complement: the field is null",
                 [] { ComplementField{nullptr}; });
    expect_error(Fault::bad_argument, "offset: the distance is nan",
                 [&] { OffsetField(brick(), nan); });
    expect_error(Fault::bad_argument, "shell: the distance is -1",
                 [] { ShellField(brick(), -1, 2); });
    expect_error(Fault::bad_argument, "no thickness", [] { ShellField(brick(), 0, 0); });
    expect_error(Fault::bad_argument, "2000 voxels, must be at most 1000",
                 [] { rasterize(OffsetField(brick(), 100), kLattice); });
}

} // namespace
} // namespace taihu
