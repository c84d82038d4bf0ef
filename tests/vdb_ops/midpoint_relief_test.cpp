#include "vdb_ops/midpoint_relief.h"

#include <cmath>
#include <functional>

#include <tbb/global_control.h>

#include "tests/support/errors.h"
#include "vdb_ops/relief_math_detail.h"

namespace taihu {
namespace {

MidpointSettings tile(int levels, double hurst = 0.5, std::uint64_t seed = 1) {
    MidpointSettings s;
    s.levels = levels;
    s.hurst = hurst;
    s.seed = seed;
    return s;
}

/// What a midpoint of stage n was moved from, and how far: called for edges and centres.
using Visit = std::function<void(double height, std::initializer_list<double> ends)>;

void for_each_midpoint(const Image& f, int levels, int stage, const Visit& visit) {
    const int half = 1 << (levels - stage - 1);
    const auto at = [&](int x, int y) { return double{*f.at(x % f.width, y % f.height)}; };
    for (int y = 0; y < f.height; y += half)
        for (int x = 0; x < f.width; x += half) {
            const bool odd_x = x / half % 2, odd_y = y / half % 2;
            if (odd_x && odd_y)
                visit(at(x, y), {at(x - half, y - half), at(x + half, y - half),
                                 at(x - half, y + half), at(x + half, y + half)});
            else if (odd_x)
                visit(at(x, y), {at(x - half, y), at(x + half, y)});
            else if (odd_y)
                visit(at(x, y), {at(x, y - half), at(x, y + half)});
        }
}

double mean(std::initializer_list<double> values) {
    double sum = 0;
    for (const double v : values)
        sum += v;
    return sum / static_cast<double>(values.size());
}

/// Moments of the displacements of one stage.
struct Moments {
    double n = 0, absolute = 0, second = 0, fourth = 0, greatest = 0;

