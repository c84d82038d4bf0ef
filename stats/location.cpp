#include "stats/location.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "stats/chi_squared.h"
#include "stats/core/error.h"
#include "stats/core/rng.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

constexpr std::uint32_t kLocationStream = 0x6c6f6361;
constexpr int kSamples = 360;      // along a side of the picture, for the areas of cells
constexpr std::size_t kSteps = 32; // distances at which L is known

void check_points(std::span<const PlanePoint> points, const Window& window) {
    for (std::size_t i = 0; i < points.size(); ++i)
        if (!window.contains(points[i].x, points[i].y))
            throw Error(Fault::bad_input, "location: points[" + std::to_string(i) + "] is (" +
                                              shortest(points[i].x) + ", " + shortest(points[i].y) +
                                              "), not in the window; drop it or correct the mask");
}

/// Statistic, p-value and the least expectation from the counts and expectations.
void judge(QuadratTest& test) {
    test.least_expected = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < test.observed.size(); ++i) {
        if (test.expected[i] == 0)
            continue;
        const double miss = static_cast<double>(test.observed[i]) - test.expected[i];
        test.statistic += miss * miss / test.expected[i];
        test.least_expected = std::min(test.least_expected, test.expected[i]);
    }
    test.p_value = chi_squared_survival(test.statistic, test.df);
}

/// What one set of points says of its distances.
struct Distances {
    double nearest = 0; ///< mean distance to the nearest other point
    std::vector<double> l;
};

Distances measure(std::span<const PlanePoint> points, double area, double r_max) {
    const std::size_t n = points.size();
    std::vector<double> nearest(n, std::numeric_limits<double>::infinity());
    std::vector<double> n_pairs(kSteps, 0);
    const double per_step = kSteps / r_max;
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = 0; j < i; ++j) {
            const double x = points[i].x - points[j].x, y = points[i].y - points[j].y;
            const double square = x * x + y * y;
            nearest[i] = std::min(nearest[i], square);
            nearest[j] = std::min(nearest[j], square);
            if (square < r_max * r_max) // bin k holds distances up to step k + 1
                n_pairs[std::min(kSteps - 1,
                                 static_cast<std::size_t>(std::sqrt(square) * per_step))] += 1;
        }
    Distances result;
    const auto count = static_cast<double>(n);
    for (const double square : nearest)
        result.nearest += std::sqrt(square) / count;
    double pairs = 0;
    for (const double more : n_pairs) {
        pairs += more;
        result.l.push_back(std::sqrt(2 * area * pairs / (std::numbers::pi * count * (count - 1))));
    }
    return result;
}

std::vector<PlanePoint> random_points(const Window& window, std::size_t n, const Rng& rng,
                                      std::uint64_t set) {
    constexpr std::uint32_t kTries = 10'000'000;
    std::vector<PlanePoint> points;
    for (std::size_t i = 0; i < n; ++i)
        for (std::uint32_t t = 0;; ++t) {
            if (t == kTries)
                throw Error(Fault::numeric, "location: the window fills less than 1e-5 of its "
                                            "picture; crop the picture");
            const PlanePoint p{rng.uniform(set << 32 | i, 2 * t) * window.width(),
                               rng.uniform(set << 32 | i, 2 * t + 1) * window.height()};
            if (!window.contains(p.x, p.y))
                continue;
            points.push_back(p);
            break;
        }
    return points;
}

double greatest_deviation(const std::vector<double>& l, const std::vector<double>& mean) {
    double greatest = 0;
    for (std::size_t k = 0; k < kSteps; ++k)
        if (std::abs(l[k] - mean[k]) > std::abs(greatest))
            greatest = l[k] - mean[k];
    return greatest;
}

} // namespace

