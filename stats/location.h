#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "stats/core/progress.h"
#include "stats/window.h"

namespace taihu {

/// Where a profile has its centre [unit], in the coordinates of the Window.
struct PlanePoint {
    double x = 0, y = 0;
    friend constexpr bool operator==(const PlanePoint&, const PlanePoint&) = default;
};

/// Are the profiles spread evenly over the searched area, cell by cell?
struct QuadratTest {
    int nx = 0, ny = 0;
    std::vector<std::uint64_t> observed; ///< of nx * ny cells, x fastest
    std::vector<double> expected;        ///< by their share of the searched area
    double statistic = 0;                ///< sum (observed - expected)^2 / expected
    int df = 0;                          ///< cells with an area - 1
    double p_value = 1;        ///< of a chi-squared law; rough where a cell expects fewer than 5
    double least_expected = 0; ///< of the cells with an area
};

/// The picture is cut into nx x ny equal cells, whose areas inside the window are sampled on about
/// 360 x 360 points; cells wholly outside take no part.
/// \param nx, ny  1..100, at least two cells.
/// \throws Error bad_argument: nx, ny; bad_input: no points, points[i] not in the window, or all of
///         the window in one cell.
QuadratTest quadrat_test(std::span<const PlanePoint> points, const Window& window, int nx, int ny);

/// The location test of the thesis: 2 x 3 equal cells, their counts against n / 6, and 4 degrees of
/// freedom (critical value 9.4877) where 5 are right.
/// \param counts  6, in any order.
/// \throws Error bad_argument: not 6 counts, or all of them 0.
QuadratTest thesis_quadrat_test(std::span<const std::uint64_t> counts);

/// Are the profiles nearer to each other, or farther, than if they were thrown at random?
struct NeighbourTest {
    /// Mean distance to the nearest other profile / its mean in random sets: 1 for random, less
    /// for clusters, more for regular arrangements (2.15 at most).
    double nearest_ratio = 1;
    std::vector<double> r;      ///< distances, 32 up to a quarter of the window's shorter side
    std::vector<double> l;      ///< L(r) = sqrt(K(r) / pi), without edge correction
    std::vector<double> lo, hi; ///< the envelope: least and greatest L(r) of the random sets
    /// The L(r) - mean L(r) of the random sets that is farthest from 0: positive where profiles
    /// crowd, negative where they keep apart.
    double deviation = 0;
    double p_value = 1; ///< share of sets whose greatest deviation is as large; exact
};

/// Test by simulation: n_simulations random sets of as many points in the same window, which share
/// its edges, so that no correction for them is needed.
/// \param points  2..10000. \param n_simulations  19..1e5.
/// \throws Error bad_argument: n_simulations; bad_input: the number of points, or points[i] not in
///         the window; numeric: the window is less than 1e-5 of its picture; cancelled: within one
///         set.
/// Source: Ripley 1977, J. R. Stat. Soc. B 39, 172; Diggle 1979 (from memory, unchecked).
/// Cost: n_simulations * n^2 / 2 distances; 999 sets of 46 points in about 10 ms.
NeighbourTest neighbour_test(std::span<const PlanePoint> points, const Window& window,
                             std::uint64_t n_simulations = 999, std::uint64_t seed = 0,
                             Progress* progress = nullptr);

} // namespace taihu
