#include "stats/unfold.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "stats/core/error.h"
#include "stats/detection.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

void check_range(const char* name, double value, double lo, double hi) {
    if (!(value >= lo && value <= hi))
        throw Error(Fault::bad_argument, std::string("unfold: ") + name + " is " + shortest(value) +
                                             "; must be in " + shortest(lo) + ".." + shortest(hi));
}

struct Classes {
    std::vector<double> edges;
    std::vector<double> profiles; // by 1 / g
};

Classes classes_of_bins(const Sample& sample, const Detection& detection) {
    Classes classes{{detection.limit()}, {}};
    for (const Bin& bin : sample.bins) {
        if (bin.hi <= detection.limit())
            continue;
        classes.edges.push_back(bin.hi);
        const double share = detection.share(0.5 * (std::max(bin.lo, detection.limit()) + bin.hi));
        classes.profiles.push_back(bin.count > 0 ? static_cast<double>(bin.count) / share : 0);
    }
    while (classes.profiles.size() > 1 && classes.profiles.back() == 0) { // hold no sphere
        classes.profiles.pop_back();
        classes.edges.pop_back();
    }
    return classes;
}

Classes classes_of(const Sample& sample, int n_classes) {
    check_range("the number of classes", n_classes, 2, 1000);
    const Detection detection(sample);
    if (!sample.bins.empty())
        return classes_of_bins(sample, detection);
    const double lo = detection.limit();
    const double hi = *std::max_element(sample.diameters.begin(), sample.diameters.end());
    if (!(lo < hi))
        throw Error(Fault::bad_input, "unfold: all profiles lie at the detection limit " +
                                          shortest(lo) +
                                          "; mark holes of several sizes or lower the limit");
    Classes classes{{}, std::vector<double>(static_cast<std::size_t>(n_classes))};
    for (int i = 0; i <= n_classes; ++i)
        classes.edges.push_back(std::lerp(lo, hi, static_cast<double>(i) / n_classes));
    for (const double d : sample.diameters) {
        const auto above = std::lower_bound(classes.edges.begin() + 1, classes.edges.end() - 1, d);
        classes.profiles[static_cast<std::size_t>(above - classes.edges.begin()) - 1] +=
            1 / detection.share(d);
    }
    return classes;
}

// Profiles of class i that one sphere per unit volume of class j makes per unit area.
double kernel(const Classes& classes, std::size_t i, std::size_t j) {
    if (i > j)
        return 0;
    const double d = classes.edges[j + 1];
    const auto half_chord = [&](double x) { return std::sqrt(std::max(0.0, (d - x) * (d + x))); };
    return half_chord(classes.edges[i]) - half_chord(classes.edges[i + 1]);
}

} // namespace

Law Unfolding::law() const {
    const double sum = std::accumulate(spheres.begin(), spheres.end(), 0.0);
    if (!(sum > 0))
        throw Error(Fault::numeric, "unfold: no class holds a sphere; take fewer classes");
    std::vector<CdfPoint> points = {{edges.front(), 0}};
    double below = 0;
    for (std::size_t i = 0; i < spheres.size(); ++i)
        points.push_back({edges[i + 1], std::min(1.0, (below += spheres[i]) / sum)});
    points.back().cdf = 1;
    return Law::empirical(std::move(points));
}

Unfolding schwartz_saltykov(const Sample& sample, const ClassSettings& settings) {
    Classes classes = classes_of(sample, settings.n_classes);
    const std::size_t n = classes.profiles.size();
    Unfolding result{classes.edges, std::vector<double>(n), 0};
    for (std::size_t j = n; j-- > 0;) {
        double& spheres = result.spheres[j];
        spheres = classes.profiles[j] / kernel(classes, j, j);
        if (spheres < 0) {
            spheres = 0;
            ++result.n_clipped;
        }
        for (std::size_t i = 0; i < j; ++i)
            classes.profiles[i] -= spheres * kernel(classes, i, j);
    }
    return result;
}

