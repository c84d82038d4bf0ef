#include "stats/core/replacing.h"

#include <gtest/gtest.h>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/file_set.h"
#include "tests/support/errors.h"
#include "tests/support/scratch.h"

namespace taihu {
namespace {

namespace fs = std::filesystem;

class Replacing : public testing::Test {
protected:
    Replacing() {
        write_file(scratch_ / "a", "mine");
        fs::create_directory(scratch_ / "folder");
        write_file(scratch_ / "folder/list", "mine");
    }
    void refuse_set(Fault fault, const std::string& what) const {
        FileSet set(scratch_ / "folder");
        set.add("new", "new");
        set.add("list", "new");
        expect_error(fault, what, [&] { set.publish("list"); });
        EXPECT_EQ(read_file(scratch_ / "folder/list"), "mine");
        EXPECT_FALSE(fs::exists(scratch_ / "folder/new"));
    }

    Scratch scratch_;
};

TEST_F(Replacing, WithoutRulesAnythingIsReplaced) {
    read_file(scratch_ / "a");
    write_file(scratch_ / "a", "new");
    EXPECT_EQ(read_file(scratch_ / "a"), "new");
}

TEST_F(Replacing, WhatWasReadStays) {
    const OutputRules rules(false);
    read_file(scratch_ / "a");
    read_file(scratch_ / "folder/list");
    const std::string what = "is also read or written by this command; choose another name";
    expect_error(Fault::bad_argument, what, [&] { write_file(scratch_ / "a", "new"); });
    EXPECT_EQ(read_file(scratch_ / "a"), "mine");
    refuse_set(Fault::bad_argument, what);
    fs::create_hard_link(scratch_ / "a", scratch_ / "b");
    expect_error(Fault::bad_argument, what, [&] { write_file(scratch_ / "b", "new"); });
}

TEST_F(Replacing, OneNameTakesOneOutput) {
    const OutputRules rules(false);
    write_file(scratch_ / "a", "first");
    expect_error(Fault::bad_argument, "a: is also read or written",
                 [&] { write_file(scratch_ / "a", "second"); });
    FileSet set(scratch_ / "folder");
    set.add("list", "first");
    set.publish("list");
    expect_error(Fault::bad_argument, "list: is also read or written",
                 [&] { write_file(scratch_ / "folder/list", "second"); });
    {
        const OutputRules inner(false);
        write_file(scratch_ / "a", "of another command");
    }
    EXPECT_EQ(read_file(scratch_ / "folder/list"), "first");
}

TEST_F(Replacing, WhatThereIsCanBeKept) {
    const OutputRules rules(true);
    fs::create_symlink("nowhere", scratch_ / "dangling");
    for (const char* name : {"a", "dangling"})
        expect_error(Fault::io, std::string(name) + ": exists; choose another name",
                     [&] { write_file(scratch_ / name, "new"); });
    refuse_set(Fault::io, "list: exists; choose another name");
    OutputFile late(scratch_ / "late");
    {
        const OutputRules of_others(false);
        write_file(scratch_ / "late", "mine");
    }
    expect_error(Fault::io, "late: exists", [&] { late.publish(); });
    EXPECT_EQ(read_file(scratch_ / "late"), "mine");
    write_file(scratch_ / "new", "new");
    EXPECT_EQ(read_file(scratch_ / "new"), "new");
}

TEST_F(Replacing, RightsAreKeptAndLinksAreReplaced) {
    const auto own = fs::perms::owner_read | fs::perms::owner_write;
    fs::permissions(scratch_ / "a", own);
    fs::permissions(scratch_ / "folder/list", own);
    write_file(scratch_ / "a", "new");
    EXPECT_EQ(fs::status(scratch_ / "a").permissions(), own);
    FileSet set(scratch_ / "folder");
    set.add("list", "new");
    set.publish("list");
    EXPECT_EQ(fs::status(scratch_ / "folder/list").permissions(), own);
    fs::create_symlink("a", scratch_ / "link");
    write_file(scratch_ / "link", "of the link");
    EXPECT_FALSE(fs::is_symlink(scratch_ / "link"));
    EXPECT_EQ(read_file(scratch_ / "a"), "new");
}

} // namespace
} // namespace taihu
