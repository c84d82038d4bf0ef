#include "stats/io/table_detail.h"

#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stats/core/error.h"
#include "tests/support/errors.h"

namespace taihu {
namespace {

using testing::HasSubstr;

TEST(Table, ReadsCellsOfALooseFile) {
    const std::string text = "\xef\xbb\xbf# made by hand\r\n#unit = m\r\na, b ,c\r\n\r\n"
                             " 1,\"x, \"\"y\"\"\" ,3\r\n4,,\" \"";
    const Table table(text, "t.csv");
    EXPECT_THAT(table.header(), testing::ElementsAre("a", "b", "c"));
    ASSERT_EQ(table.n_rows(), 2u);
    EXPECT_EQ(table.cell(0, 1), "x, \"y\"");
    EXPECT_EQ(table.number(0, 2), 3);
    EXPECT_EQ(table.cell(1, 1), "");
    EXPECT_EQ(table.cell(1, 2), " ");
    EXPECT_EQ(table.line(0), 5u);
    ASSERT_EQ(table.comments().size(), 2u);
    EXPECT_EQ(table.comments()[0].key, "");
    EXPECT_EQ(table.comments()[0].value, "made by hand");
    EXPECT_EQ(table.comments()[1].key, "unit");
    EXPECT_EQ(table.comments()[1].value, "m");
    EXPECT_EQ(table.column("c"), 2u);
    EXPECT_FALSE(table.find("d"));
}

std::string refusal(const std::string& text) {
    constexpr std::array<std::string_view, 2> kKnown = {"count", "size"};
    try {
        const Table table(text, "t.csv");
        table.check_header(kKnown);
        table.column("count");
        for (std::size_t row = 0; row < table.n_rows(); ++row)
            table.number(row, 0);
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), Fault::bad_input);
        return e.what();
    }
    return "accepted";
}

TEST(Table, SaysLineAndColumn) {
    EXPECT_EQ(refusal("count,size\n1,2\n"), "accepted");
    EXPECT_EQ(refusal(""), "t.csv: has no header line; the first line must name the columns");
    EXPECT_EQ(refusal("# only\n"), refusal(""));
    EXPECT_EQ(refusal("count,size\n1\n"), "t.csv:2: 1 cells, the header has 2; correct the row");
    EXPECT_EQ(refusal("count,size\n1,2\nx,2"),
              "t.csv:3: column 1 'count' is 'x'; must be a finite number");
    EXPECT_THAT(refusal("count\nnan"), HasSubstr("t.csv:2: column 1 'count' is 'nan'"));
    EXPECT_THAT(refusal("count\n1,5"), HasSubstr("t.csv:2: 2 cells"));
    EXPECT_THAT(refusal("count\n0x1p4"), HasSubstr("must be a finite number"));
    EXPECT_EQ(refusal("cuont\n1"), "t.csv: unknown column 'cuont'; did you mean 'count'?");
    EXPECT_EQ(refusal("count;size\n1;2"), "accepted");
    EXPECT_THAT(refusal("count;size\n1,2,3;2"), HasSubstr("column 1 'count' is '1,2,3'"));
    EXPECT_EQ(refusal("size\n1"), "t.csv: column 'count' is missing; add it");
    EXPECT_THAT(refusal("count,count\n1,2"), HasSubstr("t.csv:1: column 2 'count' is there twice"));
    EXPECT_THAT(refusal("count,\n1,2"), HasSubstr("t.csv:1: column 2 has no name"));
    EXPECT_THAT(refusal("count\n\"1\n"), HasSubstr("t.csv:2: a quote is not closed"));
    EXPECT_THAT(refusal("count\n\"1\"2\n"), HasSubstr("t.csv:2: text behind a closing quote"));
    EXPECT_THAT(refusal(std::string("\xff\xfe"
                                    "c\0o",
                                    5)),
                HasSubstr("damaged UTF-16"));
    EXPECT_THAT(refusal("\xd6\xb1\xbe\xb6\n1"), HasSubstr("is not UTF-8 text; save it as UTF-8"));
    EXPECT_THAT(refusal("count\n\x01\n"), HasSubstr("'\\x01'"));
}

TEST(Table, ReadsWhatSpreadsheetsWrite) {
    for (const char* separator : {";", "\t"}) {
        std::string text = "# unit=mS\n\naSb\n1,5S\"-2,25\"\nS\n.5S1e3\n";
        for (std::size_t at; (at = text.find('S')) != std::string::npos;)
            text.replace(at, 1, separator);
        const Table table(text, "t.csv");
        EXPECT_THAT(table.header(), testing::ElementsAre("a", "b"));
        ASSERT_EQ(table.n_rows(), 2u); // the row of empty cells is none
        EXPECT_EQ(table.number(0, 0), 1.5);
        EXPECT_EQ(table.number(0, 1), -2.25);
        EXPECT_EQ(table.number(1, 0), 0.5);
        EXPECT_EQ(table.number(1, 1), 1000);
        EXPECT_EQ(table.comments()[0].value, "m");
    }
}

TEST(Table, ReadsUtf16) {
    const std::string text = "a,b\n1,\"\xe5\x9b\xbe\"\n"; // the picture sign of Chinese
    std::string little = "\xff\xfe", big = "\xfe\xff";
    for (const char16_t unit : std::u16string(u"a,b\n1,\"\u56fe\"\n")) {
        const auto high = static_cast<char>(unit >> 8), low = static_cast<char>(unit & 0xff);
        (little += low) += high;
        (big += high) += low;
    }
    for (const std::string& bytes : {text, little, big}) {
        const Table table(bytes, "t.csv");
        ASSERT_EQ(table.n_rows(), 1u);
        EXPECT_EQ(table.number(0, 0), 1);
        EXPECT_EQ(table.cell(0, 1), "\xe5\x9b\xbe");
    }
}

TEST(Table, LetsTheFirstColumnHaveNoName) {
    const Table table(" \tx\n1\t2\n", "t.csv");
    EXPECT_THAT(table.header(), testing::ElementsAre("", "x"));
    EXPECT_EQ(table.number(0, 1), 2);
}

TEST(Table, RenamesColumns) {
    constexpr std::array<Table::Alias, 2> kAliases = {{{"dia", "diameter"}, {"d", "diameter"}}};
    Table table("d,dia2\n1,2\n", "t.csv");
    table.rename(kAliases);
    EXPECT_EQ(table.column("diameter"), 0u);
    Table twice("d,dia\n1,2\n", "t.csv");
    expect_error(Fault::bad_input, "column 2 'diameter' is there twice",
                 [&] { twice.rename(kAliases); });
}

} // namespace
} // namespace taihu
