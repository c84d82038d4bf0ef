#include "stats/number_detail.h"

#include <gtest/gtest.h>

namespace taihu {
namespace {

TEST(Rounded, IsPlainForPeople) {
    EXPECT_EQ(rounded(2479.4), "2480");
    EXPECT_EQ(rounded(0.0123456), "0.0123");
    EXPECT_EQ(rounded(-0.5), "-0.5");
    EXPECT_EQ(rounded(2), "2");
    EXPECT_EQ(rounded(0), "0");
    EXPECT_EQ(rounded(999.6), "1000");
    EXPECT_EQ(rounded(99.96), "100");
    EXPECT_EQ(rounded(123456789, 4), "123500000");
    EXPECT_EQ(rounded(1.5e-7), "1.50e-07");
    EXPECT_EQ(rounded(0.26, 1), "0.3");
}

} // namespace
} // namespace taihu
