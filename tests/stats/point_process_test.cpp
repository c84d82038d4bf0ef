#include "stats/point_process.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "stats/sampler.h"
#include "tests/support/errors.h"

namespace taihu {
namespace {

const Box kUnit{{0, 0, 0}, {1, 1, 1}};

// The process itself, as it falls: what lies in the box.
std::vector<Vec3> process(const CenterStream& stream, double density) {
    const std::uint64_t n =
        poisson_count(stream.mean_count(density), {stream.seed(), kCountStream});
    std::vector<Vec3> inside;
    for (std::uint64_t i = 0; i < n; ++i)
        if (const Vec3 p = stream.center(i); stream.box().contains(p))
            inside.push_back(p);
    return inside;
}

// Counts in 10^3 cells of the unit box.
std::vector<double> cell_counts(const std::vector<Vec3>& points) {
    std::vector<double> counts(1000, 0);
    for (const Vec3& p : points)
        counts[static_cast<std::size_t>(p.x * 10) * 100 + static_cast<std::size_t>(p.y * 10) * 10 +
               static_cast<std::size_t>(p.z * 10)] += 1;
    return counts;
}

double greatest_distance(std::vector<double> u) {
    std::sort(u.begin(), u.end());
    double greatest = 0;
    const auto n = static_cast<double>(u.size());
    for (std::size_t i = 0; i < u.size(); ++i)
        greatest = std::max(
            {greatest, u[i] - static_cast<double>(i) / n, static_cast<double>(i + 1) / n - u[i]});
    return greatest;
}

double nearest_distance(const std::vector<Vec3>& points, std::size_t i) {
    double nearest = 1e300;
    for (std::size_t j = 0; j < points.size(); ++j)
        if (j != i)
            nearest = std::min(nearest, length(points[i] - points[j]));
    return nearest;
}

TEST(UniformCenters, AreThoseOfAHoleStream) {
    const Box box{{-1, 0, 2}, {1, 3, 2.5}};
    const HoleStream holes(Law::exponential(4), box, 0.3, 17);
    const UniformCenters centers(box, 17);
    const std::vector<double> radii = hole_radii(Law::exponential(4), 0.3, 17, 50);
    for (std::uint64_t i = 0; i < 50; ++i) {
        EXPECT_EQ(centers.center(i), holes.hole(i).center);
        EXPECT_EQ(radii[i], holes.hole(i).radius_m);
    }
    EXPECT_EQ(centers.mean_count(10), 30);
}

TEST(ClusterCenters, ThomasCountsHaveTheVarianceOfTheirClosedForm) {
    constexpr double kDensity = 4000, kParents = 200, kSd = 0.03, kCell = 0.1;
    double sum = 0, squares = 0;
    constexpr int kSeeds = 20;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
        const ClusterCenters stream(kUnit, {ClusterSettings::Shape::thomas, kParents, kSd}, seed);
        for (const double n : cell_counts(process(stream, kDensity))) {
            sum += n;
            squares += n * n;
        }
    }
    // The difference of two children of a parent is normal with sd sqrt(2) kSd along each axis:
    // the chance that the second shares a cell of side a with the first, per axis.
    const double x = kCell / (2 * kSd);
    const double q = std::erf(x) - (1 - std::exp(-x * x)) / (x * std::sqrt(std::numbers::pi));
    const double expected = 1 + kDensity / kParents * q * q * q; // 6.9
    const double mean = sum / (1000 * kSeeds);
    // Clusters of 20 make the number in the box fluctuate by sqrt(21 / 4000) = 7 %; four of the
    // mean of 20 boxes.
    EXPECT_NEAR(mean, kDensity / 1000, 0.065 * kDensity / 1000);
    // Over seeds, the ratio of one box has an sd of about 0.7 (measured); four of the mean of 20.
    EXPECT_NEAR((squares / (1000 * kSeeds) - mean * mean) / mean, expected, 0.65);
}

TEST(ClusterCenters, AMaternClusterIsAUniformBall) {
    const ClusterSettings settings{ClusterSettings::Shape::matern, 0.3, 0.2};
    std::uint64_t seed = 0;
    while (ClusterCenters(kUnit, settings, seed).n_parents() != 1)
        ++seed;
    const ClusterCenters stream(kUnit, settings, seed);
    Vec3 middle;
    constexpr int kMany = 4000;
    for (std::uint64_t i = 0; i < kMany; ++i)
        middle += stream.center(i) / kMany;
    std::vector<double> u;
    for (std::uint64_t i = 0; i < kMany; ++i)
        u.push_back(std::min(1.0, std::pow(length(stream.center(i) - middle) / 0.2, 3)));
    // Kolmogorov's critical value at 1 %; the middle is known to sqrt(3 / 5 / 4000) = 1.2 % of the
    // radius, which moves some past the surface and changes little within.
    EXPECT_LT(greatest_distance(u), 1.628 / std::sqrt(kMany) + 0.01);
    EXPECT_EQ(stream.mean_count(60), 60 / 0.3);
}

TEST(ClusterCenters, AreAsDenseAtTheFacesAsInTheMiddle) {
    double at_face = 0, all = 0;
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        const ClusterCenters stream(kUnit, {ClusterSettings::Shape::matern, 100, 0.1}, seed);
        for (const Vec3& p : process(stream, 400)) {
            at_face += p.x < 0.1;
            ++all;
        }
    }
    // 8000 of 80000; clusters of 4 make the variance five times Poisson's: sd 200, four of them.
    EXPECT_NEAR(at_face / all, 0.1, 0.01);
}

