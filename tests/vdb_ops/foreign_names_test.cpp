// Names that a recipe or a list of tiles gives lead nowhere but into its folder.
#include <sys/stat.h>

#include <nlohmann/json.hpp>

#include "stats/core/file.h"
#include "stats/core/sha256.h"
#include "tests/support/errors.h"
#include "tests/support/scratch.h"
#include "vdb_ops/recipe_solid.h"
#include "vdb_ops/tiles.h"

namespace taihu {
namespace {

namespace fs = std::filesystem;

/// No plain names.
const std::string kPaths[] = {"../out.csv",
                              "..",
                              ".",
                              "",
                              "/etc/passwd",
                              "inner/a.csv",
                              "http://example.org/a.csv",
                              "file:///etc/passwd",
                              std::string("holes.csv\0.vdb", 14),
                              "a\nb.csv",
                              std::string(4096, 'a')};

/// A folder in which a pipe, a device, a folder and a link out of it have names.
class ForeignNames : public testing::Test {
protected:
    ForeignNames() {
        write_file(outside_ / "out.vdb", kHoles);
        fs::create_directory(scratch_ / "folder.vdb");
        fs::create_symlink("/dev/zero", scratch_ / "device.vdb");
        fs::create_symlink(outside_ / "out.vdb", scratch_ / "link.vdb");
        EXPECT_EQ(::mkfifo((scratch_ / "pipe.vdb").c_str(), 0600), 0);
    }

    static constexpr const char* kHoles = "x_m,y_m,z_m,radius_m\n0,0,0,1\n";
    Scratch outside_, scratch_;
};

TEST_F(ForeignNames, OfARecipeAreNoPaths) {
    const auto make = [&](const std::string& name) {
        const nlohmann::json recipe = {
            {"taihu_recipe", 1},
            {"solid", {{"holes", {{"file", name}, {"sha256", sha256_hex(kHoles)}}}}}};
        (void)estimate_recipe(recipe.dump(), "r.json", {{scratch_.path()}, {}});
    };
    for (const std::string& name : kPaths)
        expect_error(Fault::bad_input, "must be a name without folders", [&] { make(name); });
    for (const char* name : {"folder.vdb", "device.vdb", "pipe.vdb", "missing.vdb"})
        expect_error(Fault::io, "there is no file", [&] { make(name); });
    expect_error(Fault::bad_input, "a link out of its folder", [&] { make("link.vdb"); });
}

TEST_F(ForeignNames, OfTilesAreNoPaths) {
    const auto read = [&](const std::string& name) {
        const nlohmann::json set = {{"taihu_tiles", 1},
                                    {"voxel_m", 1},
                                    {"origin_m", {0, 0, 0}},
                                    {"half_width_vox", 3},
                                    {"tile_voxels", 128},
                                    {"recipe", nullptr},
                                    {"tiles",
                                     {{{"file", name},
                                       {"box", {{0, 0, 0}, {127, 127, 127}}},
                                       {"leaves", 1},
                                       {"bytes", 1},
                                       {"sha256", sha256_hex(kHoles)}}}}};
        write_file(scratch_ / kTileSetName, set.dump());
        (void)read_tiles(scratch_ / kTileSetName);
    };
    for (const std::string& name : kPaths)
        expect_error(Fault::bad_input, "must be the base name of a .vdb",
                     [&] { read(name + "/a.vdb"); });
    for (const std::string& name : {std::string("a\0.vdb", 6), std::string(4096, 'a') + ".vdb",
                                    std::string("holes.csv"), std::string()})
        expect_error(Fault::bad_input, "must be the base name of a .vdb", [&] { read(name); });
    for (const char* name : {"folder.vdb", "device.vdb", "pipe.vdb", "missing.vdb"})
        expect_error(Fault::io, "there is no such file", [&] { read(name); });
    expect_error(Fault::bad_input, "a link out of its folder", [&] { read("link.vdb"); });
}

} // namespace
} // namespace taihu
