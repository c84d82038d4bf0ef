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

TEST(Outputs, NothingThatACommandReadsIsReplaced) {
    const Scratch folder;
    must("taihu shape box --dim 16 -o base.vdb && taihu shape sphere --subdivisions 2 -o ball.ply "
         "&& "
         "taihu fit " TAIHU_DATA "/measurements/rock1.csv -o law.json -q && taihu sample law.json "
         "--box 1 --scale 5cm --count 9 -o holes.csv -q && taihu relief fractal --size 65 -o t.exr "
         "&& taihu voxelize ball.ply --dim 16 -o ball.vdb",
         folder);
    must("mkdir keep && cp * keep || true", folder);
    for (const std::string command :
         {"section base.vdb --holes holes.csv --planes 1 -o holes.csv",
          "fit " TAIHU_DATA "/measurements/rock1.csv --expect law.json -o law.json",
          "render ball.ply --size 32x32 --relief t.exr --tile-side 1 -o t.exr",
          "rock --from ball.vdb --dim 16 -o ball.ply", // its recipe reads it
          "lod ball.vdb --levels 1 -o x.glb --report ball.ply",
          "carve base.vdb --holes holes.csv --tiles 128 --pieces all --bubbles keep -o t && "
          "taihu carve t/tile_0_0_0.vdb --holes holes.csv --tiles 128 --pieces all --bubbles keep "
          "-o t"}) {
        const Finished said = run("taihu " + command, folder.path());
        EXPECT_EQ(said.exit_code, 2) << command << '\n' << said.err;
        EXPECT_THAT(said.err, HasSubstr("is also read or written by this command")) << command;
    }
    must("for f in keep/*; do cmp $f $(basename $f); done", folder);
    EXPECT_EQ(run("taihu section base.vdb --planes 1 -o base.vdb", folder.path()).exit_code, 1);
}

TEST(Outputs, WithNoClobberNothingIsReplaced) {
    const Scratch folder;
    must("taihu shape box --dim 16 -o a.vdb && taihu fit " TAIHU_DATA
         "/measurements/rock1.csv -o law.json -q && taihu sample law.json --box 1 --scale 5cm "
         "--count 9 -o h.csv -q && mkdir f && for f in manifest.json files.json tile_0_0_0.vdb; do "
         "echo mine >f/$f; done",
         folder);
    for (const std::string command :
         {"lod a.vdb --levels 1 --split -o f", "bake a.vdb --levels 1 --size 64 --maps f -o b.glb",
          "section a.vdb --planes 1 --pixel 9mm --photos f",
          "rock --preset pumice --dim 16 --tiles 128 -o f"}) {
        const Finished said = run("taihu " + command + " --no-clobber -q", folder.path());
        EXPECT_EQ(said.exit_code, 1) << command << '\n' << said.err;
        EXPECT_EQ(n_entries(folder / "f"), 3) << command;
    }
    must("cat f/* | grep -v mine | wc -l | grep -qx 0", folder);
    EXPECT_FALSE(fs::exists(folder / "b.glb"));
}

TEST(Outputs, WhatIsPrintedAndDoesNotArriveIsSaid) {
    const Scratch folder;
    for (const std::string command :
         {"--help", "--version", "rock --list", "rock --list --json", "gallery --list",
          "info " TAIHU_DATA "/measurements/rock1.csv"}) {
        const Finished said = run("taihu " + command + " >/dev/full", folder.path());
        EXPECT_EQ(said.exit_code, 1) << command;
        EXPECT_THAT(said.err, HasSubstr("stdout: cannot write")) << command;
    }
    // One who has read enough may close the pipe.
    for (const char* command : {"rock --list", "rock --list --json", "gallery --list --json"})
        EXPECT_EQ(run(std::string("(sleep 0.3; taihu ") + command + ") | true", folder.path()).err,
                  "");
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
        run("PATH=$PWD/bin:$PATH env --default-signal=INT timeout -k 20 --preserve-status 50 taihu "
            "fit " TAIHU_DATA "/measurements/rock1.csv --resamples 19 --report law.html",
            folder.path());
    EXPECT_EQ(said.exit_code, 130);
    EXPECT_THAT(said.err, HasSubstr("taihu: stopped; no output was written\n"));
    EXPECT_EQ(n_entries(folder.path()), 1);
}

// The signal goes to both, as from a terminal, or to taihu alone.
INSTANTIATE_TEST_SUITE_P(Signal, Stopping, testing::Values("0", "$PPID"),
                         [](const auto& to) { return *to.param == '0' ? "ToBoth" : "ToTaihu"; });

TEST(Stopping, AClosedTerminalStopsUnlessItIsIgnored) {
    const Scratch folder;
    must("mkdir bin && printf '#!/bin/sh\\nkill -HUP $PPID\\nexec sleep 2\\n' >bin/gnuplot && "
         "chmod +x bin/gnuplot",
         folder);
    const std::string fit = "PATH=$PWD/bin:$PATH taihu fit " TAIHU_DATA
                            "/measurements/rock1.csv --resamples 19 --report law.html -q";
    EXPECT_EQ(run("env --default-signal=HUP " + ("sh -c '" + fit + "; exit $?'"), folder.path())
                  .exit_code,
              129);
    EXPECT_EQ(n_entries(folder.path()), 1);
    EXPECT_NE(run("trap '' HUP; " + fit, folder.path()).exit_code, 129);
}

TEST(Backstop, EndsWorkThatDoesNotLookUp) {
    const Scratch folder;
    // 1.3 million triangles are looked at for crossings without a look at signals; where that is
    // over within the second that it is given, the look before writing ends it.
    const Finished said = run("env --default-signal=TERM timeout --foreground -s TERM "
                              "--preserve-status 0.6 taihu shape boulder "
                              "--subdivisions 8 -q -o x.glb",
                              folder.path());
    EXPECT_EQ(said.exit_code, 143);
    // Nothing where the machine is so busy that the program has not begun.
    EXPECT_THAT(said.err, testing::AnyOf("", "taihu: stopped; no output was written\n"));
    EXPECT_EQ(n_entries(folder.path()), 0);
}

} // namespace
} // namespace taihu
