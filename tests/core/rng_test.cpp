#include "stats/core/rng.h"

#include <cmath>

#include <gtest/gtest.h>

namespace taihu {
namespace {

// Known-answer vectors that Random123 publishes for Philox4x32-10 (kat_vectors).
TEST(Rng, IsPhilox4x32With10Rounds) {
    const auto zero = Rng{}.words(0);
    EXPECT_EQ(zero, (std::array<std::uint32_t, 4>{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
    const auto ones = Rng{~0ull, ~0u}.words(~0ull, ~0u);
    EXPECT_EQ(ones, (std::array<std::uint32_t, 4>{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
}

TEST(Rng, UniformHasTheMomentsOfTheUnitInterval) {
    constexpr int kN = 100'000;
    double sum = 0, squares = 0;
    for (int i = 0; i < kN; ++i) {
        const double u = Rng{7, 1}.uniform(static_cast<std::uint64_t>(i));
        ASSERT_GT(u, 0);
        ASSERT_LT(u, 1);
        sum += u;
        squares += u * u;
    }
    // Four standard errors: sd of u is 0.2887, of u^2 0.2981.
    EXPECT_NEAR(sum / kN, 0.5, 4 * 0.2887 / std::sqrt(kN));
    EXPECT_NEAR(squares / kN, 1.0 / 3, 4 * 0.2981 / std::sqrt(kN));
}

TEST(Rng, EachPartOfTheAddressChangesTheNumber) {
    const double u = Rng{1, 2}.uniform(3, 4);
    EXPECT_NE(u, (Rng{2, 2}.uniform(3, 4)));
    EXPECT_NE(u, (Rng{1, 3}.uniform(3, 4)));
    EXPECT_NE(u, (Rng{1, 2}.uniform(4, 4)));
    EXPECT_NE(u, (Rng{1, 2}.uniform(3, 5)));
    EXPECT_EQ(u, (Rng{1, 2}.uniform(3, 4)));
}

} // namespace
} // namespace taihu
