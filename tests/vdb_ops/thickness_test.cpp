#include "vdb_ops/thickness_detail.h"

#include <functional>

#include <gtest/gtest.h>

#include "tests/support/dense.h"

namespace taihu {
namespace {

/// Mean local thickness of a solid in the middle of a cube of samples.
double mean_thickness(int n, const std::function<double(const Vec3&)>& distance, double* greatest) {
    const DenseLattice lattice = cube_lattice(n);
    const std::vector<float> d = distances(lattice, distance);
    double sum = 0, count = 0;
    const SizeCounts sizes = local_thickness(lattice, d, nullptr);
    std::uint64_t n_inside = 0;
    for (const float v : d)
        n_inside += v < 0;
    for (const auto& [diameter, k] : sizes) {
        sum += static_cast<double>(diameter) * static_cast<double>(k);
        count += static_cast<double>(k);
    }
    EXPECT_EQ(static_cast<std::uint64_t>(count), n_inside);
    if (greatest)
        *greatest = static_cast<double>(sizes.back().first);
    return sum / count;
}

TEST(Thickness, OfABallIsItsDiameter) {
    for (const Vec3& c : {Vec3{32, 32, 32}, Vec3{32.5, 32.5, 32.5}, Vec3{31.7, 32.2, 32.4}}) {
        double greatest = 0;
        const double mean = mean_thickness(
            64, [&](const Vec3& p) { return length(p - c) - 20.3; }, &greatest);
        // Low by one sample at most, as the header says.
        EXPECT_NEAR(greatest, 40.6 - 0.4, 0.6);
        EXPECT_NEAR(mean, 40.6 - 0.4, 0.6);
    }
}

TEST(Thickness, OfASlabIsItsThicknessWhateverItsPlace) {
    for (const double thickness : {3.0, 7.3, 12.0})
        for (const Vec3& normal : {Vec3{0, 0, 1}, Vec3{0, 1, 1}, Vec3{1, 2, 3}}) {
            const Vec3 n = normalized(normal);
            // A disc of radius 26, rounded by nothing: its rim is thinner only near the corner.
            const double mean = mean_thickness(
                64,
                [&](const Vec3& p) {
                    const Vec3 d = p - Vec3{31.8, 32.3, 31.6};
                    const double h = std::abs(dot(d, n)) - thickness / 2;
                    return std::max(h, length(d - n * dot(d, n)) - 26);
                },
                nullptr);
            // The rim's corners, out of reach of any ball: below 0.2 thickness^2 along 2 pi 26, so
            // 1.5 % of the volume at half the thickness; distances are off by 0.1.
            EXPECT_NEAR(mean, thickness, 0.02 * thickness + 0.1) << thickness << ' ' << normal.x;
        }
}

TEST(Thickness, OfABallWithAHandleHasBoth) {
    double greatest = 0;
    const double mean = mean_thickness(
        72,
        [](const Vec3& p) {
            const Vec3 d = p - Vec3{20.4, 36, 36};
            const double rod = std::max(std::hypot(d.y, d.z) - 4.2, std::abs(d.x - 22) - 22);
            return std::min(length(d) - 16.2, rod);
        },
        &greatest);
    EXPECT_NEAR(greatest, 32.4, 1);
    // Volumes of the ball and of the rod outside it, times their diameters.
    const double ball = 4.0 / 3 * 3.14159 * std::pow(16.2, 3), rod = 3.14159 * 4.2 * 4.2 * 28.2;
    EXPECT_NEAR(mean, (32.4 * ball + 8.4 * rod) / (ball + rod), 0.8);
}

} // namespace
} // namespace taihu
