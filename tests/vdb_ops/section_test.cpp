#include "vdb_ops/section.h"

#include <cmath>
#include <numbers>

#include "stats/fit.h"
#include "tests/support/errors.h"
#include "tests/support/grids.h"
#include "vdb_ops/carve.h"
#include "vdb_ops/place.h"

namespace taihu {
namespace {

constexpr double kPi = std::numbers::pi;

SectionSettings planes(int n, std::optional<Vec3> direction = {}, std::uint64_t seed = 0) {
    return {n, direction, seed};
}

TEST(Section, ASphereIsCutInItsCircle) {
    const std::vector<Sphere> holes = {{{0.2, 0, 0.1}, 0.35}};
    const auto base = ball_rock(1, 0.02);
    const auto rock = carve(*base, holes).rock;
    const Section exact = section(*rock, {base.get(), holes}, planes(8, Vec3{0, 0, 2}));
    const Section seen = section(*rock, {base.get(), {}}, planes(8, Vec3{0, 0, 2}));
    ASSERT_EQ(exact.planes.size(), 8u);
    ASSERT_EQ(exact.profiles.size(), seen.profiles.size());
    ASSERT_GE(exact.profiles.size(), 2u);
    for (std::size_t i = 0; i < exact.profiles.size(); ++i) {
        const Profile &a = exact.profiles[i], &b = seen.profiles[i];
        const SectionPlane& plane = exact.planes[static_cast<std::size_t>(a.plane)];
        const double z = plane.origin.z - 0.1;
        EXPECT_NEAR(a.diameter_m, 2 * std::sqrt(0.35 * 0.35 - z * z), 1e-12);
        const Vec3 centre = plane.origin + plane.u * a.u_m + plane.v * a.v_m;
        EXPECT_NEAR(length(centre - Vec3{0.2, 0, plane.origin.z}), 0, 1e-12);
        // Pixels of 1 cm: of a circle's area, 0.3 * 1e-3 * sqrt(perimeter 2), of its diameter 1e-3;
        // and the voxels of 2 cm, 1e-3.
        EXPECT_EQ(a.plane, b.plane);
        EXPECT_NEAR(b.diameter_m, a.diameter_m, 0.004);
        EXPECT_NEAR(b.major_m, a.diameter_m, 0.008);
        EXPECT_NEAR(b.u_m, a.u_m, 0.004);
        EXPECT_NEAR(b.v_m, a.v_m, 0.004);
        EXPECT_FALSE(b.clipped);
    }
}

TEST(Section, AreaIsThatOfTheSolidsSection) {
    const auto ball = ball_rock(1, 0.05);
    const Section cut = section(*ball, {}, planes(10, Vec3{1, 1, 0}));
    double expected = 0;
    for (const SectionPlane& plane : cut.planes) {
        const double h = dot(plane.origin, plane.normal);
        EXPECT_NEAR(plane.area_m2, kPi * std::max(0.0, 1 - h * h), 0.005); // pixels of 2.5 cm
        expected += kPi * std::max(0.0, 1 - h * h);
    }
    EXPECT_NEAR(cut.area_m2, expected, 0.02);
    EXPECT_EQ(cut.profiles.size(), 0u);
    EXPECT_DOUBLE_EQ(cut.resolution_m, 0.1);
}

TEST(Section, RandomPlanesAreUniform) {
    // A plane that meets the unit ball has its distance uniform in 0..1, and a mean area 2 pi / 3.
    constexpr int kMany = 400;
    const Section cut = section(*ball_rock(1, 0.1), {}, planes(kMany));
    double h = 0, x2 = 0;
    for (const SectionPlane& plane : cut.planes) {
        h += std::abs(dot(plane.origin, plane.normal)) / kMany;
        x2 += plane.normal.x * plane.normal.x / kMany;
        EXPECT_NEAR(dot(cross(plane.u, plane.v), plane.normal), 1, 1e-12);
    }
    EXPECT_NEAR(h, 0.5, 4 * 0.29 / std::sqrt(kMany));
    EXPECT_NEAR(x2, 1.0 / 3, 4 * 0.3 / std::sqrt(kMany));
    EXPECT_NEAR(cut.area_m2 / kMany, 2 * kPi / 3, 4 * 0.94 / std::sqrt(kMany));
}

TEST(Section, WithoutTheBaseTheOutlineIsFilled) {
    const std::vector<Sphere> holes = {{{0.3, 0, 0}, 0.4}, {{-1, 0, 0}, 0.4}};
    const auto base = ball_rock(1, 0.025), rock = carve(*base, holes).rock;
    const SectionSettings one_near_the_middle = planes(1, Vec3{0, 1, 0}, 2);
    const Section cut = section(*rock, {}, one_near_the_middle);
    const double y = cut.planes[0].origin.y;
    ASSERT_LT(std::abs(y), 0.35);
    ASSERT_EQ(cut.profiles.size(), 1u); // the bite at the rim is air
    EXPECT_NEAR(cut.profiles[0].diameter_m, 2 * std::sqrt(0.16 - y * y), 0.01);
    const Section known = section(*rock, {base.get(), {}}, one_near_the_middle);
    ASSERT_EQ(known.profiles.size(), 2u);
    EXPECT_NE(known.profiles[0].clipped, known.profiles[1].clipped);
    EXPECT_GT(known.area_m2, cut.area_m2 + 0.1);
}

TEST(Section, SmallRegionsAreCountedAndLeftOut) {
    const std::vector<Sphere> holes = {{{0, 0, 0}, 0.3}, {{0.6, 0, 0}, 0.03}};
    const auto rock = carve(*ball_rock(1, 0.05), holes).rock;
    const Section cut = section(*rock, {}, planes(200, Vec3{0, 0, 1}));
    EXPECT_GT(cut.n_small, 0u);
    for (const Profile& p : cut.profiles)
        EXPECT_GE(p.diameter_m, cut.resolution_m);
}

TEST(Section, TheTableSaysPlanesAreaAndProfiles) {
    const std::vector<Sphere> holes = {{{0, 0, 0}, 0.5}};
    const Section cut = section(*ball_rock(), {nullptr, holes}, planes(2, Vec3{0, 0, 1}));
    const std::string text = format_profiles(cut);
    EXPECT_THAT(text, testing::StartsWith("# plane 0 through 0 0 -0."));
    EXPECT_THAT(text, testing::HasSubstr("\n# area_m2="));
    ASSERT_EQ(cut.profiles.size(), 1u);
    EXPECT_THAT(text, testing::HasSubstr("\nplane,u_m,v_m,diameter_m\n0,0,0,0.95"));
}

TEST(Section, IsAFunctionOfItsSeed) {
    const auto rock = ball_rock(1, 0.1);
    const auto text = [&](std::uint64_t seed) {
        return format_profiles(section(*rock, {}, planes(5, {}, seed)));
    };
    EXPECT_EQ(text(1), text(1));
    EXPECT_NE(text(1), text(2));
}

TEST(Section, RefusesByName) {
    const auto rock = ball_rock(1, 0.2);
    expect_error(Fault::bad_argument, "n_planes is 0", [&] { section(*rock, {}, planes(0)); });
    expect_error(Fault::bad_argument, "the direction is not finite or 0",
                 [&] { section(*rock, {}, planes(1, Vec3{})); });
    expect_error(Fault::bad_argument, "is empty; give a solid", [] {
        const auto empty = openvdb::createLevelSet<openvdb::FloatGrid>(0.1, 3);
        section(*empty);
    });
}

// Closed loop: holes of a known law in a ball, cut by a few planes, the law refitted. The rock is
// large and the holes many, so that hardly any is cut twice.
TEST(Section, ARefitFindsTheLawOfTheHoles) {
    constexpr double kRate = 12;
    constexpr int kRuns = 40;
    const auto ball = ball_rock(1, 0.1);
    int n_covered = 0, n_v_covered = 0;
    double rate = 0, n_v = 0, profiles = 0;
    for (std::uint64_t seed = 0; seed < kRuns; ++seed) {
        Placement placement;
        placement.density_m3 = 400;
        placement.seed = seed;
        const auto holes = place_holes(Law::exponential(kRate), placement, *ball).holes;
        const Section cut = section(*ball, {ball.get(), holes}, planes(2, {}, seed));
        Sample sample;
        sample.area = cut.area_m2;
        sample.detection_limit = 0;
        for (const Profile& p : cut.profiles)
            sample.diameters.push_back(p.diameter_m);
        const Fit fit = fit_law(sample, Family::exponential);
        n_covered += fit.intervals[0].lo <= kRate && kRate <= fit.intervals[0].hi;
        n_v_covered += fit.n_v->lo <= 400 && 400 <= fit.n_v->hi;
        rate += fit.law.parameters()[0] / kRuns;
        n_v += fit.n_v->estimate / kRuns;
        profiles += static_cast<double>(sample.diameters.size()) / kRuns;
    }
    // 92 % of 40 are 36.8; of 95 % with a binomial sd of 1.4, two below the mean of 38 are 35.
    EXPECT_GE(n_covered, 35);
    EXPECT_GE(n_v_covered, 35);
    // About 140 profiles a run: sd .79 / sqrt(140) = 6.7 % of the rate, 13 % of N_V; four of the
    // mean of 40 runs.
    EXPECT_GT(profiles, 100);
    EXPECT_NEAR(rate, kRate, 0.043 * kRate);
    EXPECT_NEAR(n_v, 400, 0.085 * 400);
}

} // namespace
} // namespace taihu
