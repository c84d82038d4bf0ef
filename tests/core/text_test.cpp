#include "stats/core/text.h"

#include <array>

#include <gmock/gmock.h>
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
    EXPECT_EQ(printable("\xc2\x9b"
                        "1m"),
              "\\xc2\\x9b1m");                      // what some terminals take for ESC [
    EXPECT_EQ(printable("\xc0\xaf"), "\\xc0\\xaf"); // a slash in two bytes too many
}

TEST(ErrorLine, IsShortAndKeepsTheCauseAndTheRemedy) {
    EXPECT_EQ(error_line("a.csv:3: x\ty; mend it"), "taihu: a.csv:3: x\\x09y; mend it");
    const std::string folder = "/" + std::string(4000, 'd');
    const std::string path = error_line(folder + "/a.csv:3: 'x' is nan; mend it");
    EXPECT_LE(path.size(), kMostErrorBytes);
    EXPECT_THAT(path, testing::StartsWith("taihu: /dddd"));
    EXPECT_THAT(path, testing::EndsWith("/a.csv:3: 'x' is nan; mend it"));
    std::string words = "a.csv: ";
    for (int i = 0; i < 500; ++i)
        words += "\xe7\x9b\xb4 ";
    const std::string line = error_line(words + "; drop the row");
    EXPECT_LE(line.size(), kMostErrorBytes);
    EXPECT_THAT(line, testing::EndsWith("; drop the row"));
    EXPECT_EQ(printable(line, line.size()), line); // no character is cut in two
}

TEST(DidYouMean, DoesNotCompareWhatIsNoName) {
    const std::string_view known[] = {"count"};
    EXPECT_EQ(did_you_mean(std::string(1'000'000, 'c'), known), "");
}

} // namespace
} // namespace taihu
