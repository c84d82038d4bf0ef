#include "stats/io/utf_detail.h"

#include <gtest/gtest.h>

namespace taihu {
namespace {

TEST(Utf, KnowsUtf8) {
    for (const char* text : {"", "a", "\xc3\xa9", "\xe7\x9b\xb4", "\xf0\x9f\xaa\xa8"})
        EXPECT_TRUE(is_utf8(text)) << text;
    // A tail alone, cut short, overlong (2, 3 and 4 bytes), a surrogate, above the last code point.
    for (const char* text : {"\x80", "\xe7\x9b", "\xc1\x81", "\xe0\x81\x81", "\xf0\x81\x81\x81",
                             "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xff", "\xc3("})
        EXPECT_FALSE(is_utf8(text)) << text;
}

TEST(Utf, ConvertsUtf16) {
    using namespace std::string_view_literals;
    EXPECT_EQ(utf8_from_utf16("a\0\xe9\0"sv, false), "a\xc3\xa9");
    EXPECT_EQ(utf8_from_utf16("\x76\xf4"sv, true), "\xe7\x9b\xb4");
    EXPECT_EQ(utf8_from_utf16("\xd8\x3e\xde\xa8"sv, true), "\xf0\x9f\xaa\xa8");
    EXPECT_EQ(utf8_from_utf16("", true), "");
    EXPECT_FALSE(utf8_from_utf16("abc", true));
    EXPECT_FALSE(utf8_from_utf16("\xd8\x3e"sv, true));         // the first half of a pair
    EXPECT_FALSE(utf8_from_utf16("\xd8\x3e\x00\x61"sv, true)); // and something else behind it
    EXPECT_FALSE(utf8_from_utf16("\xde\xa8"sv, true));         // the second half
}

} // namespace
} // namespace taihu