    Moments(const Image& f, int levels, int stage) {
        for_each_midpoint(f, levels, stage, [&](double h, std::initializer_list<double> ends) {
            const double d = h - mean(ends);
            n += 1, absolute += std::abs(d), second += d * d, fourth += d * d * d * d;
            greatest = std::max(greatest, std::abs(d));
        });
        absolute /= n, second /= n, fourth /= n;
    }
    double kurtosis() const { return fourth / (second * second); }
};

TEST(SeedRow, T07WithoutDisplacementCornersGiveTheBilinearSurface) {
    MidpointSettings s = tile(6);
    s.amplitude_m = 0;
    s.corners_m = {1, -2, 4, 0.5};
    const Image f = midpoint_heights(s);
    for (int y = 0; y <= 64; ++y)
        for (int x = 0; x <= 64; ++x) {
            const double u = x / 64.0, v = y / 64.0;
            const double bilinear = (1 - v) * ((1 - u) * 1 + u * -2) + v * ((1 - u) * 4 + u * 0.5);
            EXPECT_FLOAT_EQ(*f.at(x, y), static_cast<float>(bilinear));
        }
}

TEST(SeedRow, T07EveryLevelDoublesTheLatticeAndKeepsWhatThereWas) {
    for (int k = 0; k < 7; ++k) {
        const Image coarse = midpoint_heights(tile(k)), fine = midpoint_heights(tile(k + 1));
        ASSERT_EQ(coarse.width, (1 << k) + 1);
        ASSERT_EQ(coarse.height, (1 << k) + 1);
        for (int y = 0; y < coarse.height; ++y)
            for (int x = 0; x < coarse.width; ++x)
                ASSERT_EQ(*coarse.at(x, y), *fine.at(2 * x, 2 * y));
    }
}

TEST(SeedRow, T07PointsAreMovedFromTheMeanOfEndsAndCornersByHalfOfSAtMost) {
    constexpr int kLevels = 8;
    const Image f = midpoint_heights(tile(kLevels, 0.7));
    for (int stage = 0; stage < kLevels; ++stage) {
        const Moments d(f, kLevels, stage);
        // In single precision heights are off by up to 6e-8 of their size, which is 1.
        EXPECT_LE(d.greatest, 0.5 * std::pow(2, -0.7 * stage) + 3e-7) << stage;
    }
    // 2 / 3 of the points of the last stage lie on edges, 1 / 3 in centres: both are in use.
    EXPECT_EQ(Moments(f, kLevels, kLevels - 1).n, 257 * 257 - 129 * 129);
}

TEST(SeedRow, T07PatchesShareTheirEdges) {
    // Neighbours that disagreed about an edge would differ where it is the middle of the tile: each
    // midpoint there follows from the ends of its edge, whichever patch asks.
    MidpointSettings s = tile(5);
    s.patches = 4;
    s.amplitude_m = 0.01;
    s.corners_m.assign(25, 0);
    s.corners_m[12] = 1; // the corner in the middle of all
    const Image f = midpoint_heights(s);
    ASSERT_EQ(f.width, 129);
    for (int k = 0; k <= 32; ++k) // on its four edges heights fall to 0, in the other patches' way
        for (const float h : {*f.at(64 + k, 64), *f.at(64 - k, 64), *f.at(64, 64 + k)})
            EXPECT_NEAR(h, 1 - k / 32.0, 0.05); // ten stages of at most 0.005
}

TEST(SeedRow, T08ScalesFallByTwoToTheMinusH) {
    for (const double h : {0.0, 0.25, 0.5, 1.0, 1.7, 2.0}) {
        double s = 1;
        for (int n = 0; n <= 13; ++n, s *= half_to_the(h))
            EXPECT_NEAR(s / std::pow(2, -n * h), 1, 1e-14) << h; // 13 roundings of 4 units
    }
    constexpr int kLevels = 9;
    for (const double h : {0.3, 0.8}) {
        const Image f = midpoint_heights(tile(kLevels, h));
        for (int stage = 5; stage < kLevels; ++stage) {
            const Moments d(f, kLevels, stage);
            const double expected = std::pow(2, -2 * stage * h) / 12;
            // The variance of n squares of uniform numbers is 0.8 / n of their mean squared.
            EXPECT_NEAR(d.second / expected, 1, 4 * std::sqrt(0.8 / d.n)) << h << ' ' << stage;
        }
    }
}

TEST(SeedRow, T09UniformDrawsHaveNoTailsAndLargerSteps) {
    constexpr int kLevels = 9;
    MidpointSettings s = tile(kLevels);
    const Moments uniform(midpoint_heights(s), kLevels, kLevels - 1);
    s.draws = MidpointDraws::gaussian;
    const Moments gaussian(midpoint_heights(s), kLevels, kLevels - 1);
    // Standard errors of a kurtosis from 2e5 numbers: below 0.011 for a normal law.
    EXPECT_NEAR(uniform.kurtosis(), 1.8, 0.02);
    EXPECT_NEAR(gaussian.kurtosis(), 3.0, 0.05);
    EXPECT_NEAR(uniform.second / gaussian.second, 1, 0.02); // of the same variance
    EXPECT_GT(uniform.absolute, 1.06 * gaussian.absolute);  // sqrt(3) / 2 against sqrt(2 / pi)
}

TEST(SeedRow, T13MidpointsOfACastingLieBetweenTheirNeighbours) {
    constexpr int kLevels = 8;
    for (const double h : {0.0, 0.4}) {
        MidpointSettings s = tile(kLevels, h);
        s.law = MidpointLaw::between;
        const Image f = midpoint_heights(s);
        double greatest_share = 0;
        for (int stage = 0; stage < kLevels; ++stage)
            for_each_midpoint(f, kLevels, stage, [&](double z, std::initializer_list<double> ends) {
                const double lo = std::min(ends), hi = std::max(ends);
                ASSERT_GE(z, lo);
                ASSERT_LE(z, hi);
                if (hi - lo > 0.1)
                    greatest_share = std::max(greatest_share, std::abs(z - mean(ends)) / (hi - lo));
            });
        EXPECT_GT(greatest_share, 0.3) << h; // they do leave the mean
    }
}

/// Share of the steps between neighbours that are below a twentieth of the typical one.
double flat_share(const Image& f) {
    double squares = 0, n = 0, flat = 0;
    const auto each = [&](auto&& use) {
        for (int y = 0; y < f.height; ++y)
            for (int x = 1; x < f.width; ++x)
                use(double{*f.at(x, y)} - *f.at(x - 1, y));
    };
    each([&](double d) { squares += d * d, n += 1; });
    each([&](double d) { flat += std::abs(d) < 0.05 * std::sqrt(squares / n); });
    return flat / n;
}

TEST(SeedRow, T13ACastingHasWiderFlats) {
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
        for (const double h : {0.0, 0.3}) {
            MidpointSettings s = tile(8, h, seed);
            s.patches = 4;
            const double rock = flat_share(midpoint_heights(s));
            s.law = MidpointLaw::between;
            // Of normal steps 4 % are as small, and of those of rocks hardly more.
            EXPECT_LT(rock, 0.06) << seed << ' ' << h;
            EXPECT_GT(flat_share(midpoint_heights(s)), 2 * rock) << seed << ' ' << h;
        }
    }
}

TEST(MidpointRelief, TileableEdgesContinue) {
    // The law of stage n holds across the edges as anywhere: for_each_midpoint() wraps.
    for (const MidpointLaw law : {MidpointLaw::free, MidpointLaw::between}) {
        MidpointSettings s = tile(5, 0.9);
        s.patches = 3;
        s.tileable = true;
        s.law = law;
        const Image f = midpoint_heights(s);
        ASSERT_EQ(f.width, 96);
        for (int stage = 0; stage < 5; ++stage)
            for_each_midpoint(f, 5, stage, [&](double z, std::initializer_list<double> ends) {
                if (law == MidpointLaw::between) {
                    ASSERT_GE(z, std::min(ends));
                    ASSERT_LE(z, std::max(ends));
                } else {
                    ASSERT_LE(std::abs(z - mean(ends)), 0.5 * std::pow(2, -0.9 * stage) + 3e-7);
                }
            });
    }
}

TEST(MidpointRelief, IsTheSameOnOneThreadAndMany) {
    const Image many = midpoint_heights(tile(8));
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(midpoint_heights(tile(8)).pixels, many.pixels);
    EXPECT_NE(midpoint_heights(tile(8, 0.5, 2)).pixels, many.pixels);
}

TEST(MidpointRelief, NamesWhatIsOutOfRange) {
    const auto refused = [](const std::string& part,
                            const std::function<void(MidpointSettings&)>& f) {
        MidpointSettings s = tile(3);
        f(s);
        expect_error(Fault::bad_argument, part, [&] { midpoint_heights(s); });
    };
    refused("hurst is 2.5, must be 0..2", [](auto& s) { s.hurst = 2.5; });
    refused("hurst is nan", [](auto& s) { s.hurst = NAN; });
    refused("amplitude_m is -1", [](auto& s) { s.amplitude_m = -1; });
    refused("2 patches of 13 levels", [](auto& s) { s.patches = 2, s.levels = 13; });
    refused("1 patches of -1 levels", [](auto& s) { s.levels = -1; });
    refused("3 corners are given; 1 patches a side have 4", [](auto& s) {
        s.corners_m = {1, 2, 3};
    });
    refused("a corner is inf m high", [](auto& s) { s.corners_m = {1, 2, 3, INFINITY}; });
    refused("Gaussian draws do not", [](auto& s) {
        s.law = MidpointLaw::between;
        s.draws = MidpointDraws::gaussian;
    });
}

TEST(ReliefMath, WavesAreThoseOfTheLibrary) {
    for (double t = -3; t < 3; t += 0.0137) {
        const auto [c, s] = cos_sin_turns(t);
        EXPECT_NEAR(c, std::cos(2 * M_PI * t), 4e-15); // 2 pi t itself is rounded
        EXPECT_NEAR(s, std::sin(2 * M_PI * t), 4e-15);
    }
    EXPECT_EQ(cos_sin_turns(0.25), (std::array<double, 2>{0, 1}));
    EXPECT_EQ(cos_sin_turns(-0.5), (std::array<double, 2>{-1, 0}));
}

} // namespace
} // namespace taihu
