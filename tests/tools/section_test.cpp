// taihu section: from a law to a rock, to profiles, and back to the law.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/process.h"

namespace taihu {
namespace {

using nlohmann::json;
using testing::HasSubstr;

json result(const std::string& command, const Scratch& scratch) {
    const Finished said = run(command + " --json -q", scratch.path());
    EXPECT_EQ(said.exit_code, 0) << command << '\n' << said.err;
    const json object = json::parse(said.out, nullptr, false);
    EXPECT_TRUE(object.is_object()) << command << '\n' << said.out;
    return object;
}

/// A ball of radius 1 m full of holes of a known law: base.vdb, holes.csv, rock.vdb.
void make_rock(const Scratch& scratch) {
    const Finished made =
        run("taihu shape sphere --size 2 --dim 64 -o base.vdb -q", scratch.path());
    ASSERT_EQ(made.exit_code, 0) << made.err;
    write_file(scratch / "law.json", R"({"taihu_law": 1, "family": "exponential",
        "parameters": {"rate": 12}, "intervals": {"rate": [11, 13]}, "level": 0.95,
        "unit": "m", "mean_diameter": 0.0833333333333333,
        "n_v": null, "detection_limit": 0, "n_profiles": 50, "area": null,
        "ranking": [{"family": "exponential", "aicc": 0, "weight": 1}],
        "source": []})");
    result("taihu sample law.json --in base.vdb --density 300 --seed 4 -o holes.csv", scratch);
    result("taihu carve base.vdb --holes holes.csv -o rock.vdb", scratch);
}

TEST(SectionVerb, ClosesTheLoopFromLawToLaw) {
    const Scratch scratch;
    make_rock(scratch);
    const json cut = result("taihu section rock.vdb --base base.vdb --holes holes.csv --planes 4 "
                            "--seed 2 -o profiles.csv",
                            scratch);
    EXPECT_EQ(cut["planes"], 4);
    EXPECT_EQ(cut["resolution_m"], 0);
    EXPECT_GT(cut["profiles"].get<int>(), 50);
    const json law = result("taihu fit profiles.csv --detection-limit 0 -o again.json", scratch);
    EXPECT_EQ(law["n_profiles"], cut["profiles"]);
    // Which family fits best is a matter of luck, and moves the mean; vdb_ops' tests have the law.
    EXPECT_GT(law["mean_diameter"].get<double>(), 0.04);
    EXPECT_LT(law["mean_diameter"].get<double>(), 0.16);
    EXPECT_NEAR(law["area"].get<double>(), cut["area_m2"].get<double>(), 1e-12);
}

TEST(SectionVerb, SeesHolesWithoutTheirList) {
    const Scratch scratch;
    make_rock(scratch);
    const Finished said =
        run("taihu section rock.vdb --base base.vdb --planes 3 --direction 0,1,0 -o seen.csv",
            scratch.path());
    EXPECT_EQ(said.exit_code, 0) << said.err;
    EXPECT_THAT(said.err, HasSubstr("fit with --detection-limit 0.0"));
    const json outline =
        result("taihu section rock.vdb --planes 3 --major -o outline.csv", scratch);
    EXPECT_GT(outline["profiles"].get<int>(), 3);
    EXPECT_EQ(outline["clipped"], 0);
    EXPECT_THAT(read_file(scratch / "outline.csv"), HasSubstr("\nplane,u_m,v_m,diameter_m\n"));
}

TEST(SectionVerb, RefusesByName) {
    const Scratch scratch;
    const auto fails = [&](const std::string& options, int code, const std::string& part) {
        const Finished said = run("taihu section " + options, scratch.path());
        EXPECT_EQ(said.exit_code, code) << options;
        EXPECT_THAT(said.err, HasSubstr(part));
    };
    fails("none.vdb -o a.csv", 1, "none.vdb");
    fails("none.vdb --planes 0 -o a.csv", 2, "--planes");
    fails("none.vdb --major --holes h.csv -o a.csv", 2, "excludes");
    ASSERT_EQ(run("taihu shape sphere --dim 16 -o ball.vdb -q", scratch.path()).exit_code, 0);
    fails("ball.vdb --direction 0,0,0 -o a.csv", 2, "the direction is not finite or 0");
}

} // namespace
} // namespace taihu
