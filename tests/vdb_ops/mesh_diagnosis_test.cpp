#include "vdb_ops/mesh_diagnosis.h"

#include "tests/support/errors.h"

namespace taihu {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(MeshDiagnosis, RulesHaveNamesBothWays) {
    for (const char* name : {"loops", "winding", "plane", "none"})
        EXPECT_EQ(close_rule_name(close_settings(name, "union").rule), name);
    for (const char* name : {"union", "parity"})
        EXPECT_EQ(shell_rule_name(close_settings("loops", name).shells), name);
    expect_error(Fault::bad_argument, "close: 'fan' must be one of loops, winding, plane, none",
                 [] { close_settings("fan", "union"); });
    expect_error(Fault::bad_argument, "shells: 'xor' must be one of union, parity",
                 [] { close_settings("loops", "xor"); });
    expect_error(Fault::bad_argument, "drop one of them",
                 [] { close_settings("winding", "parity"); });
}

TEST(MeshDiagnosis, SaysNothingOfACleanMesh) {
    MeshDiagnosis clean;
    clean.n_solids = 1;
    clean.thickness_m = {0.5};
    EXPECT_TRUE(clean.lines(0.01).empty());
}

TEST(MeshDiagnosis, NamesWhatWasFound) {
    MeshDiagnosis d;
    d.n_bad = 1;
    d.n_repeated = 2;
    d.weld_tolerance_m = 1.7e-5;
    d.weld_share = 1e-5;
    d.n_flipped_edges = 64;
    d.n_solids = 2;
    d.n_inverted = 1;
    d.n_overlapping = 1;
    EXPECT_THAT(
        d.lines(),
        ElementsAre("3 faces dropped: 1 not finite or out of range, 2 with a repeated vertex",
                    "cracks welded at 1.7e-05 m (1e-05 of its diagonal)",
                    "64 edges disagreed on the side: made consistent",
                    "1 of 2 solid shells had their faces pointing inward",
                    HasSubstr("2 shells: 2 solid, 0 cavities"),
                    HasSubstr("1 shells overlap themselves")));
}

TEST(MeshDiagnosis, NamesHowOpeningsWereClosed) {
    MeshDiagnosis d;
    d.n_open_edges = 4;
    d.loops = {{4, {}, 4}};
    d.area_m2 = 6;
    d.cap_area_m2 = 1;
    EXPECT_THAT(d.lines()[0], HasSubstr("closed with caps = 17 % of the surface (doubtful)"));
    d.rule = CloseRule::plane;
    EXPECT_THAT(d.lines()[0], HasSubstr("closed with flat bases = 17 % of the surface"));
    d.rule = CloseRule::winding;
    EXPECT_THAT(d.lines()[0], HasSubstr("closed where the winding number is 1/2"));
}

TEST(MeshDiagnosis, NamesShellsThatTheVoxelCannotHold) {
    MeshDiagnosis d;
    d.n_solids = 1;
    d.thickness_m = {0.003};
    EXPECT_TRUE(d.lines().empty()); // no voxel is known
    EXPECT_TRUE(d.lines(0.0014).empty());
    EXPECT_THAT(
        d.lines(0.005),
        ElementsAre("1 of 1 solid shells are thinner than two voxels, down to 0.6, and will "
                    "break up; a voxel of 0.0015 m holds them"));
}

} // namespace
} // namespace taihu
