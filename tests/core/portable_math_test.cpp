#include "stats/core/portable_math.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include <gtest/gtest.h>

#include "stats/core/rng.h"

namespace taihu {
namespace {

// Distance between two doubles of one sign in units of the last place.
std::int64_t ulps_apart(double a, double b) {
    return std::abs(std::bit_cast<std::int64_t>(a) - std::bit_cast<std::int64_t>(b));
}

// One unit: std::log itself is within one half of the truth, portable_log within one.
constexpr std::int64_t kUlps = 1;

TEST(PortableLog, AgreesWithTheLibraryOverAllMagnitudes) {
    std::int64_t worst = 0;
    for (std::uint64_t i = 0; i < 200'000; ++i) {
        // Random bits of a positive finite double, subnormal numbers included.
        const std::uint64_t bits = static_cast<std::uint64_t>(Rng{1, 1}.uniform(i) * 0x1p63);
        const double x = std::bit_cast<double>(std::min<std::uint64_t>(bits, 0x7fefffffffffffff));
        worst = std::max(worst, ulps_apart(portable_log(x), std::log(x)));
    }
    EXPECT_LE(worst, kUlps);
}

TEST(PortableLog, AgreesWithTheLibraryBetweenAHalfAndTwo) {
    std::int64_t worst = 0;
    for (std::uint64_t i = 0; i < 200'000; ++i) {
        const double x = 0.5 + 1.5 * Rng{2, 1}.uniform(i);
        worst = std::max(worst, ulps_apart(portable_log(x), std::log(x)));
    }
    EXPECT_LE(worst, kUlps);
}

TEST(PortableLog, AgreesWithTheLibraryAtBothEndsOfTheUnitInterval) {
    for (double u = 0x1p-53; u < 0.5; u *= 1.37) {
        EXPECT_LE(ulps_apart(portable_log(1 - u), std::log(1 - u)), kUlps) << u;
        EXPECT_LE(ulps_apart(portable_log(u), std::log(u)), kUlps) << u;
        EXPECT_LE(ulps_apart(portable_log(1 + u), std::log(1 + u)), kUlps) << u;
    }
}

TEST(PortableLog, IsExactWhereTheAnswerIs) {
    EXPECT_EQ(portable_log(1), 0);
    EXPECT_EQ(portable_log(0), -std::numeric_limits<double>::infinity());
    EXPECT_EQ(portable_log(std::numeric_limits<double>::infinity()),
              std::numeric_limits<double>::infinity());
    EXPECT_TRUE(std::isnan(portable_log(-1)));
    EXPECT_TRUE(std::isnan(portable_log(std::numeric_limits<double>::quiet_NaN())));
}

// The promise is the bits: these were rounded from 60 digits of ln 10, ln 0.1 and ln 2^-1074.
TEST(PortableLog, HasTheBitsOfTheRoundedTruth) {
    EXPECT_EQ(portable_log(10), 0x1.26bb1bbb55516p+1);
    EXPECT_EQ(portable_log(0.1), -0x1.26bb1bbb55515p+1);
    EXPECT_EQ(portable_log(std::numeric_limits<double>::denorm_min()), -0x1.74385446d71c3p+9);
}

TEST(PortableExp, AgreesWithTheLibraryWhereItIsFinite) {
    std::int64_t worst = 0;
    for (std::uint64_t i = 0; i < 200'000; ++i) {
        const double x = -708 + 1417 * Rng{3, 1}.uniform(i), y = 4 * Rng{4, 1}.uniform(i) - 3;
        worst = std::max({worst, ulps_apart(portable_exp(x), std::exp(x)),
                          ulps_apart(portable_exp(y), std::exp(y))});
    }
    EXPECT_LE(worst, 2); // below two of ours, half of one of the library's
}

TEST(PortableExp, IsExactWhereTheAnswerIs) {
    EXPECT_EQ(portable_exp(0), 1);
    EXPECT_EQ(portable_exp(1000), std::numeric_limits<double>::infinity());
    EXPECT_EQ(portable_exp(std::numeric_limits<double>::infinity()),
              std::numeric_limits<double>::infinity());
    EXPECT_EQ(portable_exp(-1000), 0);
    EXPECT_EQ(portable_exp(-std::numeric_limits<double>::infinity()), 0);
    EXPECT_TRUE(std::isnan(portable_exp(std::numeric_limits<double>::quiet_NaN())));
}

} // namespace
} // namespace taihu
