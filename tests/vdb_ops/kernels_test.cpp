#include "vdb_ops/kernels_detail.h"

// The plain version of the kernels under other names, beside the dispatched one.
#undef TAIHU_CLONES
#define TAIHU_CLONES
#define min_balls plain_min_balls
#define min_triangles plain_min_triangles
#define subtract_values plain_subtract_values
#define band_bits plain_band_bits
#define scale_values plain_scale_values
#include "vdb_ops/kernels.cpp" // NOLINT(bugprone-suspicious-include)
#undef min_balls
#undef min_triangles
#undef subtract_values
#undef band_bits
#undef scale_values

#include <vector>

#include <gtest/gtest.h>

#include "stats/core/rng.h"
#include "stats/core/vec3.h"

namespace taihu {
namespace {

double number(std::uint64_t item, std::uint32_t draw) {
    return Rng{3, 5}.uniform(item, draw);
}

TEST(Kernels, MinBallsIsTheDistanceToTheUnionInTheBand) {
    constexpr float kWidth = 3;
    for (std::uint64_t trial = 0; trial < 200; ++trial) {
        std::vector<LeafBall> balls;
        for (std::uint32_t i = 0; i < 4; ++i)
            balls.push_back(
                {float(20 * number(trial, 4 * i) - 6), float(20 * number(trial, 4 * i + 1) - 6),
                 float(20 * number(trial, 4 * i + 2) - 6), float(8 * number(trial, 4 * i + 3))});
        std::vector<float> plain(512, kWidth);
        plain_min_balls(balls.data(), balls.size(), kWidth, plain.data());
        for (int v = 0; v < 512; ++v) {
            double exact = kWidth;
            for (const auto& b : balls)
                exact = std::min(exact, length(Vec3{v / 64 - double(b.x), v / 8 % 8 - double(b.y),
                                                    v % 8 - double(b.z)}) -
                                            double(b.r));
            // Float arithmetic on numbers below 32: about 4e-6.
            ASSERT_NEAR(plain[static_cast<std::size_t>(v)], exact, 1e-5);
        }
    }
}

TEST(Kernels, EveryInstructionSetGivesTheSameBits) {
    for (std::uint64_t trial = 0; trial < 500; ++trial) {
        std::vector<LeafBall> balls;
        for (std::uint32_t i = 0; i < 4; ++i)
            balls.push_back(
                {float(20 * number(trial, 4 * i) - 6), float(20 * number(trial, 4 * i + 1) - 6),
                 float(20 * number(trial, 4 * i + 2) - 6), float(8 * number(trial, 4 * i + 3))});
        std::vector<float> a(512, 3.f), b(512, 3.f);
        plain_min_balls(balls.data(), balls.size(), 3, a.data());
        min_balls(balls.data(), balls.size(), 3, b.data());
        ASSERT_EQ(a, b);

        LeafTriangle t{};
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
    }
}

} // namespace
} // namespace taihu
