// Round trips: balls are thrown into a box, planes cut them, a law is fitted to the circles, and
// the truth has to be in the intervals. Then what else is promised of profiles: tests of fit,
// counts that whole profiles in a window stand for, times. Deterministic but for the times; about a
// minute and a half on two processors.
#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "stats/bootstrap.h"
#include "stats/core/error.h"
#include "stats/density.h"
#include "stats/fit.h"
#include "stats/goodness.h"
#include "stats/sampler.h"
#include "stats/section_draws.h"
#include "tests/bench/bars.h"
#include "tests/bench/parallel.h"

namespace taihu {
namespace {

struct Truth {
    const char* name;
    Law law; // of mean 1
};

const std::array<Truth, 4> kTruths = {
    {{"exponential", Law::exponential(1)},
     {"gamma(2)", Law(Family::gamma, std::array{2.0, 0.5})},
     {"weibull(1.5)", Law(Family::weibull, std::array{1.5, 1 / std::tgamma(1 + 1 / 1.5)})},
     {"lognormal(.5)", Law(Family::lognormal, std::array{-0.125, 0.5})}}};

constexpr double kNumber = 1; // N_V of the round trips; by the mean of 1 as many profiles per area

struct Circle {
    double x = 0, y = 0, diameter = 0;
};

/// A Poisson number of balls, n_v per volume, with their centres in the box.
std::vector<Sphere> throw_balls(const Law& law, double n_v, const Box& box, std::uint64_t seed) {
    const std::uint64_t n = poisson_count(n_v * box.volume(), {seed, kCountStream});
    const HoleStream stream(law, box, 1, seed);
    std::vector<Sphere> balls;
    for (std::uint64_t i = 0; i < n; ++i)
        balls.push_back(stream.hole(i));
    return balls;
}

/// The circles in which the plane at height z meets them.
std::vector<Circle> cut(std::span<const Sphere> balls, double z) {
    std::vector<Circle> circles;
    for (const Sphere& ball : balls) {
        const double above = ball.center.z - z, r = ball.radius_m;
        if (std::abs(above) < r)
            circles.push_back(
                {ball.center.x, ball.center.y, 2 * std::sqrt((r - above) * (r + above))});
    }
    return circles;
}

// Five planes, 20 mean diameters apart: one ball in 10^8 of the widest law meets two.
Sample cut_sample(const Law& law, std::uint64_t seed) {
    constexpr int kPlanes = 5;
    constexpr double kApart = 20, kLimit = 0.2;
    const Box box{{0, 0, 0}, {5, 4, kPlanes * kApart}};
    const std::vector<Sphere> balls = throw_balls(law, kNumber, box, seed);
    Sample sample;
    for (int plane = 0; plane < kPlanes; ++plane)
        for (const Circle& c : cut(balls, (plane + 0.5) * kApart))
            if (c.diameter >= kLimit)
                sample.diameters.push_back(c.diameter);
    sample.detection_limit = kLimit;
    sample.area = kPlanes * box.size().x * box.size().y;
    return sample;
}

bool holds(double lo, double hi, double value) {
    return lo <= value && value <= hi;
}

struct Caught {
    int n_v = 0, mean = 0; ///< runs whose interval holds it
};

template <class NumberInterval>
Caught caught(const NumberInterval& n_v, const Interval& mean) {
    return {holds(n_v.lo, n_v.hi, kNumber), holds(mean.lo, mean.hi, 1)};
}

void round_trips(Bars& bars) {
    constexpr int kRuns = 200;
    fmt::print(
        "Of {} round trips, about 100 profiles each: how many intervals of 95 % hold N_V and "
        "the mean diameter\n{:<14} {:<34} {:<22} {}\n",
        kRuns, "truth", "refitted as", "N_V", "mean diameter");
    for (const Truth& truth : kTruths) {
        std::vector<std::array<Caught, 3>> runs(kRuns);
        for_each_run(kRuns, [&](int run) {
            const Sample sample = cut_sample(truth.law, static_cast<std::uint64_t>(run));
            const Fit fit = fit_law(sample, truth.law.family());
            const LawRanking all = fit_laws(sample);
            const Fit& first = all.fits.front();
            runs[static_cast<std::size_t>(run)] = {caught(*fit.n_v, fit.mean_diameter),
                                                   caught(*all.n_v, all.mean_diameter),
                                                   caught(*first.n_v, first.mean_diameter)};
        });
        std::array<Caught, 3> sums;
        for (const auto& run : runs)
            for (std::size_t way = 0; way < sums.size(); ++way) {
                sums[way].n_v += run[way].n_v;
                sums[way].mean += run[way].mean;
            }
        const auto row = [&](const char* way, const std::string& n_v, const std::string& mean) {
            fmt::print("{:<14} {:<34} {:<22} {}\n", truth.name, way, n_v, mean);
        };
        const auto held = [&](int n) { return bars.at_least(n, 0.92 * kRuns, 0); };
        row("its own family", held(sums[0].n_v), held(sums[0].mean));
        row("five families, all laws together", held(sums[1].n_v), held(sums[1].mean));
        row("five families, first by AICc", std::to_string(sums[2].n_v),
            std::to_string(sums[2].mean)); // knows nothing of the choice: held to nothing
    }
}

Sample drawn(const Law& law, std::uint64_t n, const Rng& rng) {
    const SectionDraws draws(law, 0);
    Sample sample;
    for (std::uint64_t i = 0; i < n; ++i)
        sample.diameters.push_back(draws.diameter(rng, i));
    sample.detection_limit = 0;
    sample.area = 50;
    return sample;
}

// Share of samples of 46 profiles, as many as the thesis' rock has, for which an exponential law is
// rejected at 5 % by Anderson and Darling's test.
double rejected(const Law& law, int n_runs) {
    const Refit refit = [](const Sample& sample) {
        return likeliest_law(sample, Family::exponential);
    };
    std::vector<int> runs(static_cast<std::size_t>(n_runs));
    for_each_run(n_runs, [&](int run) {
        const auto seed = static_cast<std::uint64_t>(run);
        const Sample sample = drawn(law, 46, {seed, 2});
        // Of 99 resamples p is 5 % or less in exactly 5 cases of 100.
        const Goodness test =
            goodness(sample, refit(sample), refit, {.n_resamples = 99, .seed = seed});
        runs[static_cast<std::size_t>(run)] = test.anderson_darling.p_value <= 0.05;
    });
    return static_cast<double>(std::count(runs.begin(), runs.end(), 1)) / n_runs;
}

void tests_of_fit(Bars& bars) {
    fmt::print("\nAnderson-Darling test of an exponential law, 46 profiles: rejected at 5 %\n"
               "exponential truth, 2000 runs: {}\nlognormal(.5) truth, 500 runs: {}\n",
               bars.within(rejected(kTruths[0].law, 2000), 0.03, 0.07),
               bars.at_least(rejected(kTruths[3].law, 500), 0.6));
}

// The mean of N_A by whole profiles in a window, over its truth, less 1.
double density_bias(const Window& window, const std::function<bool(const Circle&)>& whole) {
    constexpr int kRuns = 6000;
    constexpr double kRate = 2, kHoles = 3, kMargin = 5; // no ball is as wide as the margin
    std::vector<double> runs(kRuns);
    for_each_run(kRuns, [&](int run) {
        const Box box{{-kMargin, -kMargin, -kMargin},
                      {window.width() + kMargin, window.height() + kMargin, kMargin}};
        const auto balls =
            throw_balls(Law::exponential(kRate), kHoles, box, static_cast<std::uint64_t>(run));
        Sample sample;
        for (const Circle& c : cut(balls, 0))
            if (whole(c))
                sample.diameters.push_back(c.diameter);
        sample.detection_limit = 0;
        sample.counting = Counting::whole;
        sample.frames = {{window.area(), {}, window}};
        runs[static_cast<std::size_t>(run)] = profiles_per_area(sample) / (kHoles / kRate);
    });
    double mean = 0;
    for (const double ratio : runs)
        mean += ratio / kRuns;
    return mean - 1;
}

void densities(Bars& bars) {
    const double width = 8, height = 6;
    const double rectangle = density_bias(Window::rectangle(width, height), [&](const Circle& c) {
        const double r = 0.5 * c.diameter;
        return c.x >= r && c.x <= width - r && c.y >= r && c.y <= height - r;
    });
    Image image(200, 200, 1); // pixels of 0.04, a disc of radius 3.92
    for (int y = 0; y < 200; ++y)
        for (int x = 0; x < 200; ++x)
            *image.at(x, y) = std::hypot(x - 99.5, y - 99.5) <= 98 ? 1.0F : 0.0F;
    const double disc = density_bias(Window::mask(image, 0.04), [](const Circle& c) {
        return std::hypot(c.x - 4, c.y - 4) + 0.5 * c.diameter <= 3.92;
    });
    fmt::print(
        "\nN_A of whole profiles, bias (standard error 0.002)\nrectangle: {}\ndisc, a mask of "
        "pixels: {}\n",
        bars.within(rectangle, -0.01, 0.01), bars.within(disc, -0.01, 0.01));
}

/// Processor time, which other programs on the machine do not change.
double seconds(const std::function<void()>& work) {
    const std::clock_t start = std::clock();
    work();
    return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

void times(Bars& bars) {
    const Sample many = drawn(kTruths[0].law, 300, {0, 3}), few = drawn(kTruths[0].law, 50, {0, 3});
    const std::array at = {0.5, 1.0, 2.0};
    fmt::print("\nProcessor times [s]\n300 profiles, five laws with intervals: {}\n",
               bars.at_most(seconds([&] { fit_laws(many); }), 0.1));
    for (const Family family : {Family::exponential, Family::lognormal})
        fmt::print(
            "band of 1000 resamples, 50 profiles, {}: {}\n", family_name(family),
            bars.at_most(seconds([&] { f3_band(few, likeliest_law(few, family), at); }), 10, 2));
}

} // namespace
} // namespace taihu

int main() {
    try {
        taihu::Bars bars;
        taihu::round_trips(bars);
        taihu::tests_of_fit(bars);
        taihu::densities(bars);
        taihu::times(bars);
        bars.print_sum();
        return 0;
    } catch (const std::exception& e) {
        fmt::print(stderr, "round_trip: {}\n", e.what());
        return 1;
    }
}
