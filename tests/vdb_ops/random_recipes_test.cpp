// Recipes at random against their own formulas, at every voxel of a dense grid. `random_recipes N`
// runs N of them and prints what it saw; the test runs a fixed few.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include "stats/core/error.h"
#include "tests/support/random_recipe.h"
#include "vdb_ops/recipe_solid.h"

namespace taihu {
namespace {

constexpr double kVoxel = 0.05; // 40 voxels across
constexpr int kReach = 22;      // voxels from the origin to the faces of the dense grid

struct Counts {
    int n = 0, n_awkward = 0, n_empty = 0, n_tiny = 0;
    double worst_vox = 0;  ///< of a distance in the band
    int n_wrong_signs = 0; ///< of voxels farther than 1e-3 voxels from the surface
    std::map<std::string, int> kinds;
};

void judge(const RandomRecipe& recipe, const openvdb::FloatGrid& grid, Counts& counts) {
    const double band = 3 * kVoxel;
    auto values = grid.getConstAccessor();
    for (int x = -kReach; x <= kReach; ++x)
        for (int y = -kReach; y <= kReach; ++y)
            for (int z = -kReach; z <= kReach; ++z) {
                const double truth = recipe.distance_m({x * kVoxel, y * kVoxel, z * kVoxel});
                const double found = static_cast<double>(values.getValue({x, y, z}));
                if (std::fabs(truth) > 1e-3 * kVoxel && (truth < 0) != (found < 0))
                    ++counts.n_wrong_signs;
                const double clamped = std::clamp(truth, -band, band);
                counts.worst_vox = std::max(counts.worst_vox, std::fabs(found - clamped) / kVoxel);
            }
}

Counts run_recipes(std::uint64_t first, std::uint64_t n) {
    Counts counts;
    for (std::uint64_t seed = first; seed < first + n; ++seed) {
        const RandomRecipe recipe = random_recipe(seed, kVoxel);
        ++counts.n;
        counts.n_awkward += recipe.awkward;
        for (const std::string& kind : recipe.kinds)
            ++counts.kinds[kind];
        const std::string where = "recipe " + std::to_string(seed);
        try {
            judge(recipe, *make_recipe(recipe.text, where, {}).solid, counts);
        } catch (const Error& e) { // parts that do not meet, or all but so: no voxel may be inside
            const std::string what = e.what();
            if (what.find("voxels long, must be at least 4") != std::string::npos) {
                ++counts.n_tiny;
                continue;
            }
            if (what.find("is empty") == std::string::npos)
                throw;
            ++counts.n_empty;
            const double worst = counts.worst_vox; // a near miss has distances, but no level set
            judge(recipe, *openvdb::FloatGrid::create(static_cast<float>(3 * kVoxel)), counts);
            counts.worst_vox = worst;
        }
    }
    return counts;
}

TEST(RandomRecipes, AgreeWithTheirFormulasAtEveryVoxel) {
    const Counts counts = run_recipes(0, 60);
    EXPECT_EQ(counts.n_wrong_signs, 0);
    EXPECT_LE(counts.worst_vox, 1e-3); // floats of voxels: 1e-5 and less; the bar is 1e-3
    EXPECT_EQ(counts.n_awkward, 12);
    for (const char* kind : {"union", "intersection", "difference", "transform", "offset", "shell",
                             "embed", "holes", "plane", "blend"})
        EXPECT_GE(counts.kinds.at(kind), 3) << kind; // 5 % of them
}

} // namespace
} // namespace taihu

int main(int argc, char** argv) {
    openvdb::initialize();
    if (argc == 2 && argv[1][0] != '-') {
        const auto c = taihu::run_recipes(0, std::strtoull(argv[1], nullptr, 10));
        std::printf("%d recipes, %d awkward, %d empty, %d refused as too small for the voxel: "
                    "worst distance %.2e voxels, %d wrong signs\n",
                    c.n, c.n_awkward, c.n_empty, c.n_tiny, c.worst_vox, c.n_wrong_signs);
        for (const auto& [kind, n] : c.kinds)
            std::printf("%-14s in %5.1f %%\n", kind.c_str(), 100.0 * n / c.n);
        return c.n_wrong_signs > 0 || c.worst_vox > 1e-3;
    }
    testing::InitGoogleTest(&argc, argv);
    return RUN_ALL_TESTS();
}
