#include "vdb_ops/random_lines_detail.h"

#include <cmath>

#include <gtest/gtest.h>

namespace taihu {
namespace {

const Box kBox{{0, 0, 0}, {2, 1, 1}};

/// Layers 0.1 thick across an axis, solid and hole in turn, inside the box.
Probe layers(int axis) {
    return [axis](const Vec3& p) -> Spot {
        double border = 1;
        for (int a = 0; a < 3; ++a)
            border = std::min({border, p[a] - kBox.lo[a], kBox.hi[a] - p[a]});
        if (border <= 0)
            return {Phase::outside, -border};
        const double layer = p[axis] / 0.1, below = layer - std::floor(layer);
        return {static_cast<int>(layer) % 2 ? Phase::hole : Phase::solid,
                std::min(border, 0.1 * std::min(below, 1 - below))};
    };
}

LineSums lines(const Probe& probe, std::uint64_t n) {
    return measure_lines(
        {kBox, n, 1e-3, 0.05, Rng{7, 1}}, [&] { return probe; }, nullptr);
}

struct Totals {
    double length = 0, hole = 0, n = 0;
    explicit Totals(const LineSums& sums) {
        for (const LineSums::Block& block : sums.blocks) {
            length += block.length_m;
            hole += block.hole_m;
            n += block.n_crossings;
        }
    }
};

TEST(RandomLines, HaveNoDirection) {
    for (int axis = 0; axis < 3; ++axis) {
        const LineSums sums = lines(layers(axis), 4000);
        const Totals t(sums);
        // A surface every 0.1: half as many crossings per length as square metres per volume. The
        // faces of the box itself are none of them.
        const double s_v = (kBox.size()[axis] / 0.1 - 1) / kBox.size()[axis];
        const double r = t.n / t.length;
        const double se = std::sqrt(sums.nn - 2 * r * sums.nl + r * r * sums.ll) / t.length;
        EXPECT_NEAR(r, s_v / 2, 4 * se) << axis;
        EXPECT_LT(se, 0.03 * s_v) << axis;
        EXPECT_NEAR(t.hole / t.length, 0.5, 0.03) << axis; // 2000 lines of ten layers each
    }
}

TEST(RandomLines, FillTheBoxEvenly) {
    const LineSums sums = lines(layers(0), 20'000);
    const Totals t(sums);
    // Mean chord of the box 4 V / S, among lines that meet the ball of radius sqrt(6) / 2 round it:
    // a share S / (4 pi r^2) of them meets the box.
    EXPECT_NEAR(t.length / 20'000, 4 * 2 / (4 * 3.14159 * 1.5), 0.01);
    for (const LineSums::Block& block : sums.blocks) // a line in twenty, half a block long
        EXPECT_NEAR(block.length_m, t.length / 64, 0.15 * t.length / 64);
}

TEST(RandomLines, PairsOfLayersComeAndGo) {
    const LineSums sums = lines(layers(0), 4000);
    // At a distance r and an angle with cosine u, uniform in 0..1, layers are u r apart: the mean
    // of the triangle wave of period 0.2 from 1/2 to 0, by a sum over u.
    for (const std::size_t k : {std::size_t{0}, std::size_t{1}, std::size_t{5}}) {
        const double r = 0.05 * static_cast<double>(k + 1);
        double exact = 0;
        for (int i = 0; i < 1000; ++i) {
            const double phase = (i + 0.5) / 1000 * r / 0.2,
                         off = std::abs(phase - std::round(phase));
            exact += (0.5 - off) / 1000;
        }
        EXPECT_NEAR(sums.pairs[k].holes_m / sums.pairs[k].all_m, exact, 0.02) << r;
    }
    // Pairs in one block count once in it, others in both.
    double of_blocks = 0;
    for (const LineSums::Block& block : sums.blocks)
        of_blocks += block.pairs[0].all_m;
    EXPECT_GT(of_blocks, sums.pairs[0].all_m);
    EXPECT_LT(of_blocks, 2 * sums.pairs[0].all_m);
}

TEST(RandomLines, ChordsAreSeenFromBothEnds) {
    const LineSums sums = lines(layers(1), 2000);
    double whole = 0, cut = 0;
    for (std::size_t i = 0; i < LineSums::kBins; ++i) {
        EXPECT_EQ(sums.hole.whole[i] % 2, 0u);
        whole += static_cast<double>(sums.hole.whole[i] + sums.solid.whole[i]);
        cut += static_cast<double>(sums.hole.cut[i] + sums.solid.cut[i]);
        if (sums.bin_m * static_cast<double>(i + 1) < 0.1) { // no layer is thinner
            EXPECT_EQ(sums.hole.whole[i], 0u);
        }
    }
    EXPECT_EQ(whole + cut, 2 * Totals(sums).n); // each crossing ends a chord and begins one
}

} // namespace
} // namespace taihu
