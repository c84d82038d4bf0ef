#include "stats/core/folder_file.h"

#include <sys/stat.h>

#include "stats/core/file.h"
#include "tests/support/errors.h"
#include "tests/support/scratch.h"

namespace taihu {
namespace {

namespace fs = std::filesystem;

TEST(FolderFile, OnlyPlainNamesAreNames) {
    for (const std::string& name :
         {std::string(), std::string("."), std::string(".."), std::string("../a"),
          std::string("a/b"), std::string("/etc/passwd"), std::string("http://a/b"),
          std::string("a\0.ply", 6), std::string("a\nb"), std::string(256, 'a'),
          std::string(4096, 'a'), std::string("\xff.ply")}) {
        EXPECT_FALSE(is_plain_name(name)) << name.substr(0, 20);
        expect_error(Fault::bad_argument, "is no plain name", [&] { (void)file_in(".", name); });
    }
    for (const std::string name : {"a.ply", "..a", "a b.ply", "\xe7\x9f\xb3.ply"})
        EXPECT_TRUE(is_plain_name(name)) << name;
}

TEST(FolderFile, FindsARegularFileAndNothingElse) {
    const Scratch outside, scratch;
    write_file(scratch / "a.ply", "a");
    write_file(outside / "b.ply", "b");
    fs::create_directory(scratch / "folder.ply");
    fs::create_symlink("a.ply", scratch / "inside.ply");
    fs::create_symlink("/dev/zero", scratch / "device.ply");
    fs::create_symlink(outside / "b.ply", scratch / "out.ply");
    ASSERT_EQ(::mkfifo((scratch / "pipe.ply").c_str(), 0600), 0);
    EXPECT_EQ(file_in(scratch.path(), "a.ply"), scratch / "a.ply");
    EXPECT_EQ(file_in(scratch.path(), "inside.ply"), scratch / "inside.ply");
    for (const char* none : {"folder.ply", "device.ply", "pipe.ply", "missing.ply"})
        EXPECT_EQ(file_in(scratch.path(), none), std::nullopt) << none;
    expect_error(Fault::bad_input, "a link out of its folder",
                 [&] { (void)file_in(scratch.path(), "out.ply"); });
    // A folder that is itself reached by a link holds its files.
    fs::create_directory_symlink(scratch.path(), outside / "link");
    EXPECT_EQ(file_in(outside / "link", "a.ply"), outside / "link/a.ply");
}

} // namespace
} // namespace taihu
