#include "vdb_ops/volume.h"

#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/grids.h"

namespace taihu {
namespace {

TEST(Volume, OfABallConvergesFasterThanTheVoxelSquared) {
    for (const double r_vox : {6.0, 12.0, 24.0, 48.0}) {
        const double exact = 4.0 / 3 * std::numbers::pi;
        const double error = std::fabs(volume_m3(*ball_rock(1, 1 / r_vox)) - exact) / exact;
        EXPECT_LT(error, 0.05 / (r_vox * r_vox)) << r_vox;
    }
}

} // namespace
} // namespace taihu
