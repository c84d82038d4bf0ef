#include "vdb_ops/weather.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/support/errors.h"
#include "tests/support/fields.h"
#include "tests/support/grids.h"
#include "tests/support/level_sets.h"
#include "vdb_ops/band_detail.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/solids_field.h"

namespace taihu {
namespace {

double radius_of(double volume_m3) {
    return std::cbrt(volume_m3 * 3 / (4 * std::numbers::pi));
}

TEST(Weather, ABallShrinksAsMeanCurvatureFlowSays) {
    constexpr double kRadius = 0.5, kSigma = 0.045;
    const auto ball = ball_grid(kRadius, 0.02);
    for (const int steps : {1, 4}) {
        const WeatherResult r =
            weather(*ball, {.sigma_m = kSigma, .steps = steps, .durability = {}});
        const double expected =
            kRadius - std::sqrt(kRadius * kRadius - 2 * kSigma * kSigma * steps);
        // Distances are first order away from the surface; the blur sees them out to 4 sigma.
        EXPECT_NEAR(kRadius - radius_of(r.volume_after_m3), expected, 0.15 * expected) << steps;
        EXPECT_NEAR(radius_of(r.volume_before_m3), kRadius, 0.001);
        EXPECT_NEAR(r.area_before_m2, std::numbers::pi, 0.02 * std::numbers::pi);
        EXPECT_LT(r.area_after_m2, r.area_before_m2);
    }
}

TEST(Weather, RoundsEdgesAndLeavesFacesWhereTheyAre) {
    const auto cube = rasterize(
        SolidsField(std::vector<AnalyticSolid>{{BoxSolid{{0.4, 0.4, 0.4}, 0}, {}}}), {0.02, {}, 3});
    const BandReader worn(weather(*cube, {.sigma_m = 0.025, .steps = 2, .durability = {}}).solid);
    EXPECT_NEAR(worn.at({0.4, 0, 0}), 0, 0.002); // a tenth of a voxel
    EXPECT_GT(worn.at({0.4, 0.4, 0}), 0.01);
    EXPECT_GT(worn.at({0.4, 0.4, 0.4}), worn.at({0.4, 0.4, 0}));
}

TEST(Weather, RoundingAndHollowingActOnTheirSideAlone) {
    const Sphere hole{{0.5, 0, 0}, 0.25};
    const auto holed = holed_ball_grid(0.5, 0.02, std::span(&hole, 1));
    const Vec3 bottom = hole.center - Vec3{0.25, 0, 0}, back{-0.5, 0, 0};
    const auto values = [&](double rounding, double hollowing) {
        const auto r = weather(*holed, {0.04, 4, rounding, hollowing, {}});
        const BandReader reader(r.solid);
        return std::pair{reader.at(bottom), reader.at(back)};
    };
    const auto [filled, worn] = values(1, -1);
    EXPECT_LT(filled, -0.01);
    EXPECT_GT(worn, 0.005);
    const auto [kept, rounded] = values(1, 0);
    EXPECT_NEAR(kept, 0, 0.002);
    EXPECT_GT(rounded, 0.005);
    const auto [deeper, whole] = values(0, 1);
    EXPECT_GT(deeper, 0.01);
    EXPECT_NEAR(whole, 0, 0.002);
}

TEST(Weather, SoftStoneWearsFasterThanDurableStone) {
    const auto ball = ball_grid(0.5, 0.02);
    WeatherSettings s{.sigma_m = 0.05, .steps = 6, .durability = {}};
    const auto spread = [&] {
        const BandReader reader(weather(*ball, s).solid);
        double least = 1, most = -1;
        for (std::uint64_t i = 0; i < 1000; ++i) {
            const double d = reader.at(normalized(random_vec(i)) * 0.5);
            least = std::min(least, d);
            most = std::max(most, d);
        }
        return most - least;
    };
    EXPECT_LT(spread(), 0.004);
    s.durability = Durability{1, {0.5, 0.5, 0.8, {0, 1, 0}, 1, 3}};
    EXPECT_GT(spread(), 0.02);
}

TEST(Weather, IsTheSameOnAnyNumberOfThreads) {
    const auto ball = ball_grid(0.5, 0.025);
    const WeatherSettings s{0.04, 2, 1, -0.5, Durability{0.5, {0.5, 0.1, 0.8, {0, 1, 0}, 1, 3}}};
    const auto many = weather(*ball, s);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const auto alone = weather(*ball, s);
    EXPECT_EQ(grid_hash(*alone.solid), grid_hash(*many.solid));
    EXPECT_EQ(alone.area_after_m2, many.area_after_m2);
    EXPECT_EQ(alone.volume_after_m3, many.volume_after_m3);
}

TEST(Weather, SaysWhenNothingIsLeftAndRefusesWhatIsOutOfRange) {
    const auto ball = ball_grid(0.2, 0.02);
    const auto refused = [&](Fault fault, const WeatherSettings& s, const char* what) {
        expect_error(fault, what, [&] { weather(*ball, s); });
    };
    refused(Fault::bad_input, {0.1, 100, 1, -1, {}}, "weather: nothing is left after step");
    refused(Fault::bad_argument, {0, 1, 1, -1, {}}, "weather: sigma_m is 0, must be 1e-9..1e5");
    refused(Fault::bad_argument, {0.1, 0, 1, -1, {}}, "weather: steps is 0, must be 1..1000");
    refused(Fault::bad_argument, {0.1, 1, 2, -1, {}}, "weather: rounding is 2, must be 0..1");
    refused(Fault::bad_argument, {0.1, 1, 1, -2, {}}, "weather: hollowing is -2, must be -1..1");
    refused(Fault::bad_argument, {5, 1, 1, -1, {}}, "weather: sigma_m in voxels is 250");
    refused(Fault::bad_argument, {0.1, 1, 1, -1, Durability{3, {}}},
            "weather: durability.contrast is 3");
}

} // namespace
} // namespace taihu
