#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include "mesh_out/extract.h"
#include "mesh_out/piece_sides_detail.h"
#include "stats/core/error.h"
#include "tests/support/fields.h"
#include "tests/support/random_recipe.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/clean.h"
#include "vdb_ops/combine_field.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/offset_field.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/recipe_solid.h"
#include "vdb_ops/solids_field.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
using testing::HasSubstr;

constexpr double kVoxel = 0.05;
const Lattice kLattice{kVoxel, {0.0113, -0.0071, 0.0037}, 3};

std::shared_ptr<const Field> balls(std::vector<Sphere> all) {
    return std::make_shared<BallsField>(std::move(all));
}
std::shared_ptr<const Field> solid(const PrimitiveSolid& shape, const Similarity& at = {}) {
    return std::make_shared<SolidsField>(std::vector<AnalyticSolid>{{shape, at}});
}

struct Case {
    std::string name;
    std::shared_ptr<const Field> field;
    bool of_level_set = false; ///< the level set is its own field
};

/// Bars, longer than what is looked at for a tile, over the plane between tiles.
std::vector<Case> cases() {
    const Vec3 middle{0, 0.8, 0};
    const auto straight = solid(BoxSolid{{0.35, 0.4, 16}}, Similarity::translation(middle));
    const auto bar = solid(BoxSolid{{0.35, 0.4, 16}},
                           Similarity::translation(middle) * Similarity::rotation({1, 2, 0}, 0.02));
    std::vector<Sphere> holes;
    for (std::uint64_t i = 0; i < 200; ++i) {
        const Vec3 at = random_vec(i);
        holes.push_back({middle + Vec3{0.4 * at.x, 0.4 * at.y, 16 * at.z},
                         kVoxel * (1 + 4 * random_number(i, 5))});
    }
    const auto holed = std::make_shared<DifferenceField>(bar, balls(holes));
    // Walls of one and a half voxels around holes, and what is thinner where they meet.
    const auto walls = std::make_shared<DifferenceField>(
        std::make_shared<ShellField>(bar, 1.5 * kVoxel, 0), balls(holes));
    return {{"ball", balls({{{}, 1.2}})},
            {"straight bar", straight},
            {"holed bar", holed},
            {"walls as a level set", walls, true}};
}

using Face = std::array<Vec3, 3>;

bool before(const Vec3& a, const Vec3& b) {
    return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}

/// Triangles by their positions, whatever the numbers of these: sorted, each from its least corner.
std::vector<Face> faces(const TriMesh& mesh) {
    std::vector<Face> all;
    for (const Triangle& t : mesh.triangles) {
        Face f{mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
        std::rotate(f.begin(), std::min_element(f.begin(), f.end(), before), f.end());
        all.push_back(f);
    }
    std::sort(all.begin(), all.end(), [](const Face& a, const Face& b) {
        return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(), before);
    });
    return all;
}

/// Triangles of tiles, welded by position.
class Union {
public:
    void add(const TileSurface& tile) {
        for (std::size_t i = 0; i < tile.n_owned; ++i) {
            Triangle t = tile.mesh.triangles[i];
            for (std::uint32_t& v : t) {
                const Vec3& p = tile.mesh.positions[v];
                const auto [at, is_new] = numbers_.emplace(
                    std::tuple(p.x, p.y, p.z), static_cast<std::uint32_t>(mesh_.positions.size()));
                if (is_new)
                    mesh_.positions.push_back(p);
                v = at->second;
            }
            mesh_.triangles.push_back(t);
        }
    }
    /// Small pieces face outwards, as in the whole.
    TriMesh take() {
        turn_small_pieces(mesh_.positions, mesh_.triangles);
        return std::move(mesh_);
    }

private:
    std::map<std::tuple<double, double, double>, std::uint32_t> numbers_;
    TriMesh mesh_;
};

/// The voxels of a box and no others.
openvdb::FloatGrid::Ptr part(const openvdb::FloatGrid& grid, const CoordBBox& box) {
    const auto copy = grid.deepCopy();
    copy->tree().clip(box);
    return copy;
}

CoordBBox with_halo(const CoordBBox& tile, int halo) {
    CoordBBox given = tile;
    given.expand(halo);
    return given;
}

