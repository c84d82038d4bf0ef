// Many small recipes one after the other in one process, as a service that never ends makes them:
// what they held is given back. `long_run N` makes N of them and prints what it saw.
#include <cstdio>
#include <cstdlib>

#include <gtest/gtest.h>
#include <malloc.h>
#include <unistd.h>

#include "mesh_out/surface_file.h"
#include "tests/support/random_solid.h"
#include "vdb_ops/recipe_solid.h"

namespace taihu {
namespace {

constexpr double kVoxel = 2.0 / 12; // 12 voxels across
constexpr double kMostGrowth = 0.01;

/// Bytes that were asked for and not given back.
std::size_t held_bytes() {
    const auto info = mallinfo2();
    return info.uordblks + info.hblkhd;
}

void make(std::uint64_t seed) {
    const std::string recipe = random_solid(seed, kVoxel).text;
    const RecipeSolid solid = make_recipe(recipe, "recipe", {});
    const SurfaceFile file = format_surface(*solid.solid, solid.field.get(), MeshFormat::ply,
                                            {.max_error_m = 0.5 * kVoxel}, recipe);
    ASSERT_FALSE(file.bytes.empty()) << seed;
}

/// \return what is held after `n` recipes to what was held after the first `n_first`.
double growth(std::uint64_t n_first, std::uint64_t n) {
    std::size_t first = 0;
    for (std::uint64_t seed = 0; seed < n; ++seed) {
        make(seed);
        if (seed + 1 == n_first)
            first = held_bytes();
    }
    const std::size_t last = held_bytes();
    std::printf("held after %llu recipes %zu bytes, after %llu recipes %zu\n",
                static_cast<unsigned long long>(n_first), first, static_cast<unsigned long long>(n),
                last);
    return double(last) / double(first) - 1;
}

TEST(LongRun, GivesBackWhatItHeld) {
#ifdef TAIHU_SANITIZED
    GTEST_SKIP() << "memory is the sanitizer's, which looks for leaks itself";
#endif
    EXPECT_LE(growth(50, 100), kMostGrowth);
}

} // namespace
} // namespace taihu

int main(int argc, char** argv) {
    // Small pieces that each thread keeps for itself would count as held, so it keeps none.
    if (!std::getenv("GLIBC_TUNABLES")) {
        ::setenv("GLIBC_TUNABLES", "glibc.malloc.tcache_count=0", 1);
        ::execv("/proc/self/exe", argv);
    }
    openvdb::initialize();
    testing::InitGoogleTest(&argc, argv);
    if (argc < 2)
        return RUN_ALL_TESTS();
    return taihu::growth(50, std::strtoull(argv[1], nullptr, 10)) > taihu::kMostGrowth;
}
