// What every verb owes its user: help, one line for an error, the right stream and exit code.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/command.h"

namespace taihu {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

const std::vector<std::string> kVerbs = {"fit",    "sample", "shape", "voxelize", "carve",
                                         "mesh",   "lod",    "check", "measure",  "section",
                                         "render", "info",   "rock",  "relief",   "bake"};

long lines(const std::string& text) {
    return std::count(text.begin(), text.end(), '\n');
}

TEST(Command, EveryVerbHasHelpWithExamples) {
    const Scratch scratch;
    const Finished all = run("taihu --help", scratch.path());
    EXPECT_EQ(all.exit_code, 0);
    for (const std::string& verb : kVerbs) {
        EXPECT_THAT(all.out, HasSubstr("\n  " + verb + " "));
        const Finished help = run("taihu " + verb + " --help", scratch.path());
        EXPECT_EQ(help.exit_code, 0) << verb;
        EXPECT_THAT(help.out, HasSubstr("\n  taihu " + verb + " ")) << verb;
        EXPECT_THAT(help.err, IsEmpty()) << verb;
    }
}

TEST(Command, WithoutArgumentsHelpGoesToStderr) {
    const Scratch scratch;
    const Finished said = run("taihu", scratch.path());
    EXPECT_EQ(said.exit_code, 2);
    EXPECT_THAT(said.out, IsEmpty());
    EXPECT_THAT(said.err, HasSubstr("carve"));
    for (const std::string& verb : kVerbs) {
        const Finished bare = run("taihu " + verb, scratch.path());
        EXPECT_EQ(bare.exit_code, 2) << verb;
        EXPECT_THAT(bare.out, IsEmpty()) << verb;
        EXPECT_EQ(lines(bare.err), 1) << bare.err;
        EXPECT_THAT(bare.err, StartsWith("taihu: " + verb + ": "));
    }
}

TEST(Command, MistypedWordsGetTheNearestOne) {
    const Scratch scratch;
    EXPECT_THAT(run("taihu crave", scratch.path()).err, HasSubstr("did you mean 'carve'?"));
    const Finished option = run("taihu carve x --hols y", scratch.path());
    EXPECT_EQ(option.exit_code, 2);
    EXPECT_THAT(option.err, HasSubstr("carve: unknown option '--hols'; did you mean '--holes'?"));
}

TEST(Command, AMissingFileIsOneLineAndExit1) {
    const Scratch scratch;
    for (const char* command :
         {"taihu fit none.csv", "taihu sample none.json --box 1 --count 3 -o h.csv",
          "taihu voxelize none.obj -o a.vdb", "taihu carve none.vdb --holes h.csv -o a.vdb",
          "taihu mesh none.vdb -o a.ply", "taihu lod none.vdb -o a.glb", "taihu check none.stl",
          "taihu measure none.off", "taihu render none.glb -o a.png", "taihu info none.vdb"}) {
        const Finished said = run(command, scratch.path());
        EXPECT_EQ(said.exit_code, 1) << command;
        EXPECT_EQ(lines(said.err), 1) << said.err;
        EXPECT_THAT(said.err, StartsWith("taihu: ")) << command;
        EXPECT_THAT(said.err, HasSubstr("none.")) << command;
        EXPECT_THAT(said.out, IsEmpty()) << command;
    }
}

TEST(Command, ValuesOutOfRangeAreUsageErrors) {
    const Scratch scratch;
    for (const char* command :
         {"taihu shape boulder --relief 5 -o a.ply", "taihu shape bolder -o a.ply",
          "taihu shape box --size -1 -o a.ply", "taihu shape sphere --dim 2 -o a.vdb",
          "taihu shape box --size 1,2 -o a.ply", "taihu shape box --dim 64 -o a.ply",
          "taihu shape superquadric --exponents 3 -o a.ply",
          "taihu shape superquadric --exponents 1,1,1 -o a.ply",
          "taihu shape rounded_box --round 0.6 -o a.ply",
          "taihu shape fractal-rock --hurst 3 -o a.ply",
          "taihu shape fractal-rock --damping smooth -o a.ply",
          "taihu shape cave --wall 0.4 --room 0.05 --iterations 1 -o a.ply"}) {
        const Finished said = run(command, scratch.path());
        EXPECT_EQ(said.exit_code, 2) << command << said.err;
        EXPECT_EQ(lines(said.err), 1) << said.err;
    }
    EXPECT_FALSE(std::filesystem::exists(scratch / "a.ply"));
}

TEST(Command, NoClobberKeepsWhatIsThere) {
    const Scratch scratch;
    write_file(scratch / "a.ply", "mine");
    const Finished said = run("taihu shape box --no-clobber -o a.ply", scratch.path());
    EXPECT_EQ(said.exit_code, 1);
    EXPECT_THAT(said.err, HasSubstr("a.ply: exists"));
    EXPECT_EQ(read_file(scratch / "a.ply"), "mine");
}

TEST(Command, MemoryThatIsNotAllowedIsRefusedOrNotHad) {
    const Scratch folder;
    must("taihu shape boulder --dim 100 -o a.vdb -q", folder);
    must("taihu fit " TAIHU_DATA "/measurements/rock1.csv -o law.json -q", folder);
    for (const std::string command :
         {"mesh a.vdb -o b.ply", "lod a.vdb -o b.glb", "bake a.vdb -o b.glb", "check a.vdb",
          "check b.ply --against a.vdb", "measure a.vdb", "render a.vdb -o b.png",
          "render a.vdb --size 8192x8192 -o b.png", "relief fractal --size 8193 -o b.exr",
          "relief convex --size 2049 -o b.exr",
          "sample law.json --box 1 --scale 1cm --count 1000000 -o b.csv"}) {
        write_file(folder / "b.ply", "");
        const Finished refused = run("taihu " + command + " --memory 60MB", folder.path());
        EXPECT_EQ(refused.exit_code, 1) << command;
        EXPECT_THAT(refused.err, testing::MatchesRegex("taihu: refused: [^\n]+\n")) << command;
        EXPECT_THAT(refused.err, HasSubstr("(limit 60 MB)")) << command;
    }
    EXPECT_EQ(std::filesystem::file_size(folder / "b.ply"), 0u);
    must("taihu mesh a.vdb -o b.ply --memory 500MB -q", folder);
    must("taihu check b.ply --against a.vdb --memory 500MB -q", folder);
    EXPECT_EQ(run("taihu info a.vdb --memory lots", folder.path()).exit_code, 2);
#ifndef TAIHU_SANITIZED // they end the program themselves
    // What no estimate foresees meets the limit itself.
    const Finished out = run("taihu section a.vdb --planes 10 --photos p --pixel 0.4mm -o c.csv "
                             "--memory 30MB",
                             folder.path());
    EXPECT_EQ(out.exit_code, 1) << out.err;
    EXPECT_THAT(out.err, testing::MatchesRegex("taihu: out of memory; [^\n]+\n"));
    EXPECT_FALSE(std::filesystem::exists(folder / "p"));
#endif
}

TEST(Command, ASignalCancelsAndLeavesNothing) {
    const Scratch scratch;
    for (const auto& [signal, code] : {std::pair("INT", 130), std::pair("TERM", 143)}) {
        // In the foreground, or the whole group gets a second signal. Long enough to have started,
        // on a job that takes many seconds (and 2 GB).
        const Finished said =
            run(std::string(
                    "env --default-signal=INT,TERM timeout --foreground --preserve-status -s ") +
                    signal + " 1 taihu shape boulder --dim 3000 -o big.vdb",
                scratch.path());
        EXPECT_EQ(said.exit_code, code);
        EXPECT_THAT(said.err, HasSubstr("stopped; no output was written")); // caught, not killed
        EXPECT_EQ(std::distance(std::filesystem::directory_iterator(scratch.path()), {}), 0);
    }
}

TEST(Command, AFullDiskOrAFileLimitKeepsTheOldFile) {
    const Scratch scratch;
    write_file(scratch / "a.vdb", "old");
    for (const char* name : {"a.vdb", "a.ply"}) { // 100 KiB at most
        const Finished said =
            run("ulimit -f 100; taihu shape boulder " +
                    std::string(std::string(name) == "a.vdb" ? "--dim 128" : "") + " -q -o " + name,
                scratch.path());
        EXPECT_EQ(said.exit_code, 1) << name;
        EXPECT_THAT(said.err, HasSubstr(std::string(name) + ": cannot write: File too large"))
            << name;
    }
    EXPECT_EQ(read_file(scratch / "a.vdb"), "old");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(scratch.path()), {}), 1);
}

