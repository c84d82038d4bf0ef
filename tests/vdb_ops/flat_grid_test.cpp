#include "vdb_ops/flat_grid_detail.h"

#include <cmath>
#include <limits>

#include <openvdb/tools/LevelSetSphere.h>

#include "tests/support/errors.h"
#include "tests/support/grids.h"

namespace taihu {
namespace {

std::string flat(const openvdb::FloatGrid& grid) {
    FlatWriter out;
    put_grid(out, grid);
    return out.bytes;
}

openvdb::FloatGrid::Ptr back(const std::string& bytes) {
    FlatReader in(bytes, "rock.vdb");
    const auto grid = get_grid(in);
    in.expect_end();
    return grid;
}

TEST(FlatGrid, GivesBackEveryNode) {
    openvdb::initialize();
    const auto solid = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
        90.0F, openvdb::Vec3f(3000, -5, 7), 1); // across nodes of every kind, with tiles inside
    solid->insertMeta("taihu_recipe", openvdb::StringMetadata("text"));
    solid->tree().addTile(2, openvdb::Coord(-70000, 0, 0), 4.5F, true);
    solid->tree().addTile(3, openvdb::Coord(9000, 9000, 0), -2.5F, false);
    const std::string bytes = flat(*solid);
    const auto again = back(bytes);
    EXPECT_EQ(flat(*again), bytes);
    EXPECT_TRUE(again->tree().hasSameTopology(solid->tree()));
    EXPECT_EQ(again->tree().nodeCount(), solid->tree().nodeCount());
    EXPECT_EQ(again->tree().activeVoxelCount(), solid->tree().activeVoxelCount());
    EXPECT_EQ(grid_hash(*again), grid_hash(*solid));
    EXPECT_EQ(again->getGridClass(), openvdb::GRID_LEVEL_SET);
    EXPECT_EQ(again->getMetadata<openvdb::StringMetadata>("taihu_recipe")->value(), "text");
    EXPECT_EQ(again->tree().getValue(openvdb::Coord(9001, 9001, 5)), -2.5F);
}

TEST(FlatGrid, KeepsTransforms) {
    for (const double voxel_m : {1.0, 0.1}) {
        auto grid = openvdb::FloatGrid::create(3);
        grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel_m));
        EXPECT_EQ(back(flat(*grid))->transform(), grid->transform());
        grid->transform().postTranslate({1, 2, 3.25});
        EXPECT_EQ(back(flat(*grid))->transform(), grid->transform());
    }
    auto turned = openvdb::FloatGrid::create(3);
    turned->transform().postRotate(0.3);
    EXPECT_EQ(back(flat(*turned))->transform(), turned->transform());
    auto bent = openvdb::FloatGrid::create(3);
    bent->setTransform(openvdb::math::Transform::createFrustumTransform(
        openvdb::BBoxd({0, 0, 0}, {9, 9, 9}), 0.5, 1, 1));
    expect_error(Fault::unsupported, "not linear", [&] { flat(*bent); });
}

TEST(FlatGrid, RefusesWhatIsNotFinite) {
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        auto voxel = openvdb::FloatGrid::create(3);
        voxel->tree().setValue(openvdb::Coord(17, 2, 3), bad);
        expect_error(Fault::bad_input, "not finite near (16, 0, 0)", [&] { back(flat(*voxel)); });
        auto tile = openvdb::FloatGrid::create(3);
        tile->tree().addTile(2, openvdb::Coord(17, 2, 3), bad, true);
        expect_error(Fault::bad_input, "not finite", [&] { back(flat(*tile)); });
        expect_error(Fault::bad_input, "not finite",
                     [&] { back(flat(*openvdb::FloatGrid::create(bad))); });
    }
}

TEST(FlatGrid, RefusesEveryCutAndNoByteCrashesIt) {
    const auto grid = openvdb::FloatGrid::create(3);
    grid->tree().setValue(openvdb::Coord(17, 2, 3), 1);
    grid->tree().addTile(2, openvdb::Coord(-70000, 0, 0), 4.5F, true);
    const std::string bytes = flat(*grid);
    for (std::size_t n = 0; n < bytes.size(); n += 7)
        expect_error(Fault::bad_input, "rock.vdb: damaged", [&] { back(bytes.substr(0, n)); });
    std::size_t n_refused = 0;
    for (std::size_t i = 0; i < bytes.size(); i += 3)
        for (const char flip : {'\1', '\x80', '\xff'}) {
            std::string other = bytes;
            other[i] = static_cast<char>(other[i] ^ flip);
            try {
                EXPECT_TRUE(back(other));
            } catch (const Error& e) {
                ++n_refused;
            }
        }
    EXPECT_GT(n_refused, 50u); // the rest are values and masks
}

} // namespace
} // namespace taihu
