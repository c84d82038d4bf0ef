#include "vdb_ops/tiles.h"

#include <fstream>

#include <tbb/global_control.h>

#include "stats/core/file.h"
#include "stats/core/rng.h"
#include "tests/support/errors.h"
#include "tests/support/grids.h"
#include "tests/support/scratch.h"
#include "vdb_ops/clean.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/vdb_file.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;

/// A ball of 1 m with holes of 10 cm, many enough that fragments float and bubbles are sealed.
DifferenceField holed_ball(int n_holes = 600) {
    std::vector<Sphere> holes;
    for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(n_holes); ++i) {
        const Rng rng{21, 1};
        holes.push_back(
            {{2 * rng.uniform(i, 0) - 1, 2 * rng.uniform(i, 1) - 1, 2 * rng.uniform(i, 2) - 1},
             0.05 + 0.12 * rng.uniform(i, 3)});
    }
    return {std::make_shared<BallsField>(std::array<Sphere, 1>{{{{}, 1}}}),
            std::make_shared<BallsField>(holes)};
}

/// Values, states, leaves and inside tiles, the latter where they are in the tree.
void expect_same(const openvdb::FloatGrid& a, const openvdb::FloatGrid& b) {
    ASSERT_EQ(a.tree().leafCount(), b.tree().leafCount());
    EXPECT_TRUE(a.tree().hasSameTopology(b.tree()));
    EXPECT_EQ(a.transform(), b.transform());
    EXPECT_EQ(a.background(), b.background());
    for (auto i = a.tree().cbeginLeaf(), j = b.tree().cbeginLeaf(); i; ++i, ++j)
        ASSERT_TRUE(*i == *j) << i->origin();
    auto depth = [](auto tiles) { // leaves are compared
        tiles.setMaxDepth(tiles.getLeafDepth() - 1);
        return tiles;
    };
    for (auto i = depth(a.tree().cbeginValueAll()), j = depth(b.tree().cbeginValueAll()); i;
         ++i, ++j)
        ASSERT_TRUE(j && i.getCoord() == j.getCoord() && *i == *j) << i.getCoord();
}

TEST(Tiles, TheirUnionIsTheWholeBitForBit) {
    const DifferenceField field = holed_ball();
    const Lattice lattice{0.0061, {0.01, 0.02, 0.03}, 3}; // 328 voxels across
    const auto whole = rasterize(field, lattice);
    for (const int edge : {128, 256}) {
        const Scratch folder;
        const TilesResult made =
            write_tiles(folder / "tiles", field, lattice, {edge, {}}, R"({"b":1,"a":2})");
        EXPECT_GE(made.set.tiles.size(), 8u);
        EXPECT_NEAR(made.volume_m3, volume_m3(*whole), 1e-12);
        expect_same(*read_tiles(folder / "tiles" / kTileSetName), *whole);
        EXPECT_EQ(read_tile_set(folder / "tiles" / kTileSetName).recipe, R"({"b":1,"a":2})");
    }
}

TEST(Tiles, NodesThatLieInsideAreInTheirTiles) {
    const BallsField ball(std::array<Sphere, 1>{{{{3, 1, 2}, 1}}});
    const Lattice lattice{0.003, {}, 3}; // 667 voxels across: nodes of 128^3 without a leaf
    const Scratch folder;
    write_tiles(folder / "tiles", ball, lattice, {128, {}}, "");
    const auto whole = rasterize(ball, lattice);
    expect_same(*read_tiles(folder / "tiles" / kTileSetName), *whole);
}

TEST(Tiles, CleanedAcrossTheirFacesAsTheWhole) {
    const DifferenceField field = holed_ball();
    for (const CleanSettings& settings :
         {CleanSettings{}, CleanSettings{.n_pieces = 3}, CleanSettings{.fill_bubbles = false},
          CleanSettings{.n_pieces = std::nullopt}}) {
        const Lattice lattice{0.0091, {}, 3};
        const CleanResult whole = clean(*rasterize(field, lattice), settings);
        EXPECT_GT(whole.n_pieces, 8u);
        EXPECT_GT(whole.n_bubbles, 4u);
        const Scratch folder;
        const TilesResult made = write_tiles(folder / "tiles", field, lattice, {128, settings}, "");
        ASSERT_TRUE(made.cleaned);
        EXPECT_EQ(made.cleaned->n_pieces, whole.n_pieces);
        EXPECT_EQ(made.cleaned->n_pieces_removed, whole.n_pieces_removed);
        EXPECT_EQ(made.cleaned->n_bubbles, whole.n_bubbles);
        EXPECT_EQ(made.cleaned->n_bubbles_filled, whole.n_bubbles_filled);
        // The sums go over tiles in another order: doubles of some m^3.
        EXPECT_NEAR(made.cleaned->removed_m3, whole.removed_m3, 1e-12);
        EXPECT_NEAR(made.cleaned->filled_m3, whole.filled_m3, 1e-12);
        EXPECT_NEAR(made.volume_m3, volume_m3(*whole.solid), 1e-12);
        expect_same(*read_tiles(folder / "tiles" / kTileSetName), *whole.solid);
    }
}