TEST(Command, InputsAndOutputsAreNeverTheSameFile) {
    const Scratch scratch;
    ASSERT_EQ(run("taihu shape box --dim 24 -o a.vdb -q", scratch.path()).exit_code, 0);
    for (const char* command :
         {"taihu mesh a.vdb -o ./a.vdb", "taihu lod a.vdb -o a.glb --report a.vdb",
          "taihu lod a.vdb -o a.glb --report a.glb"}) {
        const Finished said = run(command, scratch.path());
        EXPECT_NE(said.exit_code, 0) << command;
        EXPECT_EQ(lines(said.err), 1) << command;
    }
    EXPECT_EQ(run("taihu check a.vdb -q", scratch.path()).exit_code, 0);
    EXPECT_FALSE(std::filesystem::exists(scratch / "a.glb"));
    const Finished nowhere = run("taihu mesh a.vdb -o none/a.ply", scratch.path());
    EXPECT_THAT(nowhere.err, HasSubstr("there is no folder none"));
}

TEST(Command, OptionsThatWouldDoNothingAreRefused) {
    const Scratch scratch;
    write_file(scratch / "h.csv", "x_m,y_m,z_m,radius_m\n0,0,0,0.2\n");
    ASSERT_EQ(run("taihu shape box --dim 24 -o a.vdb -q", scratch.path()).exit_code, 0);
    for (const char* command :
         {"taihu shape sphere --relief 0.2 -o b.ply", "taihu shape box --subdivisions 3 -o b.ply",
          "taihu carve a.vdb --holes h.csv --seed 3 -o b.vdb",
          "taihu carve a.vdb --holes h.csv --uniform -o b.vdb",
          "taihu mesh a.vdb --no-draco -o b.ply", "taihu mesh a.vdb --up z -o b.ply",
          "taihu shape box --round 0.1 -o b.ply", "taihu shape ellipsoid --exponents 1 -o b.ply",
          "taihu shape boulder --seed -1 -o b.ply", "taihu shape boulder --hurst 1 -o b.ply",
          "taihu shape fractal-rock --subdivisions 2 -o b.ply",
          "taihu shape fractal-rock --rocks 3 -o b.ply", "taihu shape cave --stages s -o b.ply",
          "taihu shape fractal-rock --damping none --stages s -o b.ply"}) {
        const Finished said = run(command, scratch.path());
        EXPECT_EQ(said.exit_code, 2) << command << said.err;
        EXPECT_EQ(lines(said.err), 1) << command;
    }
}

} // namespace
} // namespace taihu
