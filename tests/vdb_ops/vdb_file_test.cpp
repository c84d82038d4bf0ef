#include "vdb_ops/vdb_file.h"

#include "stats/core/file.h"
#include "tests/support/errors.h"
#include "tests/support/grids.h"
#include "tests/support/scratch.h"

namespace taihu {
namespace {

TEST(VdbFile, WhatIsWrittenIsRead) {
    const Scratch scratch;
    const auto rock = ball_rock();
    write_vdb(scratch / "rock.vdb", *rock, R"({"taihu_recipe": 1})");
    const VdbFile back = read_vdb(scratch / "rock.vdb");
    EXPECT_EQ(grid_hash(*back.solid), grid_hash(*rock));
    EXPECT_EQ(back.recipe, R"({"taihu_recipe": 1})");
    EXPECT_EQ(back.solid->getName(), "surface");
}

TEST(VdbFile, TheSameSolidGivesTheSameBytes) {
    const Scratch scratch;
    write_vdb(scratch / "a.vdb", *ball_rock(), "");
    write_vdb(scratch / "b.vdb", *ball_rock(), "");
    EXPECT_EQ(read_file(scratch / "a.vdb"), read_file(scratch / "b.vdb"));
    write_vdb(scratch / "c.vdb", *ball_rock(0.9), "");
    EXPECT_NE(read_file(scratch / "a.vdb").substr(21, 36),
              read_file(scratch / "c.vdb").substr(21, 36));
}

TEST(VdbFile, LeavesNoTemporaryBehind) {
    const Scratch scratch;
    write_vdb(scratch / "a.vdb", *ball_rock(), "");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(scratch.path()), {}), 1);
    expect_error(Fault::io, "cannot write",
                 [&] { write_vdb(scratch / "no/a.vdb", *ball_rock(), ""); });
}

TEST(VdbFile, RefusesWhatIsNoLevelSet) {
    const Scratch scratch;
    write_file(scratch / "text.vdb", "not a volume at all");
    expect_error(Fault::bad_input, "not an OpenVDB file", [&] { read_vdb(scratch / "text.vdb"); });
    write_vdb(scratch / "rock.vdb", *ball_rock(), "");
    const std::string bytes = read_file(scratch / "rock.vdb");
    write_file(scratch / "cut.vdb", bytes.substr(0, bytes.size() / 2));
    expect_error(Fault::bad_input, "cut.vdb: ", [&] { read_vdb(scratch / "cut.vdb"); });
    openvdb::io::File fog(scratch / "fog.vdb");
    auto grid = openvdb::FloatGrid::create(0);
    grid->tree().setValue(openvdb::Coord(0), 1);
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    fog.write({grid});
    fog.close();
    expect_error(Fault::bad_input, "holds no float level set",
                 [&] { read_vdb(scratch / "fog.vdb"); });
    EXPECT_EQ(read_volume(scratch / "fog.vdb")->tree().getValue(openvdb::Coord(0)), 1);
    EXPECT_EQ(grid_hash(*read_volume(scratch / "rock.vdb")), grid_hash(*ball_rock()));
}

TEST(VdbFile, AVolumeIsAGridOfFloats) {
    const Scratch scratch;
    openvdb::io::File file(scratch / "mask.vdb");
    file.write({openvdb::BoolGrid::create(false)});
    file.close();
    expect_error(Fault::bad_input, "mask.vdb: holds no grid of floats",
                 [&] { read_volume(scratch / "mask.vdb"); });
    const auto grid = openvdb::FloatGrid::create(0);
    grid->tree().setValue(openvdb::Coord(0), std::nanf(""));
    openvdb::io::File fog(scratch / "nan.vdb");
    fog.write({grid});
    fog.close();
    expect_error(Fault::bad_input, "not finite", [&] { read_volume(scratch / "nan.vdb"); });
}

TEST(VdbFile, RefusesNonFiniteVoxels) {
    const Scratch scratch;
    const auto rock = ball_rock();
    rock->tree().beginLeaf()->setValueOnly(7, std::nanf(""));
    write_vdb(scratch / "nan.vdb", *rock, "");
    expect_error(Fault::bad_input, "not finite", [&] { read_vdb(scratch / "nan.vdb"); });
}

} // namespace
} // namespace taihu
