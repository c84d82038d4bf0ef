#include "stats/core/file_set.h"

#include <fcntl.h>
#include <set>
#include <sys/file.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stats/core/error.h"
#include "stats/core/sha256.h"
#include "tests/support/errors.h"
#include "tests/support/scratch.h"

namespace taihu {
namespace {

namespace fs = std::filesystem;
using Names = std::set<std::string>;

Names names_in(const fs::path& folder) {
    Names names;
    for (const auto& entry : fs::directory_iterator(folder))
        names.insert(entry.path().filename().string());
    return names;
}

TEST(FileSet, ANewFolderComesIntoViewWhole) {
    const Scratch scratch;
    FileSet set(scratch / "a/b");
    set.add("one.txt", "1");
    set.add("two.txt", "22");
    EXPECT_FALSE(fs::exists(scratch / "a"));
    set.publish("two.txt");
    EXPECT_EQ(names_in(scratch.path()), Names{"a"});
    EXPECT_EQ(names_in(scratch / "a/b"), (Names{"one.txt", "two.txt"}));
    EXPECT_EQ(read_file(scratch / "a/b/two.txt"), "22");
}

TEST(FileSet, WithoutPublishNothingIsLeft) {
    const Scratch scratch;
    fs::create_directory(scratch / "there");
    for (const char* folder : {"new", "there", "far/off"}) {
        FileSet set(scratch / folder);
        set.add("one.txt", "1");
    }
    EXPECT_EQ(names_in(scratch.path()), Names{"there"});
    EXPECT_TRUE(fs::is_empty(scratch / "there"));
}

TEST(FileSet, AFolderThatSomebodyHoldsIsWaitedForAndThenTaken) {
    const Scratch scratch;
    const int held = ::open(scratch.path().c_str(), O_RDONLY | O_CLOEXEC);
    ASSERT_EQ(::flock(held, LOCK_EX), 0);
    FileSet set(scratch.path());
    set.add("list", "now");
    set.publish("list");
    ::close(held);
    EXPECT_EQ(read_file(scratch / "list"), "now");
}

TEST(FileSet, AFolderKeepsWhatIsNotOfTheSet) {
    const Scratch scratch;
    for (const char* name : {"mine", "list", "old", "part"})
        write_file(scratch / name, "before");
    FileSet set(scratch.path());
    set.add("part", "now");
    set.add("list", "now");
    EXPECT_EQ(read_file(scratch / "part"), "before");
    const std::vector<std::string> gone = {"old", "part", "never there"};
    set.publish("list", gone);
    EXPECT_EQ(names_in(scratch.path()).count("old"), 0u);
    EXPECT_EQ(read_file(scratch / "mine"), "before");
    EXPECT_EQ(read_file(scratch / "part"), "now");
    EXPECT_EQ(read_file(scratch / "list"), "now");
}

TEST(FileSet, APlaceThatCannotBeTakenLeavesAllAsItWas) {
    const Scratch scratch;
    write_file(scratch / "a", "before");
    write_file(scratch / "list", "before");
    fs::create_directory(scratch / "b");
    {
        FileSet set(scratch.path());
        for (const char* name : {"a", "b", "list"})
            set.add(name, "now");
        expect_error(Fault::io, (scratch / "b").string() + ": is no regular file",
                     [&] { set.publish("list"); });
    }
    EXPECT_EQ(names_in(scratch.path()), (Names{"a", "b", "list"}));
    EXPECT_EQ(read_file(scratch / "a"), "before");
    EXPECT_EQ(read_file(scratch / "list"), "before");
    {
        // The list itself is missing from the set, which is seen after all else was renamed.
        FileSet set(scratch.path());
        set.add("a", "now");
        set.add("new", "now");
        expect_error(Fault::io, "cannot replace", [&] { set.publish("list"); });
    }
    EXPECT_EQ(names_in(scratch.path()), (Names{"a", "b", "list"}));
    EXPECT_EQ(read_file(scratch / "a"), "before");
    EXPECT_EQ(read_file(scratch / "list"), "before");
}

TEST(FileSet, TheListHasSizeAndHashOfEach) {
    const Scratch scratch;
    FileSet set(scratch / "set");
    set.add("b.bin", "xyz");
    set.add("a.bin", "");
    set.list();
    set.publish(kFileListName);
    EXPECT_EQ(read_file(scratch / "set/files.json"),
              "{\n  \"taihu_files\": 1,\n  \"files\": [\n"
              "    {\"file\": \"a.bin\", \"bytes\": 0, \"sha256\": \"" +
                  sha256_hex("") +
                  "\"},\n"
                  "    {\"file\": \"b.bin\", \"bytes\": 3, \"sha256\": \"" +
                  sha256_hex("xyz") + "\"}\n  ]\n}\n");
}

TEST(FileSet, ErrorsNameTheFolderThatIsToBe) {
    const Scratch scratch;
    FileSet set(scratch / "set");
    expect_error(Fault::io, (scratch / "set/no/name").string() + ": cannot write",
                 [&] { set.add("no/name", "x"); });
    write_file(scratch / "file", "x");
    expect_error(Fault::io, "is no folder", [&] { FileSet(scratch / "file"); });
}

TEST(OutputFiles, AreSeenTogether) {
    const Scratch scratch;
    OutputFiles files;
    files.add(scratch / "a", "1");
    files.add("", "not asked for");
    expect_error(Fault::io, "cannot write", [&] { files.add(scratch / "no/b", "2"); });
    EXPECT_FALSE(fs::exists(scratch / "a"));
    files.publish();
    EXPECT_EQ(names_in(scratch.path()), Names{"a"});
}

TEST(WorkFolder, ReplacesAFolderWithAllInIt) {
    const Scratch scratch;
    fs::create_directories(scratch / "out/old");
    for (const char* goal : {"out", "new/out"}) {
        WorkFolder work(scratch / goal);
        write_file(work.path() / "x", "now");
        fs::create_directory(work.path() / "sub");
        work.publish();
        EXPECT_EQ(names_in(scratch / goal), (Names{"sub", "x"}));
    }
    { const WorkFolder unused(scratch / "never/made"); }
    EXPECT_EQ(names_in(scratch.path()), (Names{"new", "out"}));
}

} // namespace
} // namespace taihu
