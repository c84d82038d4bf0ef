#include "vdb_ops/wrinkles_detail.h"

#include <numbers>

#include <tbb/parallel_for.h>

#include "vdb_ops/dense_lines_detail.h"
#include "vdb_ops/distance_map_detail.h"

namespace taihu {
namespace {

/// Average of a line with a Gauss kernel of so many samples; ends are drawn out.
class Smoothing {
public:
    explicit Smoothing(double sd) : reach_(static_cast<int>(std::ceil(3 * sd))) {
        float sum = 0;
        for (int i = -reach_; i <= reach_; ++i) {
            weights_.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sd * sd))));
            sum += weights_.back();
        }
        for (float& w : weights_)
            w /= sum;
    }
    void operator()(float* line, int n) {
        padded_.resize(static_cast<std::size_t>(n + 2 * reach_));
        for (int i = 0; i < n + 2 * reach_; ++i)
            padded_[static_cast<std::size_t>(i)] = line[std::clamp(i - reach_, 0, n - 1)];
        for (int i = 0; i < n; ++i) {
            float sum = 0;
            for (std::size_t k = 0; k < weights_.size(); ++k)
                sum += weights_[k] * padded_[static_cast<std::size_t>(i) + k];
            line[i] = sum;
        }
    }

private:
    int reach_;
    std::vector<float> weights_, padded_;
};

/// First and second differences at a sample.
struct Slopes {
    Vec3 g;
    double xx, yy, zz, xy, xz, yz;
    Slopes(const float* v, const std::size_t (&s)[3]) {
        const auto first = [&](std::size_t a) { return 0.5 * (double(v[a]) - *(v - a)); };
        const auto second = [&](std::size_t a) { return double(v[a]) + *(v - a) - 2.0 * *v; };
        const auto mixed = [&](std::size_t a, std::size_t b) {
            return 0.25 * (double(v[a + b]) + *(v - a - b) - *(v + a - b) - *(v - a + b));
        };
        g = {first(s[0]), first(s[1]), first(s[2])};
        xx = second(s[0]), yy = second(s[1]), zz = second(s[2]);
        xy = mixed(s[0], s[1]), xz = mixed(s[0], s[2]), yz = mixed(s[1], s[2]);
    }
    /// Mean curvature of the level surface, positive for a ball. \pre the slope is not 0
    double mean_curvature() const {
        const double g2 = length_squared(g);
        const double along = g.x * g.x * xx + g.y * g.y * yy + g.z * g.z * zz +
                             2 * (g.x * g.y * xy + g.x * g.z * xz + g.y * g.z * yz);
        return (g2 * (xx + yy + zz) - along) / (2 * g2 * std::sqrt(g2));
    }
};

/// A density of area: the zero surface spread over 1.5 samples on both sides.
double spread(double value) {
    constexpr double kReach = 1.5;
    return std::abs(value) < kReach
               ? (1 + std::cos(std::numbers::pi * value / kReach)) / (2 * kReach)
               : 0;
}

/// Signed distances to the zero set of a smooth function: by its slope where that is near.
std::vector<float> distances_to(const DenseLattice& lattice, const std::vector<float>& smooth,
                                const std::size_t (&strides)[3], const Progress* progress) {
    std::vector<float> straight = smooth;
    tbb::parallel_for(1, lattice.n[0] - 1, [&](int x) {
        for (int y = 1; y + 1 < lattice.n[1]; ++y)
            for (int z = 1; z + 1 < lattice.n[2]; ++z) {
                const std::size_t i = lattice.at(x, y, z);
                const double slope = length(Slopes(&smooth[i], strides).g);
                straight[i] /= static_cast<float>(std::max(slope, 0.1));
            }
    });
    return signed_distances(lattice, straight, 2, progress);
}

struct Sums {
    double area = 0, smooth_area = 0, squares = 0, curvature = 0, concave = 0;
};

} // namespace

WrinkleMeasures measure_wrinkles(const DenseLattice& lattice, std::span<const float> distances,
                                 double sd, double least_curvature, const Progress* progress) {
    std::vector<float> smooth(lattice.size());
    const auto make = [sd] { return Smoothing(sd); };
    along_lines(lattice, 2, distances.data(), smooth.data(), LineWrite::replace, progress, make);
    for (const int axis : {1, 0})
        along_lines(lattice, axis, smooth.data(), smooth.data(), LineWrite::replace, progress,
                    make);
    const std::size_t strides[3] = {lattice.stride(0), lattice.stride(1), 1};
    const std::vector<float> to_smooth = distances_to(lattice, smooth, strides, progress);
    std::vector<Sums> by_plane(static_cast<std::size_t>(lattice.n[0]));
    tbb::parallel_for(1, lattice.n[0] - 1, [&](int x) {
        Sums& sums = by_plane[static_cast<std::size_t>(x)];
        for (int y = 1; y + 1 < lattice.n[1]; ++y)
            for (int z = 1; z + 1 < lattice.n[2]; ++z) {
                const std::size_t i = lattice.at(x, y, z);
                if (const double w = spread(static_cast<double>(distances[i])); w > 0) {
                    const double area = w * length(Slopes(&distances[i], strides).g);
                    sums.area += area;
                    sums.squares += area * std::pow(static_cast<double>(to_smooth[i]) -
                                                        static_cast<double>(distances[i]),
                                                    2);
                }
                if (const double w = spread(static_cast<double>(smooth[i])); w > 0) {
                    const Slopes slopes(&smooth[i], strides);
                    const double slope = length(slopes.g);
                    if (!(slope > 1e-3)) // no surface has a normal there
                        continue;
                    const double h = slopes.mean_curvature();
                    sums.smooth_area += w * slope;
                    sums.curvature += w * slope * std::abs(h);
                    sums.concave += h < -least_curvature ? w * slope : 0;
                }
            }
    });
    Sums all;
    for (const Sums& sums : by_plane) {
        all.area += sums.area;
        all.smooth_area += sums.smooth_area;
        all.squares += sums.squares;
        all.curvature += sums.curvature;
        all.concave += sums.concave;
    }
    if (!(all.smooth_area > 0))
        return {};
    return {all.area / all.smooth_area, std::sqrt(all.squares / all.area),
            all.curvature / all.smooth_area, all.concave / all.smooth_area};
}

} // namespace taihu