TEST(Tiles, APieceAndABubbleThatSpanFacesAreOne) {
    // Voxels of 1 m. A shell about the origin, a corner of eight tiles, round a loose ball; the
    // ball goes, and the void of the shell, made of eight, is one bubble.
    const auto shell = std::make_shared<DifferenceField>(
        std::make_shared<BallsField>(std::array<Sphere, 1>{{{{}, 60}}}),
        std::make_shared<BallsField>(std::array<Sphere, 1>{{{{}, 40}}}));
    const auto gap = std::make_shared<DifferenceField>(
        std::make_shared<BallsField>(std::array<Sphere, 1>{{{{}, 60}}}),
        std::make_shared<DifferenceField>(
            std::make_shared<BallsField>(std::array<Sphere, 1>{{{{}, 40}}}),
            std::make_shared<BallsField>(std::array<Sphere, 1>{{{{0, 0, 3}, 25}}})));
    const Lattice lattice{1, {}, 3};
    const Scratch folder;
    const TilesResult made =
        write_tiles(folder / "tiles", *gap, lattice, {128, CleanSettings{}}, "");
    EXPECT_EQ(made.set.tiles.size(), 8u);
    EXPECT_EQ(made.cleaned->n_pieces, 2u);
    EXPECT_EQ(made.cleaned->n_bubbles_filled, 1u);
    const auto got = read_tiles(folder / "tiles" / kTileSetName);
    expect_same(*got, *clean(*rasterize(*gap, lattice)).solid);
    const BallsField solid(std::array<Sphere, 1>{{{{}, 60}}});
    expect_same(*got, *rasterize(solid, lattice));
    EXPECT_EQ(clean(*rasterize(*shell, lattice)).n_bubbles, 1u);
}

TEST(Tiles, TheSameBytesOnOneThread) {
    const DifferenceField field = holed_ball(100);
    const Lattice lattice{0.0121, {}, 3};
    const Scratch folder;
    const TilesResult many = write_tiles(folder / "a", field, lattice, {128, CleanSettings{}}, "");
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    write_tiles(folder / "b", field, lattice, {128, CleanSettings{}}, "");
    EXPECT_EQ(read_file(folder / "a/tiles.json"), read_file(folder / "b/tiles.json"));
    for (const Tile& t : many.set.tiles)
        EXPECT_EQ(read_file(folder / "a" / t.file), read_file(folder / "b" / t.file));
}

TEST(Tiles, AnEarlierSetIsReplacedAndOtherFilesAreNot) {
    const Lattice lattice{0.02, {}, 3};
    const Scratch folder;
    const auto ball = [](double r) { return BallsField(std::array<Sphere, 1>{{{{}, r}}}); };
    write_tiles(folder / "t", ball(3), lattice, {128, {}}, "");
    const TilesResult made = write_tiles(folder / "t", ball(1), lattice, {128, {}}, "");
    std::size_t n_files = 0;
    for ([[maybe_unused]] const auto& f : std::filesystem::directory_iterator(folder / "t"))
        ++n_files;
    EXPECT_EQ(n_files, made.set.tiles.size() + 1);
    write_file(folder / "t/mine.txt", "keep");
    expect_error(Fault::io, "other files", [&] {
        write_tiles(folder / "t", ball(1), lattice, {128, {}}, "");
    });
    EXPECT_EQ(read_file(folder / "t/mine.txt"), "keep");
}

class StopAt final : public Progress {
public:
    void stage(std::string_view name) override { last_ = name == "writing tiles"; }
    void fraction(double done) override { stop_ = last_ && done > 0.5; }
    bool cancelled() const override { return stop_; }

private:
    bool last_ = false, stop_ = false;
};

TEST(Tiles, CancelledLeavesTheEarlierSet) {
    const Scratch folder;
    write_tiles(folder / "t", holed_ball(3), {0.02, {}, 3}, {128, {}}, "");
    const std::string before = read_file(folder / "t" / kTileSetName);
    StopAt stop;
    expect_error(Fault::cancelled, "", [&] {
        write_tiles(folder / "t", holed_ball(10), {0.01, {}, 3}, {128, {}}, "", &stop);
    });
    EXPECT_EQ(read_file(folder / "t" / kTileSetName), before);
    read_tiles(folder / "t" / kTileSetName); // with the hash of each
    for (const auto& f : std::filesystem::directory_iterator(folder / "t"))
        EXPECT_FALSE(f.is_directory()) << f.path();
}

