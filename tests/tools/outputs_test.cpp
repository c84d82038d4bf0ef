// What is left of outputs when something goes wrong.
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stats/core/sha256.h"
#include "tests/support/command.h"

namespace taihu {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

std::ptrdiff_t n_entries(const fs::path& folder) {
    return std::distance(fs::directory_iterator(folder), {});
}

TEST(Outputs, AFolderOfMapsEndsWithTheListOfThem) {
    const Scratch folder;
    must("taihu shape sphere --dim 24 -o ball.vdb", folder);
    must("taihu bake ball.vdb --levels 1 --size 128 --maps maps --report r.json -o b.glb -q",
         folder);
    const json list = json::parse(read_file(folder / "maps/files.json"));
    EXPECT_EQ(list["files"].size() + 1, std::size_t(n_entries(folder / "maps")));
    for (const json& file : list["files"]) {
        const std::string bytes = read_file(folder / "maps" / file["file"].get<std::string>());
        EXPECT_EQ(file["bytes"], bytes.size());
        EXPECT_EQ(file["sha256"], sha256_hex(bytes));
    }
}

TEST(Outputs, AManifestOfLevelsNamesTheReportBesideIt) {
    const Scratch folder;
    must("taihu shape sphere --dim 24 -o ball.vdb", folder);
    must("taihu lod ball.vdb --levels 2 --split -o levels -q", folder);
    const json report = json::parse(read_file(folder / "levels/manifest.json"))["report"];
    EXPECT_EQ(report["file"], "report.json");
    EXPECT_EQ(report["sha256"], sha256_hex(read_file(folder / "levels/report.json")));
}

TEST(Outputs, ARunThatFailsLeavesTheFilesAndFoldersThatWereThere) {
    const Scratch folder;
    must("taihu shape sphere --dim 24 -o ball.vdb", folder);
    must("mkdir there there/manifest.json && echo mine >there/level0.glb", folder);
    // A folder has the name of the list, which comes last: all before it has to go back.
    const Finished said = run("taihu lod ball.vdb --levels 1 --split -o there", folder.path());
    EXPECT_EQ(said.exit_code, 1);
    EXPECT_THAT(said.err, HasSubstr("there/manifest.json: is no regular file"));
    EXPECT_EQ(read_file(folder / "there/level0.glb"), "mine\n");
    EXPECT_EQ(n_entries(folder / "there"), 2);
    // The plots have no gnuplot: by then the law is known, and it must not be written alone.
    must("mkdir bin && ln -s \"$(command -v taihu)\" bin/taihu", folder);
    EXPECT_EQ(run("PATH=bin taihu fit " TAIHU_DATA
                  "/measurements/rock1.csv --resamples 19 -o law.json --report law.html",
                  folder.path())
                  .exit_code,
              1);
    EXPECT_FALSE(fs::exists(folder / "law.json"));
    EXPECT_EQ(n_entries(folder.path()), 3);
}

TEST(Outputs, NoDeviceIsReplaced) {
    const Scratch folder;
    const Finished said =
        run("ln -s /dev/null x.ply && taihu shape sphere -o x.ply", folder.path());
    EXPECT_EQ(said.exit_code, 1);
    EXPECT_THAT(said.err, HasSubstr("x.ply: is no regular file"));
    EXPECT_TRUE(fs::is_symlink(folder / "x.ply"));
}

class Stopping : public testing::TestWithParam<const char*> {};

TEST_P(Stopping, EndsAProgramThatIsWaitedFor) {
    const Scratch folder;
    must("mkdir bin && printf '#!/bin/sh\\nkill -INT " + std::string(GetParam()) +
             "\\nexec sleep 60\\n' >bin/gnuplot && chmod +x bin/gnuplot",
         folder);
    // timeout makes the group that gets the signal; where it has to end the program itself, the
    // exit code is another.
    const Finished said =
        run("PATH=$PWD/bin:$PATH timeout -k 20 --preserve-status 50 taihu fit " TAIHU_DATA
            "/measurements/rock1.csv --resamples 19 --report law.html",
            folder.path());
    EXPECT_EQ(said.exit_code, 130);
    EXPECT_THAT(said.err, HasSubstr("taihu: stopped; no output was written\n"));
    EXPECT_EQ(n_entries(folder.path()), 1);
}

// The signal goes to both, as from a terminal, or to taihu alone.
INSTANTIATE_TEST_SUITE_P(Signal, Stopping, testing::Values("0", "$PPID"),
                         [](const auto& to) { return *to.param == '0' ? "ToBoth" : "ToTaihu"; });

TEST(Backstop, EndsWorkThatDoesNotLookUp) {
    const Scratch folder;
    // 1.3 million triangles are looked at for crossings without a look at signals; where that is
    // over within the second that it is given, the look before writing ends it.
    const Finished said =
        run("timeout --foreground -s TERM --preserve-status 0.6 taihu shape boulder "
            "--subdivisions 8 -q -o x.glb",
            folder.path());
    EXPECT_EQ(said.exit_code, 143);
    // Nothing where the machine is so busy that the program has not begun.
    EXPECT_THAT(said.err, testing::AnyOf("", "taihu: stopped; no output was written\n"));
    EXPECT_EQ(n_entries(folder.path()), 0);
}

} // namespace
} // namespace taihu