TEST(JointCenters, ScatterAboutTheirPlane) {
    const Vec3 normal = normalized({1, 2, 2}), point{0.5, 0.5, 0.5};
    const JointCenters stream(kUnit, {{point, {1, 2, 2}}}, 0.02, 5);
    double squares = 0, sum = 0;
    constexpr int kMany = 4000;
    for (std::uint64_t i = 0; i < kMany; ++i) {
        const Vec3 p = stream.center(i);
        ASSERT_TRUE(kUnit.contains(p));
        const double off = dot(p - point, normal);
        sum += off;
        squares += off * off;
    }
    // Standard errors 0.02 / sqrt(n) and 0.02 / sqrt(2 n); four of them. By symmetry the faces,
    // which cut some off, change the sd in second order only.
    EXPECT_NEAR(sum / kMany, 0, 4 * 0.02 / std::sqrt(kMany));
    EXPECT_NEAR(std::sqrt(squares / kMany), 0.02, 4 * 0.02 / std::sqrt(2 * kMany));
}

TEST(JointCenters, PlanesShareByTheirArea) {
    // A square of side 1, and the triangle x + y + z = 0.5 with area sqrt(3) / 2 * 0.25.
    const JointCenters stream(kUnit, {{{0, 0.75, 0}, {0, 1, 0}}, {{0.5, 0, 0}, {1, 1, 1}}}, 1e-4,
                              6);
    double on_first = 0;
    constexpr int kMany = 4000;
    std::vector<double> x;
    for (std::uint64_t i = 0; i < kMany; ++i)
        if (const Vec3 p = stream.center(i); std::abs(p.y - 0.75) < 0.01 && p.x + p.y + p.z > 0.6) {
            on_first += 1;
            x.push_back(p.x);
        }
    const double share = 1 / (1 + std::sqrt(3) / 8);
    EXPECT_NEAR(on_first / kMany, share, 4 * std::sqrt(share * (1 - share) / kMany));
    EXPECT_LT(greatest_distance(x), 1.628 / std::sqrt(on_first)); // at 1 %
}

