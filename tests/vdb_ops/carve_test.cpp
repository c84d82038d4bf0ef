#include "vdb_ops/carve.h"

#include <numbers>

#include <tbb/global_control.h>

#include "stats/core/rng.h"
#include "tests/support/errors.h"
#include "tests/support/grids.h"

namespace taihu {
namespace {

const std::vector<Sphere> kDisjoint = {{{0.4, 0, 0}, 0.2}, {{-0.4, 0, 0}, 0.2}, {{0, 0.5, 0}, 0.1}};

std::vector<Sphere> random_holes(std::size_t n) {
    std::vector<Sphere> holes;
    for (std::size_t i = 0; i < n; ++i) {
        const Rng rng{11, 1};
        holes.push_back({{2.4 * rng.uniform(i, 0) - 1.2, 2.4 * rng.uniform(i, 1) - 1.2,
                          2.4 * rng.uniform(i, 2) - 1.2},
                         0.02 + 0.2 * rng.uniform(i, 3)});
    }
    return holes;
}

CarvedVolume volume_carved(const openvdb::FloatGrid& base, std::span<const Sphere> holes) {
    return carved_volume(base, *carve(base, holes).rock);
}

TEST(Carve, RemovesTheVolumeOfDisjointHoles) {
    double expected_m3 = 0;
    for (const Sphere& h : kDisjoint)
        expected_m3 += 4.0 / 3 * std::numbers::pi * std::pow(h.radius_m, 3);
    const CarvedVolume result = volume_carved(*ball_rock(1, 0.01), kDisjoint);
    // volume_m3(): below 0.05 (voxel / r)^2 of each hole, 5e-4 of the smallest.
    EXPECT_NEAR(result.removed_m3, expected_m3, 3e-4 * expected_m3);
    EXPECT_NEAR(result.base_m3, 4.0 / 3 * std::numbers::pi, 1e-5 * 4.19);
}

TEST(Carve, SphereMinusSphereHasItsAnalyticVolume) {
    // A unit ball minus a ball of radius 1/2 centred on its surface: the lens of two spherical
    // caps.
    const double r = 0.5, d = 1;
    const double lens = std::numbers::pi * std::pow(1 + r - d, 2) *
                        (d * d + 2 * d * r - 3 * r * r + 2 * d + 6 * r - 3) / (12 * d);
    const double removed =
        volume_carved(*ball_rock(1, 0.01), std::vector<Sphere>{{{0, 0, 1}, r}}).removed_m3;
    EXPECT_NEAR(removed, lens, 2e-3 * lens); // the rim is resolved to a fraction of a voxel only
}

TEST(Carve, IsTheMaximumOfRockAndHolesAtEveryVoxel) {
    const auto rock = ball_rock(1, 0.04);
    const std::vector<Sphere> holes = random_holes(60);
    const auto carved = carve(*rock, holes).rock;
    const auto accessor = carved->getConstAccessor();
    for (int i = -28; i <= 28; ++i)
        for (int j = -28; j <= 28; ++j)
            for (int k = -28; k <= 28; ++k) {
                const Vec3 p{i * 0.04, j * 0.04, k * 0.04};
                double exact = length(p) - 1;
                for (const Sphere& h : holes)
                    exact = std::max(exact, h.radius_m - length(p - h.center));
                // Float on tens of voxels of 4 cm.
                ASSERT_NEAR(accessor.getValue(openvdb::Coord(i, j, k)),
                            std::clamp(exact, -0.12, 0.12), 2e-6);
            }
}

TEST(Carve, LeavesThatNoHoleReachesAreTheBasesOwn) {
    const auto rock = ball_rock(1, 0.037); // a voxel that floats do not hold
    const auto carved = carve(*rock, std::vector<Sphere>{{{0, 0, 1}, 0.3}}).rock;
    int n_leaves = 0;
    for (auto leaf = rock->tree().cbeginLeaf(); leaf; ++leaf) {
        if (leaf->origin().z() >= 0)
            continue;
        const auto* same = carved->tree().probeConstLeaf(leaf->origin());
        ASSERT_TRUE(same && same->buffer() == leaf->buffer() &&
                    same->valueMask() == leaf->valueMask());
        ++n_leaves;
    }
    EXPECT_GT(n_leaves, 100);
}

TEST(Carve, LargeHolesFarFromTheOriginAreExact) {
    const Vec3 far{30000.013, -20000.021, 10000.007};
    constexpr double kVoxel = 0.05;
    const auto base = rasterize(BallsField(std::array<Sphere, 1>{{{far, 1}}}), {kVoxel, {}, 3});
    for (const double r : {5.0, 102.0, 103.0, 5000.0}) { // floats up to 2048 voxels, then doubles
        const Sphere hole{far + Vec3{0.6, 0.8, 0} * r, r};
        const auto rock = carve(*base, std::vector<Sphere>{hole}).rock;
        int n_hole = 0;
        for (auto it = rock->cbeginValueOn(); it; ++it) {
            const openvdb::Coord c = it.getCoord();
            const Vec3 p = Vec3{double(c.x()), double(c.y()), double(c.z())} * kVoxel;
            const double of_base = length(p - far) - 1, of_hole = r - length(p - hole.center);
            ASSERT_NEAR(*it, std::max(of_base, of_hole), 1e-3 * kVoxel) << r;
            n_hole += of_hole > of_base;
        }
        EXPECT_GT(n_hole, 1000) << r;
    }
}

TEST(Carve, OrderOfTheHolesChangesNoBit) {
    const auto rock = ball_rock(1, 0.03);
    std::vector<Sphere> holes = random_holes(3000);
    holes.insert(holes.end(), holes.begin(), holes.begin() + 50); // the same again
    holes.push_back({{0, -100, 0}, 99.2});                        // 3307 voxels
    const std::string forward = grid_hash(*carve(*rock, holes).rock);
    std::reverse(holes.begin(), holes.end());
    EXPECT_EQ(grid_hash(*carve(*rock, holes).rock), forward);
    const auto key = [](const Sphere& s) { return std::fmod(1e6 * s.center.x, 1); };
    std::stable_sort(holes.begin(), holes.end(),
                     [&](const Sphere& a, const Sphere& b) { return key(a) < key(b); });
    EXPECT_EQ(grid_hash(*carve(*rock, holes).rock), forward);
}

TEST(Carve, IsBitIdenticalOnAnyNumberOfThreads) {
    const auto rock = ball_rock(1, 0.02);
    const std::vector<Sphere> holes = random_holes(3000);
    const std::string usual = grid_hash(*carve(*rock, holes).rock);
    for (const std::size_t n : {1, 3, 16}) {
        const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, n);
        EXPECT_EQ(grid_hash(*carve(*rock, holes).rock), usual) << n;
    }
}

TEST(Carve, AnotherHoleNeverAddsVolume) {
    const auto rock = ball_rock(1, 0.04);
    const std::vector<Sphere> holes = random_holes(12);
    double removed = 0;
    for (std::size_t n = 1; n <= holes.size(); ++n) {
        const double now = volume_carved(*rock, std::span(holes).first(n)).removed_m3;
        EXPECT_GE(now, removed - 1e-12);
        removed = now;
    }
}

TEST(Carve, HolesThatCoverTheRockLeaveNothing) {
    const auto base = ball_rock();
    const auto rock = carve(*base, std::vector<Sphere>{{{0.1, 0, 0}, 2}}).rock;
    EXPECT_EQ(rock->tree().leafCount(), 0u);
    EXPECT_EQ(carved_volume(*base, *rock).porosity(), 1);
}

TEST(Carve, HolesFarAwayOrHugeAreHandled) {
    const auto rock = ball_rock();
    EXPECT_EQ(grid_hash(*carve(*rock, std::vector<Sphere>{{{1e6, 0, 0}, 1}}).rock),
              grid_hash(*rock));
    // A ball of 500 m through the middle: nearly half of the rock goes (lens of two caps).
    // Float holds 1e4 voxels to 1e-3 of one.
    const double half = volume_carved(*rock, std::vector<Sphere>{{{500, 0, 0}, 500}}).removed_m3;
    EXPECT_NEAR(half, std::numbers::pi * 3997 / 6000, 1e-3);
}

TEST(Carve, AHoleAsLargeAsAPlanetCutsFlat) {
    for (const double r : {1e4, 1e6, 1e8}) // in voxels 20 times that
        EXPECT_NEAR(volume_carved(*ball_rock(), std::vector<Sphere>{{{0, -r, 0}, r}}).porosity(),
                    0.5, 1e-3)
            << r;
}

TEST(Carve, ManyHolesThatReachEverywhereFitInMemory) {
    std::vector<Sphere> holes;
    for (int i = 0; i < 300; ++i)
        holes.push_back({{0, -1e6 - 1e-3 * i, 0}, 1e6});
    EXPECT_NEAR(volume_carved(*ball_rock(), holes).porosity(), 0.5, 1e-3);
}

TEST(Carve, CountsHolesThatTheVoxelDoesNotResolve) {
    const auto result = carve(*ball_rock(), std::vector<Sphere>{{{0.5, 0, 0}, 0.07}, {{}, 0.08}});
    EXPECT_EQ(result.n_unresolved, 1u); // 1.5 voxels are 0.075 m
}

TEST(Carve, NamesTheHoleWithANegativeRadius) {
    const std::vector<Sphere> bad = {{{0, 0, 0}, 0.1}, {{0, 0, 0}, -0.02}};
    expect_error(Fault::bad_argument, "holes[1].radius_m", [&] { carve(*ball_rock(), bad); });
}

class Cancelled final : public Progress {
    void stage(std::string_view) override {}
    void fraction(double) override {}
    bool cancelled() const override { return true; }
};

TEST(Carve, StopsWhenItIsTold) {
    Cancelled progress;
    expect_error(Fault::cancelled, "cancelled", [&] { carve(*ball_rock(), kDisjoint, &progress); });
}

} // namespace
} // namespace taihu
