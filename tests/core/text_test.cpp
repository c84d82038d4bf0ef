#include "stats/core/text.h"

#include <array>

#include <gtest/gtest.h>

namespace taihu {
namespace {

TEST(ParseNumber, TakesWholeFiniteNumbersOnly) {
    EXPECT_EQ(parse_number("1.5"), 1.5);
    EXPECT_EQ(parse_number("+2e3"), 2000);
    EXPECT_EQ(parse_number("-0.25"), -0.25);
    for (const char* bad : {"", "1,5", "1.5x", " 1", "nan", "inf", "1e999", "+-1", "++1", "0x10"})
        EXPECT_FALSE(parse_number(bad)) << bad;
}

TEST(ParseInteger, RefusesWhatDoesNotFit) {
    EXPECT_EQ(parse_integer("-12"), -12);
    for (const char* bad : {"", "1.0", "99999999999999999999", "1 "})
        EXPECT_FALSE(parse_integer(bad)) << bad;
}

TEST(DidYouMean, NamesTheNearestOrNothing) {
    const std::array<std::string_view, 3> known = {"porosity", "density", "count"};
    EXPECT_EQ(did_you_mean("porosty", known), "; did you mean 'porosity'?");
    EXPECT_EQ(did_you_mean("cuont", known), "; did you mean 'count'?");
    EXPECT_EQ(did_you_mean("zzzzzz", known), "");
}

TEST(Printable, KeepsAMessageOnOneLine) {
    EXPECT_EQ(printable("a\nb\x1b"), "a\\x0ab\\x1b");
    EXPECT_EQ(printable("abcdef", 3), "abc...");
    EXPECT_EQ(printable("caf\xc3\xa9 \xe9 \xff"), "caf\xc3\xa9 \\xe9 \\xff");
}

} // namespace
} // namespace taihu
