#include "vdb_ops/kernels_detail.h"

// The plain version of the kernels under other names, beside the dispatched one.
#undef TAIHU_CLONES
#define TAIHU_CLONES
#define subtract_balls plain_subtract_balls
#define min_triangles plain_min_triangles
#define subtract_values plain_subtract_values
#define signed_roots plain_signed_roots
#define to_band plain_to_band
#define copy_band plain_copy_band
#define take_values plain_take_values
#define inside_voxels plain_inside_voxels
#include "vdb_ops/kernels.cpp" // NOLINT(bugprone-suspicious-include)
#undef subtract_balls
#undef min_triangles
#undef subtract_values
#undef signed_roots
#undef to_band
#undef copy_band
#undef take_values
#undef inside_voxels

#include <vector>

#include <gtest/gtest.h>

#include "stats/core/rng.h"
#include "stats/core/vec3.h"

namespace taihu {
namespace {

double number(std::uint64_t item, std::uint32_t draw) {
    return Rng{3, 5}.uniform(item, draw);
}

constexpr float kWidth = 3;
constexpr int kLeaf[3] = {8, 0, 16}; // in its block
constexpr std::uint32_t kAll[] = {0, 1, 2, 3};

/// Four balls about that leaf.
std::vector<LeafBall> some_balls(std::uint64_t trial) {
    std::vector<LeafBall> balls;
    for (std::uint32_t i = 0; i < 4; ++i)
        balls.push_back(
            {float(20 * number(trial, 4 * i) + 2), float(20 * number(trial, 4 * i + 1) - 6),
             float(20 * number(trial, 4 * i + 2) + 10), float(8 * number(trial, 4 * i + 3))});
    return balls;
}

std::vector<float> some_values(std::uint64_t trial, float limit) {
    std::vector<float> values;
    for (std::uint32_t i = 0; i < 512; ++i)
        values.push_back(limit * float(2.2 * number(trial, 100 + i) - 1.1));
    values[7] = limit, values[8] = -limit, values[9] = 0, values[10] = -0.f;
    return values;
}

LeafBits some_bits(std::uint64_t trial) {
    LeafBits bits{};
    for (std::uint32_t i = 0; i < 512; ++i)
        bits.word[i / 64] |= std::uint64_t{number(trial, 700 + i) < 0.8} << i % 64;
    return bits;
}

bool bit(const LeafBits& bits, std::size_t i) {
    return (bits.word[i / 64] >> i % 64 & 1) != 0;
}

TEST(Kernels, SubtractBallsIsTheDistanceToTheUnionInTheBand) {
    for (std::uint64_t trial = 0; trial < 200; ++trial) {
        const std::vector<LeafBall> balls = some_balls(trial);
        std::vector<float> plain(512, -kWidth);
        plain_subtract_balls(balls.data(), kAll, kAll + 4, kLeaf, -kWidth, plain.data());
        for (int v = 0; v < 512; ++v) {
            double exact = -kWidth;
            for (const auto& b : balls)
                exact =
                    std::max(exact, double(b.r) - length(Vec3{kLeaf[0] + v / 64 - double(b.x),
                                                              kLeaf[1] + v / 8 % 8 - double(b.y),
                                                              kLeaf[2] + v % 8 - double(b.z)}));
            // Float arithmetic on numbers below 32: about 4e-6.
            ASSERT_NEAR(plain[static_cast<std::size_t>(v)], exact, 1e-5);
        }
    }
}

TEST(Kernels, ToBandScalesHoldsAndMarks) {
    const std::vector<float> values = some_values(1, kWidth);
    float out[512];
    const LeafBits bits = plain_to_band(values.data(), kWidth, 0.5f, 0.5f * kWidth, out);
    for (std::size_t i = 0; i < 512; ++i) {
        ASSERT_EQ(out[i], std::clamp(0.5f * values[i], -0.5f * kWidth, 0.5f * kWidth));
        ASSERT_EQ(bit(bits, i), std::fabs(values[i]) < kWidth);
    }
}

TEST(Kernels, ValuesHeldToTheHalfWidthAreNotInTheBand) {
    std::vector<float> values(512, 3.f);
    std::fill_n(values.begin(), 256, -3.f);
    float out[512]; // 3 times 0.03f is less than 0.09f
    EXPECT_EQ(plain_to_band(values.data(), 3, 0.03f, 0.09f, out), LeafBits{});
    EXPECT_EQ(out[0], -0.09f);
    EXPECT_EQ(out[511], 0.09f);
}

TEST(Kernels, StoredValuesCountWhereTheyAreActive) {
    const std::vector<float> values = some_values(2, kWidth);
    const LeafBits active = some_bits(2);
    float copy[512], taken[512];
    const LeafBits bits = plain_copy_band(values.data(), active, kWidth, copy);
    plain_take_values(values.data(), active, kWidth, 2, taken);
    for (std::size_t i = 0; i < 512; ++i) {
        const bool on = bit(active, i) && std::fabs(values[i]) < kWidth;
        const float side = values[i] < 0 ? -kWidth : kWidth;
        ASSERT_EQ(bit(bits, i), on);
        ASSERT_EQ(copy[i], on ? values[i] : side);
        ASSERT_EQ(taken[i],
                  bit(active, i) && std::fabs(2 * values[i]) < kWidth ? 2 * values[i] : side);
    }
}

TEST(Kernels, InsideVoxelsOfAPlaneAreExact) {
    for (const double at : {2.0, 2.25, 3.5, 3.9}) { // inside is x < at, on a leaf of x from 0 to 7
        float values[512];
        for (int i = 0; i < 512; ++i)
            values[i] = float(0.1 * (i / 64 - at));
        // Voxel 0 reaches from -1/2 on. Floats of a few voxels: 1e-6 of 512.
        EXPECT_NEAR(plain_inside_voxels(values, 10), 64 * (at + 0.5), 1e-4) << at;
    }
}

TEST(Kernels, EveryInstructionSetGivesTheSameBits) {
    for (std::uint64_t trial = 0; trial < 500; ++trial) {
        const std::vector<LeafBall> balls = some_balls(trial);
        std::vector<float> a(512, -kWidth), b(512, -kWidth);
        plain_subtract_balls(balls.data(), kAll, kAll + 4, kLeaf, -kWidth, a.data());
        subtract_balls(balls.data(), kAll, kAll + 4, kLeaf, -kWidth, b.data());
        ASSERT_EQ(a, b);

        const std::vector<float> values = some_values(trial, kWidth);
        const LeafBits active = some_bits(trial);
        EXPECT_EQ(plain_to_band(values.data(), kWidth, 0.01f, 0.03f, a.data()),
                  to_band(values.data(), kWidth, 0.01f, 0.03f, b.data()));
        ASSERT_EQ(a, b);
        EXPECT_EQ(plain_copy_band(values.data(), active, kWidth, a.data()),
                  copy_band(values.data(), active, kWidth, b.data()));
        ASSERT_EQ(a, b);
        plain_take_values(values.data(), active, kWidth, 1.7f, a.data());
        take_values(values.data(), active, kWidth, 1.7f, b.data());
        ASSERT_EQ(a, b);
        ASSERT_EQ(plain_inside_voxels(values.data(), 1.7f), inside_voxels(values.data(), 1.7f));

        LeafTriangle t{};
        t.n_edges = 1 + static_cast<int>(trial % 3);
        Vec3 p[3];
        for (std::uint32_t k = 0; k < 3; ++k)
            p[k] = {12 * number(trial, 20 + 3 * k) - 2, 12 * number(trial, 21 + 3 * k) - 2,
                    12 * number(trial, 22 + 3 * k) - 2};
        const Vec3 n = normalized(cross(p[1] - p[0], p[2] - p[0]));
        for (int k = 0; k < 3; ++k) {
            const Vec3 e = p[(k + 1) % 3] - p[k], en = cross(n, e);
            for (int c = 0; c < 3; ++c)
                t.e[k][c] = float(e[c]), t.en[k][c] = float(en[c]);
            t.inverse_e2[k] = float(1 / length_squared(e));
        }
        for (int c = 0; c < 3; ++c) {
            for (int k = 0; k < 3; ++k)
                t.corner[k][c] = p[k][c];
            t.n[c] = n[c];
        }
        const std::uint32_t one = 0;
        const int origin[3] = {0, 0, 0};
        std::vector<float> c(512, 9.f), d(512, 9.f);
        plain_min_triangles(&t, &one, &one + 1, origin, 3, nullptr, c.data());
        min_triangles(&t, &one, &one + 1, origin, 3, nullptr, d.data());
        ASSERT_EQ(c, d);

        std::vector<std::int8_t> winding(512);
        for (std::uint32_t i = 0; i < 512; ++i)
            winding[i] = static_cast<std::int8_t>(3 * number(trial, 1300 + i) - 1);
        plain_signed_roots(c.data(), winding.data(), a.data());
        signed_roots(c.data(), winding.data(), b.data());
        ASSERT_EQ(a, b);
    }
}

TEST(Kernels, SignedRootsAreZeroOnTheSurface) {
    std::vector<float> squared(512, 4.f), out(512);
    std::vector<std::int8_t> winding(512, 0);
    squared[1] = squared[2] = 0.9e-10f; // nearer than 1e-5
    winding[2] = winding[3] = 1, winding[4] = -2;
    plain_signed_roots(squared.data(), winding.data(), out.data());
    EXPECT_EQ(out[0], 2);
    EXPECT_EQ(out[1], 0);
    EXPECT_EQ(out[2], 0);
    EXPECT_EQ(out[3], -2);
    EXPECT_EQ(out[4], -2);
}

} // namespace
} // namespace taihu
