// taihu gallery: the page of what the texts can do.
#include <algorithm>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "mesh_out/io/image_file.h"
#include "stats/core/file.h"
#include "tests/support/command.h"

namespace taihu {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

/// Every row of the relief paper and of that on fractal rocks but for scenes of many rocks (D15,
/// D22), and the rows of the thesis that are figures or tables of results.
std::set<std::string> rows_to_make() {
    std::set<std::string> rows = {"E01", "E12", "E20", "E21", "E30", "E32", "E42", "E44",
                                  "E49", "E50", "E52", "E55", "E60", "E61", "E62", "E63",
                                  "E64", "E65", "E67", "E68", "E69", "E70", "E71", "E75"};
    const auto add = [&](char text, int last) {
        for (int i = 1; i <= last; ++i)
            rows.insert(std::string(1, text) + (i < 10 ? "0" : "") + std::to_string(i));
    };
    add('T', 22);
    add('D', 23);
    rows.erase("D15");
    rows.erase("D22");
    return rows;
}

TEST(Gallery, ListsEveryRowOnce) {
    const Scratch scratch;
    std::set<std::string> rows;
    const json list = result("taihu gallery --list", scratch);
    for (const json& row : list["rows"]) {
        EXPECT_TRUE(rows.insert(row["row"]).second) << row;
        EXPECT_NE(row["title"], "");
        // Rows without commands hold times, which a page does not take.
        EXPECT_EQ(row["commands"].empty(), row["row"] == "D16" || row["row"] == "E67" ||
                                               row["row"] == "E68" || row["row"] == "E69")
            << row;
        for (const std::string command : row["commands"])
            EXPECT_THAT(command, testing::StartsWith("taihu "));
    }
    EXPECT_EQ(rows, rows_to_make());
    const Finished said = run("taihu gallery --list", scratch.path());
    EXPECT_EQ(std::count(said.out.begin(), said.out.end(), '\n'),
              static_cast<std::ptrdiff_t>(rows.size()));
    EXPECT_THAT(said.out, HasSubstr("T11   Plate 1 "));
    EXPECT_FALSE(std::filesystem::exists(scratch / "out"));
}

TEST(Gallery, ARowIsAPageWithItsPictureAndItsCommands) {
    const Scratch scratch;
    const json made = result("taihu gallery --only T09,E50 -o plates", scratch);
    EXPECT_EQ(made["rows"], 2);
    EXPECT_EQ(read_png(scratch / "plates/T09/uniform.png").width, 321);
    const std::string page = read_file(scratch / "plates/index.html");
    EXPECT_THAT(page, HasSubstr("src=\"T09/uniform.png\" width=\"321\" height=\"321\""));
    EXPECT_THAT(page, HasSubstr("taihu relief fractal"));
    // Table 4.2: then, and now by the command on the page.
    EXPECT_THAT(page, HasSubstr("<td>exponential</td><td>5.714</td><td>5.714</td>"));
    EXPECT_THAT(page, HasSubstr("<a href=\"E50/rock1.csv\">"));
    EXPECT_TRUE(std::filesystem::exists(scratch / "plates/E50/rock1.csv"));
    // What commands leave on the way stays out, and nothing comes from elsewhere.
    EXPECT_FALSE(std::filesystem::exists(scratch / "plates/T09/uniform.exr"));
    EXPECT_THAT(page, Not(HasSubstr("http")));
    EXPECT_THAT(page, Not(HasSubstr(scratch.path().string())));
}

TEST(Gallery, IsTheSameBytesAgainOnOneThread) {
    const Scratch scratch;
    result("taihu gallery --only T09 -o a", scratch);
    result("taihu gallery --only T09 -o b --threads 1", scratch);
    for (const char* file : {"index.html", "T09/uniform.png", "T09/gaussian.png"})
        EXPECT_EQ(read_file(scratch / "a" / file), read_file(scratch / "b" / file)) << file;
}

TEST(Gallery, ReplacesAnEarlierOneAndNothingElse) {
    const Scratch scratch;
    result("taihu gallery --only T09 -o plates", scratch);
    result("taihu gallery --only E50 -o plates", scratch);
    EXPECT_FALSE(std::filesystem::exists(scratch / "plates/T09"));
    EXPECT_EQ(run("taihu gallery --only E50 -o plates --no-clobber", scratch.path()).exit_code, 1);

    std::filesystem::create_directory(scratch / "mine");
    write_file(scratch / "mine/letter.txt", "dear");
    const Finished refused = run("taihu gallery --only E50 -o mine", scratch.path());
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_THAT(refused.err, HasSubstr("mine: a folder with other files; choose a new one"));
    EXPECT_EQ(read_file(scratch / "mine/letter.txt"), "dear");
    write_file(scratch / "plates/E50/letter.txt", "dear");
    EXPECT_THAT(run("taihu gallery --only E50 -o plates", scratch.path()).err,
                HasSubstr("plates/E50/letter.txt: is not of the gallery"));
    EXPECT_EQ(read_file(scratch / "plates/E50/letter.txt"), "dear");
    // Nothing that it worked in is left.
    for (const auto& file : std::filesystem::directory_iterator(scratch.path()))
        EXPECT_THAT(file.path().filename().string(), testing::AnyOf("plates", "mine"));
}

TEST(Gallery, StoppedItLeavesNothing) {
    const Scratch scratch; // the row takes some seconds
    const Finished stopped = run("env --default-signal=INT timeout --foreground --preserve-status "
                                 "-s INT 0.5 taihu gallery --only D20",
                                 scratch.path());
    EXPECT_EQ(stopped.exit_code, 130) << stopped.err;
    EXPECT_TRUE(std::filesystem::is_empty(scratch.path()));
}

TEST(Gallery, ARowThatThereIsNotIsOneLineWithARemedy) {
    const Scratch scratch;
    const Finished said = run("taihu gallery --only T1l", scratch.path());
    EXPECT_EQ(said.exit_code, 2);
    EXPECT_THAT(said.err, HasSubstr("--only: there is no row 'T1l'; did you mean 'T1"));
    EXPECT_THAT(said.err, HasSubstr("taihu gallery --list shows them"));
    EXPECT_EQ(std::count(said.err.begin(), said.err.end(), '\n'), 1);
    EXPECT_FALSE(std::filesystem::exists(scratch / "out"));
}

} // namespace
} // namespace taihu
