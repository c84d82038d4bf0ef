#include "vdb_ops/midpoint_relief.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <tbb/parallel_for.h>

#include "stats/core/error.h"
#include "stats/core/portable_math.h"
#include "stats/core/rng.h"
#include "stats/number_detail.h"
#include "vdb_ops/relief_math_detail.h"

namespace taihu {
namespace {

constexpr std::uint32_t kMidpointStream = 0x6d696470; // "midp"
constexpr std::uint32_t kCornerStream = 0x636f726e;   // "corn"
constexpr int kMaxSide = 8192, kMaxLevels = 13;

void require(bool ok, const std::string& what) {
    if (!ok)
        throw Error(Fault::bad_argument, "relief: " + what);
}

void check(const MidpointSettings& s, std::size_t n_corners) {
    require(s.hurst >= 0 && s.hurst <= 2, "hurst is " + shortest(s.hurst) + ", must be 0..2");
    require(s.amplitude_m >= 0 && s.amplitude_m <= 1e6,
            "amplitude_m is " + shortest(s.amplitude_m) + ", must be 0..1e6");
    require(s.patches >= 1 && s.patches <= 4096 && s.levels >= 0 && s.levels <= kMaxLevels &&
                s.patches <= kMaxSide >> s.levels,
            std::to_string(s.patches) + " patches of " + std::to_string(s.levels) +
                " levels; patches * 2^levels must be 1..8192");
    require(s.law == MidpointLaw::free || s.draws == MidpointDraws::uniform,
            "a casting's midpoints lie between their neighbours, Gaussian draws do not; use "
            "uniform ones");
    require(s.corners_m.empty() || s.corners_m.size() == n_corners,
            std::to_string(s.corners_m.size()) + " corners are given; " +
                std::to_string(s.patches) + " patches a side have " + std::to_string(n_corners));
    for (const double h : s.corners_m)
        require(std::abs(h) <= 1e6, "a corner is " + shortest(h) + " m high, must be -1e6..1e6");
}

class Subdivision {
public:
    explicit Subdivision(const MidpointSettings& settings)
        : settings_(settings), draws_{settings.seed, kMidpointStream},
          n_(static_cast<std::size_t>(settings.patches << settings.levels) + !settings.tileable),
          heights_(n_ * n_) {
        const auto n_corners = static_cast<std::size_t>(settings.patches + !settings.tileable);
        const Rng corners{settings.seed, kCornerStream};
        for (std::size_t y = 0; y < n_corners; ++y)
            for (std::size_t x = 0; x < n_corners; ++x)
                at(x << settings.levels, y << settings.levels) =
                    settings.corners_m.empty()
                        ? settings.amplitude_m * (corners.uniform(y << 32 | x) - 0.5)
                        : settings.corners_m[y * n_corners + x];
    }

    /// All that stage `n` adds depends on what was there before alone, so rows go in any order.
    void stage(int n, double scale) {
        const std::size_t half = std::size_t{1} << (settings_.levels - n - 1);
        tbb::parallel_for(std::size_t{0}, (n_ + half - 1) / half, [&](std::size_t j) {
            const std::size_t y = j * half;
            for (std::size_t i = 1 - j % 2; i * half < n_; i += 1 + (j + 1) % 2) {
                const std::size_t x = i * half;
                const double g = draw(n, j << 32 | i);
                if (j % 2 == 0)
                    at(x, y) = moved({at(x - half, y), at(next(x + half), y)}, g * scale);
                else if (i % 2 == 0)
                    at(x, y) = moved({at(x, y - half), at(x, next(y + half))}, g * scale);
                else
                    at(x, y) =
                        moved({at(x - half, y - half), at(next(x + half), y - half),
                               at(x - half, next(y + half)), at(next(x + half), next(y + half))},
                              g * scale);
            }
        });
    }

    Image image() const {
        const int side = static_cast<int>(n_);
        Image out(side, side, 1);
        std::transform(heights_.begin(), heights_.end(), out.pixels.begin(),
                       [](double h) { return static_cast<float>(h); });
        return out;
    }

private:
    double& at(std::size_t x, std::size_t y) { return heights_[y * n_ + x]; }
    std::size_t next(std::size_t x) const { return x < n_ ? x : x - n_; }

    /// The random number g of one point of one stage.
    double draw(int stage, std::uint64_t item) const {
        const auto first = static_cast<std::uint32_t>(stage) << 16;
        if (settings_.draws == MidpointDraws::uniform)
            return draws_.uniform(item, first) - 0.5;
        for (std::uint32_t i = 0;; i += 2) { // Marsaglia's polar method: no sine
            const double u = 2 * draws_.uniform(item, first + i) - 1,
                         v = 2 * draws_.uniform(item, first + i + 1) - 1, s = u * u + v * v;
            if (s < 1)
                return u * std::sqrt(-2 * portable_log(s) / s / 12);
        }
    }

    double moved(std::initializer_list<double> from, double by) const {
        double sum = 0;
        for (const double f : from)
            sum += f;
        const double mean = sum / static_cast<double>(from.size());
        if (settings_.law == MidpointLaw::free)
            return mean + settings_.amplitude_m * by;
        const auto [lo, hi] = std::minmax_element(from.begin(), from.end());
        const double room = 2 * std::min(mean - *lo, *hi - mean);
        return std::clamp(mean + room * by, *lo, *hi); // rounding must not leave them either
    }

    const MidpointSettings& settings_;
    Rng draws_;
    std::size_t n_;
    std::vector<double> heights_;
};

} // namespace

Image midpoint_heights(const MidpointSettings& settings, Progress* progress) {
    const auto side = static_cast<std::size_t>(settings.patches + !settings.tileable);
    check(settings, side * side);
    Subdivision lattice(settings);
    report_stage(progress, "relief");
    const double ratio = half_to_the(settings.hurst);
    double scale = 1;
    for (int n = 0; n < settings.levels; ++n, scale *= ratio) {
        check_cancelled(progress);
        lattice.stage(n, scale);
        report_fraction(progress, static_cast<double>(n + 1) / settings.levels);
    }
    check_cancelled(progress);
    return lattice.image();
}

} // namespace taihu
