// What people and programs see when the input means no good.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stats/core/text.h"
#include "tests/stats/io/annotation_makers.h"
#include "tests/support/command.h"

namespace taihu {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

/// The one line with which a command refuses.
std::string refusal(const std::string& command, int code, const Scratch& folder) {
    const Finished said = run(command, folder.path());
    EXPECT_EQ(said.exit_code, code) << command << '\n' << said.err;
    EXPECT_EQ(said.out, "") << command;
    EXPECT_THAT(said.err, StartsWith("taihu: ")) << command;
    EXPECT_THAT(said.err, EndsWith("\n")) << command;
    EXPECT_EQ(said.err.find('\n'), said.err.size() - 1) << said.err;
    EXPECT_LT(said.err.size(), 300u) << said.err;
    return said.err;
}

TEST(Hostile, ANumberThatIsNoneIsRefusedByTheNameOfItsOption) {
    const Scratch scratch;
    for (const std::string value : {"nan", "inf", "-inf", "1e400", "word", "''"})
        for (const std::string option : {"--relief", "--subdivisions", "--seed", "--exponents"})
            EXPECT_THAT(refusal("taihu shape boulder -o a.ply " + option + "=" + value, 2, scratch),
                        HasSubstr(option))
                << value;
    EXPECT_THAT(refusal("taihu shape boulder -o a.ply --relief nan", 2, scratch),
                HasSubstr("'nan', must be a finite number in [0 - 0.9]"));
    EXPECT_THAT(refusal("taihu shape boulder -o a.ply --relief", 2, scratch),
                HasSubstr("--relief"));
    EXPECT_FALSE(std::filesystem::exists(scratch / "a.ply"));
}

TEST(Hostile, ALongOrForeignNameStaysOnOneLine) {
    const Scratch scratch;
    EXPECT_THAT(refusal("taihu info $(printf 'd%.0s' $(seq 4000))/a.ply", 1, scratch),
                HasSubstr("/a.ply: cannot open"));
    EXPECT_THAT(refusal("taihu info \"$(printf 'a\\033[31m\\nb.ply')\"", 1, scratch),
                HasSubstr("a\\x1b[31m\\x0ab.ply"));
}

TEST(Hostile, AVerbThatRefusesSaysNothingBefore) {
    const Scratch scratch;
    write_file(scratch / "open.obj",
               "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n");
    write_file(scratch / "all.csv", "x_m,y_m,z_m,radius_m\n0,0,0,9\n");
    // That the mesh was closed is said when it is voxelized, but not when carving leaves nothing.
    EXPECT_THAT(run("taihu voxelize open.obj --dim 16 -o a.vdb", scratch.path()).err,
                HasSubstr("open.obj: "));
    refusal("taihu carve open.obj --dim 16 --holes all.csv -o b.vdb", 1, scratch);
}

TEST(Hostile, InfoTakesNoJsonAtItsWord) {
    const Scratch scratch;
    write_file(scratch / "deep.json",
               "{\"taihu_report\": 1, \"levels\": " + std::string(1'000'000, '[') + "}");
    EXPECT_THAT(refusal("taihu info deep.json", 1, scratch),
                HasSubstr("deep.json:1:94: nested deeper than 64 levels"));
    write_file(scratch / "twice.json", R"({"taihu_report": 1, "taihu_report": 1})");
    EXPECT_THAT(refusal("taihu info twice.json", 1, scratch), HasSubstr("is there twice"));
    write_file(scratch / "recipe.json", R"({"taihu_report": 1, "recipe": 5})");
    EXPECT_EQ(run("taihu info recipe.json", scratch.path()).exit_code, 0);
}

TEST(Hostile, ASettingIsJsonOfOursOrText) {
    const Scratch scratch;
    const std::string rock = "taihu rock --preset pumice -o a.ply --set ";
    refusal(rock + "/solid=$(printf '[%.0s' $(seq 60000))", 1, scratch);
    EXPECT_THAT(refusal(rock + "\"dim=$(printf '\\377')\"", 2, scratch), HasSubstr("not UTF-8"));
}

TEST(Hostile, PipesAndDevicesAreNotRead) {
    const Scratch scratch;
    must("mkfifo pipe.ply && ln -s /dev/zero zero.ply", scratch);
    for (const char* name : {"pipe.ply", "zero.ply"})
        EXPECT_THAT(refusal(std::string("timeout 10 taihu info ") + name, 1, scratch),
                    HasSubstr("not a regular file"));
    // Nor the library that a mesh names.
    write_file(scratch / "a.obj", "mtllib pipe.ply\nmtllib ../../../etc/passwd\nv 0 0 0\nv 1 0 0\n"
                                  "v 0 1 0\nf 1 2 3\n");
    must("timeout 10 taihu info a.obj", scratch);
    // Nor the photo that marks were made on.
    write_file(scratch / "marks.json", labelme_text(eight_holes(), "pipe.ply"));
    must("timeout 10 taihu fit marks.json -o law.json", scratch);
}

} // namespace
} // namespace taihu
