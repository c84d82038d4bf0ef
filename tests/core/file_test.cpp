#include "stats/core/file.h"

#include <sys/stat.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stats/core/error.h"
#include "tests/support/scratch.h"

namespace taihu {
namespace {

using testing::HasSubstr;

TEST(File, WhatIsWrittenIsRead) {
    const Scratch scratch;
    const std::string bytes("a\0b\n", 4);
    write_file(scratch / "x.bin", bytes);
    EXPECT_EQ(read_file(scratch / "x.bin"), bytes);
    write_file(scratch / "x.bin", "");
    EXPECT_EQ(read_file(scratch / "x.bin"), "");
}

TEST(File, AFailedWriteLeavesNothingBehind) {
    const Scratch scratch;
    std::filesystem::create_directory(scratch / "taken"); // a file cannot replace a folder
    EXPECT_THROW(write_file(scratch / "taken", "x"), Error);
    std::size_t n = 0;
    for ([[maybe_unused]] const auto& e : std::filesystem::directory_iterator(scratch.path()))
        ++n;
    EXPECT_EQ(n, 1u);
    EXPECT_TRUE(std::filesystem::is_directory(scratch / "taken"));
}

TEST(File, RefusesWhatIsNoRegularFile) {
    const Scratch scratch;
    ASSERT_EQ(::mkfifo((scratch / "pipe").c_str(), 0600), 0);
    for (const auto& path : {scratch / "pipe", scratch.path(), scratch / "missing",
                             std::filesystem::path("/dev/zero")}) {
        try {
            read_file(path);
            FAIL() << path;
        } catch (const Error& e) {
            EXPECT_EQ(e.fault(), Fault::io);
            EXPECT_THAT(e.what(), HasSubstr(path.string()));
        }
    }
}

TEST(File, RefusesALongFileBeforeReadingIt) {
    const Scratch scratch;
    write_file(scratch / "long", "12345");
    EXPECT_EQ(read_file(scratch / "long", 5), "12345");
    EXPECT_THROW(read_file(scratch / "long", 4), Error);
}

TEST(BaseName, IsOneLine) {
    EXPECT_EQ(base_name("/a/b\nc.obj"), "b\\x0ac.obj");
}

} // namespace
} // namespace taihu
