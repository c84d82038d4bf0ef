#include "tests/support/mutate.h"

#include <array>
#include <set>

#include <gtest/gtest.h>

namespace taihu {
namespace {

// A text, and bytes with a length before them.
const std::string kBases[] = {"v 0 0 0\nv 1 0.5 0\nv 0 1 -2e3\nf 1 2 3\n",
                              std::string(3, 0) + "\x05" + "binary\xff" + std::string(2, 0)};

TEST(Mutate, GivesTheSameBytesForTheSameNumbers) {
    for (std::uint64_t item = 0; item < 500; ++item)
        EXPECT_EQ(mutate(kBases, 3, item).bytes, mutate(kBases, 3, item).bytes) << item;
    std::set<std::string> different;
    for (std::uint64_t item = 0; item < 500; ++item)
        different.insert(mutate(kBases, 3, item).bytes);
    EXPECT_GT(different.size(), 300u); // what is cut to nothing or barely changed may repeat
    EXPECT_NE(mutate(kBases, 3, 17).bytes, mutate(kBases, 4, 17).bytes);
}

TEST(Mutate, EveryDamageOccursAloneAndChangesSomething) {
    std::array<int, kDamages> n_alone{}, n_changed{};
    for (std::uint64_t item = 0; item < 2000; ++item) {
        const Mutant mutant = mutate(kBases, 1, item);
        ASSERT_GE(mutant.damages.size(), 1u);
        ASSERT_LE(mutant.damages.size(), 8u);
        if (mutant.damages.size() > 1)
            continue;
        const auto which = static_cast<std::size_t>(mutant.damages.front());
        ++n_alone[which];
        n_changed[which] += mutant.bytes != kBases[0] && mutant.bytes != kBases[1];
    }
    for (std::size_t i = 0; i < kDamages; ++i) {
        // 1000 of the 2000 have one damage: 83 of each kind, give or take 9; five of these.
        EXPECT_NEAR(n_alone[i], 83, 45) << i;
        EXPECT_GT(n_changed[i], n_alone[i] / 3) << i;
    }
}

TEST(Mutate, FilesStayOfASizeThatCanBeRead) {
    const std::string base(10'000, 'x');
    for (std::uint64_t item = 0; item < 500; ++item)
        EXPECT_LE(mutate(std::span(&base, 1), 9, item).bytes.size(), 20'000u + (64 << 10));
}

} // namespace
} // namespace taihu