TEST(JointCenters, RandomPlanesPassTheBoxInAllDirections) {
    const auto planes = random_joints({{0, 0, 0}, {1, 2, 3}}, 4000, 2);
    double y2 = 0;
    for (const JointPlane& plane : planes) {
        EXPECT_TRUE(Box({{0, 0, 0}, {1, 2, 3}}).contains(plane.point));
        EXPECT_NEAR(length(plane.normal), 1, 1e-12);
        y2 += plane.normal.y * plane.normal.y / 4000;
    }
    EXPECT_NEAR(y2, 1.0 / 3, 4 * 0.3 / std::sqrt(4000)); // sd of a squared cosine: 2 / sqrt(45)
}

TEST(CenterStays, WithTheChanceOfItsShare) {
    const UniformCenters stream(kUnit, 3);
    std::vector<double> u, x;
    for (std::uint64_t i = 0; i < 20'000; ++i) {
        const Vec3 p = stream.center(i);
        EXPECT_TRUE(center_stays(i, 1, 3));
        EXPECT_FALSE(center_stays(i, 0, 3));
        if (center_stays(i, 1 - p.y, 3)) { // fewer and fewer upwards: the CDF of y is y (2 - y)
            u.push_back(p.y * (2 - p.y));
            x.push_back(p.x);
        }
    }
    const auto n = static_cast<double>(u.size());
    EXPECT_NEAR(n, 10'000, 4 * std::sqrt(5000));           // four standard deviations
    EXPECT_LT(greatest_distance(u), 1.628 / std::sqrt(n)); // Kolmogorov's critical value at 1 %
    EXPECT_LT(greatest_distance(x), 1.628 / std::sqrt(n));
}

TEST(HardCoreCenters, KeepTheirDistance) {
    const UniformCenters stream(kUnit, 4);
    const std::vector<double> radii(1200, 0.03);
    const auto centers = hard_core_centers(stream, radii, 0.005);
    ASSERT_EQ(centers.size(), 1200u);
    double least = 1;
    for (std::size_t i = 0; i < centers.size(); ++i)
        least = std::min(least, nearest_distance(centers, i));
    EXPECT_GE(least, 0.065);
    EXPECT_LT(least, 0.066); // some come as near as they may
    const auto first = hard_core_centers(stream, std::span(radii).first(300), 0.005);
    EXPECT_TRUE(std::equal(first.begin(), first.end(), centers.begin()));
}

TEST(HardCoreCenters, BallsOfAllSizesDoNotTouch) {
    const auto radii = hole_radii(Law::exponential(25), 1, 8, 800);
    const ClusterCenters stream(kUnit, {ClusterSettings::Shape::thomas, 30, 0.2}, 8);
    const auto centers = hard_core_centers(stream, radii, 0);
    for (std::size_t i = 0; i < centers.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
            ASSERT_GE(length(centers[i] - centers[j]), radii[i] + radii[j]) << i << ' ' << j;
}

TEST(LatticeCenters, FillTheMiddleOfTheBox) {
    const auto centers = lattice_centers({{0, 0, 0}, {1, 0.5, 0.35}}, 0.2);
    ASSERT_EQ(centers.size(), 5u * 2 * 1);
    EXPECT_NEAR(centers.front().x, 0.1, 1e-15);
    EXPECT_NEAR(centers.front().y, 0.15, 1e-15);
    EXPECT_NEAR(centers.front().z, 0.175, 1e-15);
    EXPECT_NEAR(centers.back().x, 0.9, 1e-15);
    EXPECT_EQ(lattice_centers({{0, 0, 0}, {0.3, 0.3, 0.3}}, 0.1).size(), 27u); // 0.3 / 0.1 < 3
}

TEST(PointProcess, FromLatticeToClustersTheNearestComesNearer) {
    const auto mean_nearest = [](const std::vector<Vec3>& points) {
        double sum = 0;
        for (std::size_t i = 0; i < points.size(); ++i)
            sum += nearest_distance(points, i);
        return sum / static_cast<double>(points.size());
    };
    const UniformCenters uniform(kUnit, 1);
    const ClusterCenters clusters(kUnit, {ClusterSettings::Shape::matern, 50, 0.08}, 1);
    const std::vector<double> radii(1000, 0.035);
    std::vector<Vec3> random, crowded;
    for (std::uint64_t i = 0; i < 1000; ++i) {
        random.push_back(uniform.center(i));
        crowded.push_back(clusters.center(i));
    }
    const double lattice = mean_nearest(lattice_centers(kUnit, 0.1));
    const double hard_core = mean_nearest(hard_core_centers(uniform, radii, 0));
    EXPECT_NEAR(lattice, 0.1, 1e-12);
    EXPECT_GT(lattice, 1.1 * hard_core);
    EXPECT_GT(hard_core, 1.2 * mean_nearest(random));
    // 0.554 n^(-1/3) for random points, a little more near the faces; sd 0.2 / sqrt(1000).
    EXPECT_NEAR(mean_nearest(random), 0.0554, 0.005);
    EXPECT_GT(mean_nearest(random), 1.2 * mean_nearest(crowded));
}

// Recorded once: these bits must come out on every machine and of every later version.
TEST(PointProcess, HasGoldenCentres) {
    const ClusterCenters thomas(kUnit, {ClusterSettings::Shape::thomas, 20, 0.1}, 0);
    const ClusterCenters matern(kUnit, {ClusterSettings::Shape::matern, 20, 0.1}, 0);
    const JointCenters joints(kUnit, random_joints(kUnit, 3, 0), 0.05, 0);
    EXPECT_EQ(thomas.center(7),
              (Vec3{0x1.5a6b2858b3b79p-2, 0x1.1da436f89e69cp-4, 0x1.141ad9ca1b612p-1}));
    EXPECT_EQ(matern.center(7),
              (Vec3{-0x1.0877de0ab5ac3p-5, 0x1.14fcf3fda7bc9p-1, 0x1.a9c6949e3e145p-1}));
    EXPECT_EQ(joints.center(7),
              (Vec3{0x1.0f42273005cbfp-2, 0x1.a7890fc6868ep-1, 0x1.3423cf577bc75p-1}));
}

TEST(PointProcess, RefusesByName) {
    expect_error(Fault::bad_argument, "the box has no volume", [] { UniformCenters({}, 0); });
    expect_error(Fault::bad_argument, "spread_m is 0", [] {
        ClusterCenters(kUnit, {ClusterSettings::Shape::thomas, 1, 0}, 0);
    });
    expect_error(Fault::bad_argument, "at most 1e8 are drawn", [] {
        ClusterCenters(kUnit, {ClusterSettings::Shape::matern, 1e12, 1}, 0);
    });
    expect_error(Fault::bad_argument, "no planes", [] { JointCenters(kUnit, {}, 0.1, 0); });
    expect_error(Fault::bad_argument, "planes[0] does not pass through the box", [] {
        JointCenters(kUnit, {{{0, 2, 0}, {0, 1, 0}}}, 0.1, 0);
    });
    expect_error(Fault::bad_argument, "planes[0] is not finite or has no direction", [] {
        JointCenters(kUnit, {{{0, 0.5, 0}, {0, 0, 0}}}, 0.1, 0);
    });
    const UniformCenters base(kUnit, 0);
    expect_error(Fault::bad_argument, "the share that stays is 2", [] { center_stays(0, 2, 0); });
    expect_error(Fault::bad_argument, "at most 1e8 are placed",
                 [] { lattice_centers(kUnit, 1e-4); });
    expect_error(Fault::bad_argument, "radii_m[1] is -1", [&] {
        hard_core_centers(base, std::vector{0.1, -1.0}, 0);
    });
    expect_error(Fault::numeric, "finds no room; use fewer or smaller holes",
                 [&] { hard_core_centers(base, std::vector<double>(60, 0.25), 0); });
}

} // namespace
} // namespace taihu
