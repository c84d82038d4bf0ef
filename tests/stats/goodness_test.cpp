#include "stats/goodness.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <boost/math/special_functions/bessel.hpp>

#include "stats/fit.h"
#include "stats/section_draws.h"
#include "tests/support/errors.h"

namespace taihu {
namespace {

constexpr std::size_t kRock = 46; // profiles of the thesis' rock

// Maximum likelihood of the rate of exponential spheres: the root of the derivative of
// n log(rate^2) + sum log K0(rate d) - n log(rate d0 K1(rate d0)), by Newton's method.
Law exponential_of(std::span<const double> diameters, double limit) {
    const auto ratio = [](int over, double x) { // K_over / K_(1 - over)
        return boost::math::cyl_bessel_k(over, x) / boost::math::cyl_bessel_k(1 - over, x);
    };
    const auto n = static_cast<double>(diameters.size());
    double mean = 0;
    for (const double d : diameters)
        mean += d / n;
    double rate = std::numbers::pi / (2 * mean);
    for (int i = 0; i < 50; ++i) {
        double slope = 2 * n / rate, bend = -2 * n / (rate * rate);
        for (const double d : diameters) { // (K1 / K0)' = (K1 / K0)^2 - 1 - K1 / K0 / x
            const double q = ratio(1, rate * d);
            slope -= d * q;
            bend -= d * d * (q * q - 1 - q / (rate * d));
        }
        if (limit > 0) { // (K0 / K1)' = -1 + (K0 / K1)^2 + K0 / K1 / x
            const double q = ratio(0, rate * limit);
            slope += n * limit * q;
            bend += n * limit * limit * (q * q - 1 + q / (rate * limit));
        }
        const double step = std::clamp(-slope / bend, -rate / 2, rate);
        rate += step;
        if (std::abs(step) < 1e-9 * rate)
            break;
    }
    return Law::exponential(rate);
}

Law exponential_refit(const Sample& sample) {
    return exponential_of(sample.diameters, *sample.detection_limit);
}

Sample sample_of(std::vector<double> diameters, double limit = 0) {
    Sample sample;
    sample.diameters = std::move(diameters);
    sample.detection_limit = limit;
    return sample;
}

std::vector<double> profiles(const Law& law, std::size_t n, std::uint64_t seed, double limit = 0) {
    const SectionDraws draws(law, limit);
    std::vector<double> d(n);
    for (std::size_t i = 0; i < n; ++i)
        d[i] = draws.diameter({seed, 77}, i);
    return d;
}

Goodness rock_test(const std::vector<double>& d, std::uint64_t n_resamples) {
    return goodness(sample_of(d), exponential_of(d, 0), exponential_refit, {n_resamples, 5});
}

TEST(Goodness, StatisticsOfThreeProfilesAreThoseByHand) {
    // Spheres of diameter 1: F2 = 1 - sqrt(1 - d^2); these three lie at its shares .1, .5, .8.
    std::vector<double> d;
    for (const double u : {0.5, 0.1, 0.8})
        d.push_back(std::sqrt(1 - (1 - u) * (1 - u)));
    const GoodnessStatistics s = goodness_statistics(sample_of(d), Law::constant(1));
    EXPECT_NEAR(s.kolmogorov_smirnov, 1.0 / 3 - 0.1, 1e-12);
    EXPECT_NEAR(s.cramer_von_mises,
                1.0 / 36 + std::pow(0.1 - 1.0 / 6, 2) + std::pow(0.8 - 5.0 / 6, 2), 1e-12);
    const double sum = std::log(0.1 * 0.2) + 3 * std::log(0.5 * 0.5) + 5 * std::log(0.8 * 0.9);
    EXPECT_NEAR(s.anderson_darling, -3 - sum / 3, 1e-12);
    EXPECT_NEAR(s.chi_squared, 1 / 1.5 * 0.5,
                1e-12); // two cells: 1 below the median, 2 at or above
}

// 5 % critical values at 46 profiles and a fitted rate: STEREOLOGY's 2000 runs gave AD 1.20,
// KS .149, CvM .195. The density of the statistics there makes a standard error of about 0.04,
// 0.002 and 0.007 for 2000 runs on either side; three of the difference of two such.
TEST(Goodness, CriticalValuesOfTheExponentialAreKnown) {
    const Goodness g = rock_test(profiles(Law::exponential(3), kRock, 1), 2000);
    EXPECT_EQ(g.n_resamples, 2000u);
    EXPECT_EQ(g.n_failed, 0u);
    EXPECT_NEAR(g.anderson_darling.critical, 1.20, 0.15);
    EXPECT_NEAR(g.kolmogorov_smirnov.critical, 0.149, 0.008);
    EXPECT_NEAR(g.cramer_von_mises.critical, 0.195, 0.03);
}

TEST(Goodness, RejectsATrueLawAboutOnceInTwenty) {
    constexpr int kRuns = 1500;
    // Scale-free: one bootstrap's critical values serve every exponential sample.
    const Goodness g = rock_test(profiles(Law::exponential(1), kRock, 2), 1500);
    int ad = 0, ks = 0, cvm = 0, chi = 0;
    for (std::uint64_t run = 0; run < kRuns; ++run) {
        const auto d = profiles(Law::exponential(1), kRock, 1000 + run);
        const GoodnessStatistics s = goodness_statistics(sample_of(d), exponential_of(d, 0));
        ad += s.anderson_darling > g.anderson_darling.critical;
        ks += s.kolmogorov_smirnov > g.kolmogorov_smirnov.critical;
        cvm += s.cramer_von_mises > g.cramer_von_mises.critical;
        chi += s.chi_squared > g.chi_squared.critical;
    }
    // 75 expected; the rule asks for .03 to .07. The binomial sd of 8.4, and as much again from the
    // bootstrap's own quantile, make 12: the bounds are 2.5 of them away.
    for (const int n : {ad, ks, cvm}) {
        EXPECT_GE(n, 0.03 * kRuns);
        EXPECT_LE(n, 0.07 * kRuns);
    }
    EXPECT_LE(chi, 0.07 * kRuns); // few distinct values: the size may be well below 5 %
}

TEST(Goodness, PValuesAreUniformUnderATrueLaw) {
    constexpr int kRuns = 200;
    int n_small = 0;
    double mean = 0;
    for (std::uint64_t run = 0; run < kRuns; ++run) {
        const auto d = profiles(Law::exponential(1), 20, 5000 + run);
        const double p = goodness(sample_of(d), exponential_of(d, 0), exponential_refit, {39, run})
                             .anderson_darling.p_value;
        n_small += p <= 0.05;
        mean += p / kRuns;
    }
    // p <= 2 / 40: 10 expected, sd 3.1; a mean of (1 + 1/40) / 2 with sd 0.29 / sqrt(200).
    EXPECT_GE(n_small, 2);
    EXPECT_LE(n_small, 19);
    EXPECT_NEAR(mean, 0.5125, 0.07);
}

TEST(Goodness, TellsALognormalFromAnExponential) {
    constexpr int kRuns = 300;
    const double parameters[] = {0.0, 0.5};
    const Law lognormal(Family::lognormal, parameters);
    const Goodness g = rock_test(profiles(Law::exponential(1), kRock, 3), 1000);
    int n_told = 0;
    for (std::uint64_t run = 0; run < kRuns; ++run) {
        const auto d = profiles(lognormal, kRock, run);
        n_told += goodness_statistics(sample_of(d), exponential_of(d, 0)).anderson_darling >
                  g.anderson_darling.critical;
    }
    EXPECT_GE(n_told, 0.6 * kRuns); // .69 by STEREOLOGY; the sd of 300 runs is .027
}

TEST(Goodness, ALimitIsPartOfTheTest) {
    const double limit = 0.4;
    int n_kept = 0, n_ignored = 0;
    for (std::uint64_t run = 0; run < 30; ++run) {
        const auto d = profiles(Law::exponential(1), 100, run, limit);
        const Law fitted = exponential_of(d, limit);
        n_kept += goodness(sample_of(d, limit), fitted, exponential_refit, {59, run})
                      .anderson_darling.p_value <= 0.05;
        n_ignored += goodness(sample_of(d), exponential_of(d, 0), exponential_refit, {59, run})
                         .anderson_darling.p_value <= 0.05;
    }
    EXPECT_LE(n_kept, 5); // 1.5 expected, sd 1.2
    EXPECT_GE(n_ignored, 20);
}

TEST(Goodness, LeavesOutTheProfileThatSetTheLimit) {
    auto d = profiles(Law::exponential(1), 60, 9);
    const double limit = *std::min_element(d.begin(), d.end());
    Sample sample = sample_of(d);
    sample.detection_limit.reset(); // so the smallest one sets it
    const Goodness g = goodness(sample, exponential_of(d, limit), exponential_refit, {99});
    EXPECT_EQ(g.n_profiles, 59u);
    EXPECT_EQ(g.n_at_limit, 1u);
    EXPECT_LT(g.anderson_darling.statistic, 10); // finite although F2 is 0 at the limit
}

TEST(Goodness, AKnownLawIsNotRefitted) {
    const auto d = profiles(Law::exponential(1), 300, 4);
    const Goodness good = goodness(sample_of(d), Law::exponential(1), {}, {199});
    EXPECT_GT(good.kolmogorov_smirnov.p_value, 0.05);
    // Kolmogorov's own critical value; sd of the quantile of 199 about 5 %.
    EXPECT_NEAR(good.kolmogorov_smirnov.critical, 1.36 / std::sqrt(300), 0.015);
    const Goodness bad = goodness(sample_of(d), Law::exponential(1.4), {}, {199});
    for (const GoodnessTest& test :
         {bad.anderson_darling, bad.kolmogorov_smirnov, bad.cramer_von_mises, bad.chi_squared})
        EXPECT_EQ(test.p_value, 1.0 / 200);
}

TEST(Goodness, StatisticsOfBinsAreThoseByHand) {
    // Spheres of diameter 1: F2 = 1 - sqrt(1 - d^2) is .2 at .6 and .4 at .8.
    Sample sample;
    sample.bins = {{0, 0.6, 10}, {0.6, 0.8, 5}, {0.8, 1, 15}};
    const GoodnessStatistics s = goodness_statistics(sample, Law::constant(1));
    // Found 10, 15, 30 of 30; asked 6, 12, 30.
    EXPECT_NEAR(s.kolmogorov_smirnov, 4.0 / 30, 1e-12);
    EXPECT_NEAR(s.cramer_von_mises, (16 * 0.2 + 9 * 0.2) / 30, 1e-12);
    EXPECT_NEAR(s.anderson_darling, (16 * 0.2 / 0.16 + 9 * 0.2 / 0.24) / 30, 1e-12);
    EXPECT_NEAR(s.chi_squared, 16.0 / 6 + 1.0 / 6 + 9.0 / 18, 1e-12);
}

TEST(Goodness, KnowsBinsAndWindows) {
    Sample binned;
    binned.bins = {{0.1, 0.3, 40}, {0.3, 0.6, 3}, {0.6, 1, 30}, {1, 2, 2}}; // two humps
    const Refit refit = [](const Sample& s) { return likeliest_law(s, Family::exponential); };
    const Goodness humps = goodness(binned, refit(binned), refit, {99});
    EXPECT_LE(humps.anderson_darling.p_value, 0.02);
    EXPECT_LE(humps.chi_squared.p_value, 0.02);
    // Through a small window few large profiles are seen whole: right with it, wrong without.
    Sample framed = sample_of(profiles(Law::exponential(1), 4000, 6));
    const Window window = Window::rectangle(6, 6);
    std::size_t n = 0;
    for (std::size_t i = 0; i < framed.diameters.size(); ++i) {
        const double d = framed.diameters[i];
        if (Rng{7, 3}.uniform(i) < window.eroded_area(d) / window.area())
            framed.diameters[n++] = d;
    }
    framed.diameters.resize(std::min<std::size_t>(n, 600));
    Sample without = framed;
    framed.frames = {{36, {}, window}};
    framed.counting = Counting::whole;
    EXPECT_GT(goodness(framed, Law::exponential(1), {}, {199}).anderson_darling.p_value, 0.05);
    EXPECT_LE(goodness(without, Law::exponential(1), {}, {199}).anderson_darling.p_value, 0.01);
}

TEST(Goodness, IsAFunctionOfItsSeed) {
    const auto d = profiles(Law::exponential(1), 30, 8);
    const auto p = [&](std::uint64_t seed) {
        return goodness(sample_of(d), exponential_of(d, 0), exponential_refit, {99, seed})
            .anderson_darling.critical;
    };
    EXPECT_EQ(p(1), p(1));
    EXPECT_NE(p(1), p(2));
}

TEST(Goodness, RefusesByName) {
    const auto d = profiles(Law::exponential(1), 20, 8);
    const Law law = Law::exponential(1);
    expect_error(Fault::bad_argument, "n_resamples is 5",
                 [&] { goodness(sample_of(d), law, {}, {5}); });
    expect_error(Fault::bad_input, "7 profiles above the detection limit", [&] {
        goodness(sample_of({d.begin(), d.begin() + 7}), law, {}, {99});
    });
    expect_error(Fault::bad_argument, "a diameter is the detection limit, 0.5", [] {
        goodness_statistics(sample_of({0.5, 0.6}, 0.5), Law::exponential(1));
    });
    const Refit never = [](const Sample&) -> Law {
        throw Error(Fault::numeric, "fit: no maximum");
    };
    expect_error(Fault::numeric, "because of 'fit: no maximum'",
                 [&] { goodness(sample_of(d), law, never, {99}); });
}

} // namespace
} // namespace taihu