/// Tiles of edge x edge x 2 edge voxels.
TriMesh by_tiles(const openvdb::FloatGrid& grid, const Field* field, int edge,
                 const ExtractSettings& settings) {
    Union all;
    const Coord step(edge, edge, 2 * edge);
    std::set<Coord> places;
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf)
        for (int k = 0; k < 8; ++k) { // edges to a leaf begin in those before it
            Coord at = leaf->origin().offsetBy(-8 * (k >> 2), -8 * (k >> 1 & 1), -8 * (k & 1));
            for (int axis = 0; axis < 3; ++axis)
                at[axis] = static_cast<int>(std::floor(double(at[axis]) / step[axis])) * step[axis];
            places.insert(at);
        }
    for (const Coord& at : places) {
        const CoordBBox tile(at, at + step.offsetBy(-1));
        std::optional<TileSurface> own;
        for (int halo = kTileHalo_vox; halo <= 2 * kTileHalo_vox && !own; halo += 64) {
            const CoordBBox given = with_halo(tile, halo);
            own = extract_tile(*part(grid, given), given, tile, field, settings);
        }
        EXPECT_TRUE(own) << "tile " << at;
        if (own)
            all.add(*own);
    }
    return all.take();
}

void expect_equal(const TriMesh& tiles, const LabelledMesh& whole) {
    ASSERT_EQ(tiles.triangles.size(), whole.triangles.size());
    EXPECT_EQ(tiles.positions.size(), whole.positions.size());
    EXPECT_EQ(faces(tiles), faces({whole.positions, whole.triangles, {}}));
}

TEST(ExtractTile, TilesHaveAllOfTheWholeBitForBit) {
    for (const Case& c : cases()) {
        SCOPED_TRACE(c.name);
        const auto grid = clean(*rasterize(*c.field, kLattice)).solid;
        const Field* field = c.of_level_set ? nullptr : c.field.get();
        const LabelledMesh whole = extract(*grid, field, {0.5, 4});
        for (const int edge : {64, 40})
            expect_equal(by_tiles(*grid, field, edge, {0.5, 4}), whole);
    }
}

TEST(ExtractTile, TilesOfRecipesAtRandomHaveAllOfTheWhole) {
    std::size_t n = 0;
    for (std::uint64_t seed = 0; seed < 12; ++seed) {
        SCOPED_TRACE(seed);
        openvdb::FloatGrid::Ptr grid;
        try {
            grid = make_recipe(random_recipe(seed, kVoxel).text, "recipe", {}).solid;
        } catch (const Error&) { // its parts do not meet
            continue;
        }
        if (grid->empty())
            continue;
        expect_equal(by_tiles(*grid, nullptr, 24, {0.2, 4}), extract(*grid, nullptr, {0.2, 4}));
        ++n;
    }
    EXPECT_GT(n, 5u);
}

TEST(ExtractTile, IsTheSameOnOneThreadAndMany) {
    const Case c = cases()[1];
    const auto grid = rasterize(*c.field, kLattice);
    const CoordBBox tile({-32, -32, 0}, {31, 31, 63});
    const CoordBBox given = with_halo(tile, kTileHalo_vox);
    const auto many = extract_tile(*grid, given, tile, c.field.get());
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    const auto one = extract_tile(*grid, given, tile, c.field.get());
    ASSERT_TRUE(many && one);
    EXPECT_EQ(one->n_owned, many->n_owned);
    EXPECT_EQ(one->mesh.positions, many->mesh.positions);
    EXPECT_EQ(one->mesh.triangles, many->mesh.triangles);
}

TEST(ExtractTile, SaysWhenTooLittleIsGiven) {
    const Case c = cases()[2];
    const auto grid = rasterize(*c.field, kLattice);
    const CoordBBox tile({-32, -32, 0}, {31, 31, 63});
    for (const int halo : {0, 32, 56})
        EXPECT_FALSE(extract_tile(*grid, with_halo(tile, halo), tile, c.field.get()));
}

TEST(ExtractTile, IsEmptyWhereThereIsNoSurface) {
    const auto field = balls({{{}, 2}});
    const auto grid = rasterize(*field, kLattice);
    for (const Coord& at : {Coord(0, 0, 0), Coord(400, 0, 0)}) {
        const CoordBBox tile(at, at.offsetBy(15));
        const auto none = extract_tile(*grid, with_halo(tile, kTileHalo_vox), tile, field.get());
        ASSERT_TRUE(none);
        EXPECT_EQ(none->n_owned, 0u);
    }
}

TEST(ExtractTile, RefusesBoxesThatAreNotOfLeaves) {
    const auto field = balls({{{}, 0.5}});
    const auto grid = rasterize(*field, kLattice);
    const CoordBBox tile({0, 0, 0}, {7, 7, 7});
    for (const auto& [given, own] : {std::pair(with_halo(tile, 12), tile),
                                     std::pair(with_halo(tile, 8), CoordBBox({0, 0, 0}, {7, 7, 8})),
                                     std::pair(tile, with_halo(tile, 8))})
        try {
            extract_tile(*grid, given, own, field.get());
            FAIL() << "no exception";
        } catch (const Error& e) {
            EXPECT_EQ(e.fault(), Fault::bad_argument);
            EXPECT_THAT(e.what(), HasSubstr("whole leaves of 8 voxels"));
        }
}

} // namespace
} // namespace taihu