Unfolding unfold_em(const Sample& sample, const EmSettings& settings) {
    check_range("the number of iterations", settings.n_iterations, 1, 10'000);
    check_range("the smoothing", settings.smoothing, 0, 1.0 / 3);
    const Classes classes = classes_of(sample, settings.n_classes);
    const std::size_t n = classes.profiles.size();
    std::vector<double> a(n * n), seen(n); // a[i n + j]: profiles i of spheres j
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = i; j < n; ++j)
            seen[j] += a[i * n + j] = kernel(classes, i, j);
    Unfolding result{classes.edges, classes.profiles, 0};
    std::vector<double>& spheres = result.spheres;
    for (std::size_t j = 0; j < n; ++j) // each class alone, none without a chance
        spheres[j] = std::max(spheres[j], 1e-3) / seen[j];
    for (int pass = 0; pass < settings.n_iterations; ++pass) {
        std::vector<double> ratio(n), next(n);
        for (std::size_t i = 0; i < n; ++i) {
            double expected = 0;
            for (std::size_t j = i; j < n; ++j)
                expected += a[i * n + j] * spheres[j];
            ratio[i] = expected > 0 ? classes.profiles[i] / expected : 0;
        }
        for (std::size_t j = 0; j < n; ++j) {
            double sum = 0;
            for (std::size_t i = 0; i <= j; ++i)
                sum += a[i * n + j] * ratio[i];
            next[j] = spheres[j] * sum / seen[j];
        }
        for (std::size_t j = 0; j < n; ++j) {
            const double before = next[j > 0 ? j - 1 : 0], after = next[std::min(j + 1, n - 1)];
            spheres[j] = next[j] + settings.smoothing * (before - 2 * next[j] + after);
        }
    }
    return result;
}

Law unfold_isotonic(const Sample& sample) {
    constexpr std::size_t kMost = 20'000;
    const Detection detection(sample);
    if (sample.diameters.empty() || sample.diameters.size() > kMost)
        throw Error(Fault::bad_input, "unfold: isotonic regression takes 1..20000 diameters, not " +
                                          std::to_string(n_profiles(sample)) +
                                          (sample.bins.empty() ? " of them" : " in bins") +
                                          "; use EM");
    std::vector<double> d = sample.diameters;
    std::sort(d.begin(), d.end());
    const double d0 = detection.limit(), x0 = d0 * d0;
    if (!(d.back() > d0))
        throw Error(Fault::bad_input, "unfold: all profiles lie at the detection limit " +
                                          shortest(d0) + "; lower the limit");
    std::vector<double> weights;
    for (const double v : d)
        weights.push_back(1 / detection.share(v));

    // U(x) = int_x0^x V dx with V(x) = sum w_i / sqrt(d_i^2 - x). Between profiles U is convex, so
    // its majorant has corners at profiles alone.
    struct Corner {
        double x, u;
    };
    std::vector<Corner> corners = {{x0, 0}};
    const auto slope = [](const Corner& a, const Corner& b) { return (b.u - a.u) / (b.x - a.x); };
    for (const double at : d) {
        const double x = at * at;
        if (!(x > corners.back().x))
            continue;
        double u = 0;
        for (std::size_t i = 0; i < d.size(); ++i) {
            const double z = d[i] * d[i];
            u += 2 * weights[i] *
                 (std::sqrt(std::max(0.0, z - x0)) - std::sqrt(std::max(0.0, z - x)));
        }
        const Corner corner{x, u};
        while (corners.size() > 1 &&
               slope(corners[corners.size() - 2], corners.back()) <= slope(corners.back(), corner))
            corners.pop_back();
        corners.push_back(corner);
    }
    // 1 - F3 is the slope, relative to the first one: a stair, drawn through the middle of its
    // rises.
    const double first = slope(corners[0], corners[1]);
    std::vector<CdfPoint> points = {{d0, 0}};
    for (std::size_t k = 1; k < corners.size(); ++k) {
        const double before = slope(corners[k - 1], corners[k]) / first;
        const double after = k + 1 < corners.size() ? slope(corners[k], corners[k + 1]) / first : 0;
        points.push_back({std::sqrt(corners[k].x), 1 - 0.5 * (before + after)});
    }
    points.back().cdf = 1;
    return Law::empirical(std::move(points));
}

} // namespace taihu