TEST(Tiles, CancelledLeavesNoTile) {
    const Scratch folder;
    StopAt stop;
    expect_error(Fault::cancelled, "", [&] {
        write_tiles(folder / "t", holed_ball(10), {0.01, {}, 3}, {128, {}}, "", &stop);
    });
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(Tiles, RefuseWhatIsNoSet) {
    const Scratch folder;
    const BallsField ball(std::array<Sphere, 1>{{{{}, 1}}});
    expect_error(Fault::bad_argument, "multiple of 128", [&] {
        write_tiles(folder / "t", ball, {0.05, {}, 3}, {100, {}}, "");
    });
    const TilesResult made = write_tiles(folder / "t", ball, {0.05, {}, 3}, {128, {}}, "");
    const std::string good = read_file(folder / "t/tiles.json");
    const auto refused = [&](const std::string& from, const std::string& to,
                             const std::string& message) {
        std::string text = good;
        text.replace(text.find(from), from.size(), to);
        write_file(folder / "t/tiles.json", text);
        expect_error(Fault::bad_input, message, [&] { read_tiles(folder / "t/tiles.json"); });
    };
    refused("\"taihu_tiles\": 1", "\"taihu_tiles\": 2", "this program reads 1");
    refused("\"file\": \"", "\"file\": \"../", "base name");
    refused("\"box\": [", "\"box\": 7, \"x\": [", "'x'");
    refused("\"half_width_vox\": 3", "\"half_width_vox\": 300", "half_width_vox");
    refused(made.set.tiles[0].sha256.substr(0, 8), "00000000", "another file");
    refused("\"half_width_vox\": 3", "\"half_width_vox\": 4", "another lattice");
    refused("\"voxel_m\": 0.05", "\"voxel_m\": 0.06", "another lattice");
    refused("{", "[", "tiles.json");
    const auto two = write_tiles(folder / "u", ball, {0.01, {}, 3}, {128, {}}, "");
    std::string text = read_file(folder / "u/tiles.json");
    const std::string name = two.set.tiles[1].file;
    text.replace(text.find(name), name.size(), two.set.tiles[0].file);
    write_file(folder / "u/tiles.json", text);
    expect_error(Fault::bad_input, "tiles[1]: '" + two.set.tiles[0].file + "' is there twice",
                 [&] { read_tile_set(folder / "u/tiles.json"); });
}

TEST(Tiles, ATileSaysWhatItIs) {
    const Scratch folder;
    const TilesResult made = write_tiles(folder / "t", BallsField(std::array<Sphere, 1>{{{{}, 1}}}),
                                         {0.05, {}, 3}, {128, {}}, "{}");
    const VdbFile file = read_vdb(folder / "t" / made.set.tiles[0].file);
    EXPECT_EQ(file.tile, R"({"box":[[-128,-128,-128],[-1,-1,-1]],"of":"tiles.json"})");
    EXPECT_EQ(file.recipe, ""); // a tile is not what the recipe makes
}

TEST(Tiles, ATileCanBeASolidOfItsOwn) {
    const BallsField ball(std::array<Sphere, 1>{{{{}, 1}}});
    const Lattice lattice{0.02, {}, 3};
    const Scratch folder;
    const TilesResult made = write_tiles(folder / "t", ball, lattice, {128, {}}, "");
    double sum_m3 = 0;
    for (const Tile& t : made.set.tiles) {
        const auto raw = read_vdb(folder / "t" / t.file).solid;
        const auto solid = read_solid_vdb(folder / "t" / t.file).solid;
        sum_m3 += volume_m3(*solid);
        CoordBBox within = t.box;
        within.expand(-4);
        for (auto it = raw->cbeginValueOn(); it; ++it) {
            if (!within.isInside(it.getCoord()))
                continue;
            // To voxels and back: the last bits of a float.
            ASSERT_NEAR(solid->tree().getValue(it.getCoord()), *it, 1e-7);
        }
    }
    EXPECT_EQ(made.set.tiles.size(), 8u);
    // Half a voxel goes at each face of the three planes between voxels -1 and 0, and the voxel
    // between them: slabs of w, which meet in bars of w * w * 2 m. Edges of boxes are rounded by
    // less than a voxel.
    const double w = 0.04;
    EXPECT_NEAR(sum_m3, 4.0 / 3 * M_PI - 3 * M_PI * w + 3 * 2 * w * w, 2e-3);
}

} // namespace
} // namespace taihu