QuadratTest quadrat_test(std::span<const PlanePoint> points, const Window& window, int nx, int ny) {
    if (nx < 1 || ny < 1 || nx > 100 || ny > 100 || nx * ny < 2)
        throw Error(Fault::bad_argument, "quadrat test: " + std::to_string(nx) + " x " +
                                             std::to_string(ny) +
                                             " cells; each number must be in 1..100, and two "
                                             "cells at least are needed");
    if (points.empty())
        throw Error(Fault::bad_input, "quadrat test: no points; mark some holes");
    check_points(points, window);
    QuadratTest test{nx, ny, {}, {}, 0, -1, 1, 0};
    const std::size_t n_cells = static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
    test.observed.assign(n_cells, 0);
    test.expected.assign(n_cells, 0);
    const double width = window.width() / nx, height = window.height() / ny;
    const auto cell = [&](double x, double y) {
        const int i = std::clamp(static_cast<int>(x / width), 0, nx - 1);
        const int j = std::clamp(static_cast<int>(y / height), 0, ny - 1);
        return static_cast<std::size_t>(j * nx + i);
    };
    for (const PlanePoint& p : points)
        ++test.observed[cell(p.x, p.y)];
    // As many samples in each cell, so that those of a rectangle are equal exactly.
    const int mx = (kSamples + nx - 1) / nx, my = (kSamples + ny - 1) / ny;
    double n_inside = 0;
    for (int j = 0; j < ny * my; ++j)
        for (int i = 0; i < nx * mx; ++i)
            if (window.contains((i + 0.5) * width / mx, (j + 0.5) * height / my)) {
                test.expected[static_cast<std::size_t>(j / my * nx + i / mx)] += 1;
                ++n_inside;
            }
    for (std::size_t c = 0; c < n_cells; ++c) {
        if (test.expected[c] == 0 && test.observed[c] > 0) // a corner that the samples missed
            test.expected[c] = 0.5;
        test.df += test.expected[c] > 0;
        test.expected[c] *= static_cast<double>(points.size()) / std::max(n_inside, 1.0);
    }
    if (test.df < 1)
        throw Error(Fault::bad_input,
                    "quadrat test: the whole window lies in one cell; use more cells");
    judge(test);
    return test;
}

QuadratTest thesis_quadrat_test(std::span<const std::uint64_t> counts) {
    std::uint64_t n = 0;
    for (const std::uint64_t count : counts)
        n += count;
    if (counts.size() != 6 || n == 0)
        throw Error(Fault::bad_argument, "thesis' location test: " + std::to_string(counts.size()) +
                                             " cells with " + std::to_string(n) +
                                             " points; give 6 cells and at least one point");
    QuadratTest test{2, 3, {counts.begin(), counts.end()}, {}, 0, 4, 1, 0};
    test.expected.assign(6, static_cast<double>(n) / 6);
    judge(test);
    return test;
}

NeighbourTest neighbour_test(std::span<const PlanePoint> points, const Window& window,
                             std::uint64_t n_simulations, std::uint64_t seed, Progress* progress) {
    if (n_simulations < 19 || n_simulations > 100'000)
        throw Error(Fault::bad_argument, "neighbour test: n_simulations is " +
                                             std::to_string(n_simulations) +
                                             "; must be in 19..1e5");
    if (points.size() < 2 || points.size() > 10'000)
        throw Error(Fault::bad_input, "neighbour test: " + std::to_string(points.size()) +
                                          " points; 2..10000 can be tested");
    check_points(points, window);
    report_stage(progress, "testing the locations");
    const double r_max = 0.25 * std::min(window.width(), window.height());
    const Rng rng{seed, kLocationStream};
    // The set itself first: the mean is taken over all, which makes their ranks exchangeable.
    std::vector<Distances> sets = {measure(points, window.area(), r_max)};
    for (std::uint64_t s = 0; s < n_simulations; ++s) {
        check_cancelled(progress);
        if (s % (n_simulations / 19) == 0)
            report_fraction(progress, static_cast<double>(s) / static_cast<double>(n_simulations));
        sets.push_back(measure(random_points(window, points.size(), rng, s), window.area(), r_max));
    }
    NeighbourTest test;
    test.l = sets[0].l;
    test.lo = test.hi = sets[1].l;
    std::vector<double> mean(kSteps, 0);
    double nearest = 0;
    for (std::size_t s = 0; s < sets.size(); ++s)
        for (std::size_t k = 0; k < kSteps; ++k) {
            mean[k] += sets[s].l[k] / static_cast<double>(sets.size());
            if (s == 0)
                continue;
            test.lo[k] = std::min(test.lo[k], sets[s].l[k]);
            test.hi[k] = std::max(test.hi[k], sets[s].l[k]);
        }
    for (std::size_t k = 0; k < kSteps; ++k)
        test.r.push_back(r_max * static_cast<double>(k + 1) / kSteps);
    test.deviation = greatest_deviation(test.l, mean);
    std::uint64_t n_as_far = 1; // itself
    for (std::size_t s = 1; s < sets.size(); ++s) {
        nearest += sets[s].nearest / static_cast<double>(n_simulations);
        n_as_far += std::abs(greatest_deviation(sets[s].l, mean)) >= std::abs(test.deviation);
    }
    test.nearest_ratio = sets[0].nearest / nearest;
    test.p_value = static_cast<double>(n_as_far) / static_cast<double>(sets.size());
    return test;
}

} // namespace taihu
