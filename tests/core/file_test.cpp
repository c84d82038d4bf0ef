#include "stats/core/file.h"

#include <csignal>
#include <fcntl.h>
#include <fstream>
#include <iterator>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stats/core/error.h"
#include "tests/support/errors.h"
#include "tests/support/scratch.h"

namespace taihu {
namespace {

using testing::HasSubstr;

std::ptrdiff_t n_entries(const Scratch& folder) {
    return std::distance(std::filesystem::directory_iterator(folder.path()), {});
}

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
    EXPECT_EQ(n_entries(scratch), 1);
    EXPECT_TRUE(std::filesystem::is_directory(scratch / "taken"));
}

TEST(OutputFile, IsNotSeenBeforeItIsWhole) {
    const Scratch scratch;
    write_file(scratch / "x", "before");
    {
        OutputFile file(scratch / "x");
        file.write("half");
        file.finish();
    }
    EXPECT_EQ(read_file(scratch / "x"), "before");
    EXPECT_EQ(n_entries(scratch), 1);
    OutputFile file(scratch / "x");
    file.write("abc");
    file.write("def");
    file.write_at(0, "AB");
    std::string part(4, ' ');
    EXPECT_EQ(file.read_at(1, part), 4u);
    EXPECT_EQ(part, "Bcde");
    EXPECT_EQ(file.read_at(4, part), 2u);
    EXPECT_EQ(file.size(), 6u);
    file.publish();
    EXPECT_EQ(read_file(scratch / "x"), "ABcdef");
    EXPECT_EQ(n_entries(scratch), 1);
}

TEST(OutputFile, ReplacesNoDeviceAndNoPipe) {
    const Scratch scratch;
    ASSERT_EQ(::mkfifo((scratch / "pipe").c_str(), 0600), 0);
    for (const auto& path : {scratch / "pipe", std::filesystem::path("/dev/null")})
        expect_error(Fault::io, path.string() + ": is no regular file",
                     [&] { write_file(path, "x"); });
}

TEST(OutputFile, SweepsWhatNobodyHoldsAndNothingElse) {
    const Scratch scratch;
    std::filesystem::create_directories(scratch / ".taihu-tmp-aaaaaa/deep");
    for (const char* name : {".taihu-tmp-bbbbbb", ".taihu-tmp-cccccc", ".taihu-tmp-sevenly",
                             ".taihu-tmp-BACKUP", ".taihu-tmp-1.json"})
        std::ofstream(scratch / name) << "left behind";
    const int held = ::open((scratch / ".taihu-tmp-bbbbbb").c_str(), O_RDONLY | O_CLOEXEC);
    ASSERT_EQ(::flock(held, LOCK_EX), 0);
    write_file(scratch / "x", "");
    EXPECT_FALSE(std::filesystem::exists(scratch / ".taihu-tmp-aaaaaa"));
    EXPECT_TRUE(std::filesystem::exists(scratch / ".taihu-tmp-bbbbbb")); // somebody writes it
    EXPECT_FALSE(std::filesystem::exists(scratch / ".taihu-tmp-cccccc"));
    for (const char* name : {".taihu-tmp-sevenly", ".taihu-tmp-BACKUP", ".taihu-tmp-1.json"})
        EXPECT_TRUE(std::filesystem::exists(scratch / name)) << name; // not one of ours
    ::close(held);
}

TEST(OutputFile, ASizeLimitIsAnErrorWithThePath) {
    // A child, for the limit stays.
    const Scratch scratch;
    write_file(scratch / "x", "before");
    const pid_t child = ::fork();
    if (child == 0) {
        std::signal(SIGXFSZ, SIG_IGN);
        const rlimit limit{1000, 1000};
        ::setrlimit(RLIMIT_FSIZE, &limit);
        try {
            write_file(scratch / "x", std::string(2000, 'x'));
        } catch (const Error& e) {
            const std::string expected =
                (scratch / "x").string() + ": cannot write: File too large";
            ::_exit(e.fault() == Fault::io && std::string(e.what()).starts_with(expected) ? 0 : 1);
        }
        ::_exit(2);
    }
    int status = -1;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_EQ(status, 0);
    EXPECT_EQ(read_file(scratch / "x"), "before");
    EXPECT_EQ(n_entries(scratch), 1);
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
