#include "vdb_ops/views_detail.h"

#include <atomic>
#include <numbers>

#include <tbb/parallel_for.h>

#include "vdb_ops/distance_map_detail.h"
#include "vdb_ops/thickness_detail.h"
#include "vdb_ops/topology_detail.h"

namespace taihu {
namespace {

/// Parallel rays through the samples of a lattice, all lengths in samples.
class View {
public:
    View(const DenseLattice& lattice, std::span<const float> distances, double azimuth)
        : lattice_(lattice), distances_(distances) {
        along_ = Vec3{std::cos(azimuth), 0, std::sin(azimuth)};
        side_ = Vec3{-along_.z, 0, along_.x};
        const double half =
            0.5 * (std::abs(side_.x) * (lattice.n[0] - 1) + std::abs(side_.z) * (lattice.n[2] - 1));
        // Windows are what is enclosed in the one plane of this lattice.
        picture_.n[0] = 1;
        picture_.n[1] = lattice.n[1];
        picture_.n[2] = 2 * static_cast<int>(std::ceil(half)) + 1;
        std::vector<float> seen(picture_.size());
        for (int y = 0; y < picture_.n[1]; ++y)
            for (int i = 0; i < picture_.n[2]; ++i)
                seen[picture_.at(0, y, i)] = blocked(across(i), y) ? -1.f : 1.f;
        windows_ = enclosed_voids(picture_, seen, nullptr);
        for (std::size_t i = 0; i < seen.size(); ++i) {
            n_open_ += windows_[i];
            n_outline_ += windows_[i] || seen[i] < 0;
        }
    }

    double open_share() const {
        return n_outline_ > 0 ? static_cast<double>(n_open_) / static_cast<double>(n_outline_) : 0;
    }
    std::size_t n_windows(double least_pixels) const {
        const Pieces pieces(picture_, windows_, Adjacency::faces);
        std::size_t n = 0;
        for (std::uint32_t p = 0; p < pieces.size(); ++p)
            n += static_cast<double>(pieces.n_samples(p)) >= least_pixels;
        return n;
    }
    /// Radius of the thickest rod along the view that passes a window: of the largest circle in it.
    double widest() const {
        if (n_open_ == 0)
            return 0;
        // The outline of a window lies between pixels, where the least distances change sign.
        std::vector<float> least(picture_.size(), 3);
        for (int y = 1; y + 1 < picture_.n[1]; ++y)
            for (int i = 1; i + 1 < picture_.n[2]; ++i) {
                const std::size_t p = picture_.at(0, y, i), row = picture_.stride(1);
                if (windows_[p] || windows_[p - 1] || windows_[p + 1] || windows_[p - row] ||
                    windows_[p + row])
                    least[p] = least_distance(across(i), y);
            }
        const std::vector<float> open = signed_distances(picture_, least, 0, nullptr);
        float best = 0;
        for (int y = 0; y < picture_.n[1]; ++y)
            for (int i = 0; i < picture_.n[2]; ++i)
                if (windows_[picture_.at(0, y, i)])
                    best = std::max(best, ridge_ball(picture_, open, 0, y, i).radius);
        return static_cast<double>(best);
    }

private:
    double across(int i) const { return i - 0.5 * (picture_.n[2] - 1); }

    struct Ray {
        Vec3 from;
        double end;
    };
    /// Where the lattice is: it is air beyond.
    Ray ray(double s, double y) const {
        const Vec3 middle{0.5 * (lattice_.n[0] - 1) + side_.x * s, y,
                          0.5 * (lattice_.n[2] - 1) + side_.z * s};
        double begin = -1e9, end = 1e9;
        for (const int a : {0, 2}) {
            if (std::abs(along_[a]) < 1e-12) {
                if (middle[a] < 0 || middle[a] > lattice_.n[a] - 1)
                    end = begin;
                continue;
            }
            const double p = -middle[a] / along_[a];
            const double q = (lattice_.n[a] - 1 - middle[a]) / along_[a];
            begin = std::max(begin, std::min(p, q));
            end = std::min(end, std::max(p, q));
        }
        return {middle + along_ * begin, end - begin};
    }
    double distance(const Vec3& p) const {
        return static_cast<double>(trilinear(lattice_, distances_.data(), p));
    }
    bool blocked(double s, double y) const {
        const Ray r = ray(s, y);
        for (double t = 0; t < r.end;) {
            const double d = distance(r.from + along_ * t);
            if (d < 0)
                return true;
            t += std::max(0.95 * d, 0.25);
        }
        return false;
    }
    /// Of the ray from the solid; negative where it passes through.
    float least_distance(double s, double y) const {
        const Ray r = ray(s, y);
        double least = 3;
        for (double t = 0; t < r.end;) {
            const double d = distance(r.from + along_ * t);
            least = std::min(least, d);
            t += std::max(0.95 * (d - least), 0.25); // nearer than that it cannot come
        }
        return static_cast<float>(least);
    }

    const DenseLattice& lattice_;
    std::span<const float> distances_;
    Vec3 along_, side_;
    DenseLattice picture_;
    std::vector<std::uint8_t> windows_;
    std::size_t n_open_ = 0, n_outline_ = 0;
};

} // namespace

ViewMeasures measure_views(const DenseLattice& lattice, std::span<const float> distances,
                           int n_views, double least_m, Progress* progress) {
    std::vector<ViewMeasures> views(static_cast<std::size_t>(n_views));
    const double least = least_m / lattice.voxel_m,
                 least_pixels = std::max(std::numbers::pi / 4 * least * least, 1.0);
    std::atomic<int> n_done{0};
    tbb::parallel_for(0, n_views, [&](int k) {
        check_cancelled(progress);
        const View view(lattice, distances, std::numbers::pi * k / n_views); // the rest looks back
        ViewMeasures& m = views[static_cast<std::size_t>(k)];
        m.open_share = view.open_share();
        m.windows_per_view = static_cast<double>(view.n_windows(least_pixels));
        m.share_with_window = m.windows_per_view > 0;
        m.widest_m = 2 * view.widest() * lattice.voxel_m;
        report_fraction(progress, static_cast<double>(++n_done) / n_views);
    });
    ViewMeasures mean;
    for (const ViewMeasures& view : views) {
        mean.open_share += view.open_share / n_views;
        mean.share_with_window += view.share_with_window / n_views;
        mean.windows_per_view += view.windows_per_view / n_views;
        mean.widest_m = std::max(mean.widest_m, view.widest_m);
    }
    return mean;
}

} // namespace taihu
