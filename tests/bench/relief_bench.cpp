// relief_bench: the frame that Tsuruoka et al., Rugged Texture Generation by Stochastic Models,
// give a time for, again: a sphere of 100 pixels radius under a broken-rock relief, 15 bits a
// pixel, "about five minutes per frame" on a 16-bit minicomputer. Medians of 15, by the clock and
// of one processor. To run it:
//   cmake --preset bench && cmake --build build/bench --target relief_bench
//   build/bench/tests/bench/relief_bench
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <vector>

#include <fmt/format.h>
#include <tbb/global_control.h>

#include "vdb_ops/reflection.h"
#include "vdb_ops/relief.h"
#include "vdb_ops/relief_around.h"

namespace taihu {
namespace {

constexpr int kRadius_px = 100, kRuns = 15;
constexpr double kThen_s = 300;

/// The sphere from the front, 5 bits a colour.
std::vector<std::uint16_t> frame(const ReliefAround& around, const ReliefMaterial& material) {
    const Vec3 light = DistantLight{}.direction(), viewer{0, 0, 1};
    std::vector<std::uint16_t> picture(std::size_t{4} * kRadius_px * kRadius_px);
    for (int y = 0; y < 2 * kRadius_px; ++y)
        for (int x = 0; x < 2 * kRadius_px; ++x) {
            const Vec3 p{(x + 0.5) / kRadius_px - 1, 1 - (y + 0.5) / kRadius_px, 0};
            const double z2 = 1 - dot(p, p);
            if (z2 <= 0)
                continue;
            const Vec3 n{p.x, p.y, std::sqrt(z2)};
            const double bright =
                intensity(material.reflection, around.bumped(n, n), light, viewer);
            std::uint16_t bits = 0;
            for (int c = 0; c < 3; ++c)
                bits = static_cast<std::uint16_t>(
                    bits << 5 | std::lround(31 * std::clamp(bright * material.color[c], 0.0, 1.0)));
            picture[static_cast<std::size_t>(y * 2 * kRadius_px + x)] = bits;
        }
    return picture;
}

/// Seconds by the clock, the median of the runs.
template <class Work>
double median_s(Work&& work) {
    std::vector<double> took;
    for (int run = 0; run < kRuns; ++run) {
        const auto begin = std::chrono::steady_clock::now();
        work();
        took.push_back(
            std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    }
    std::nth_element(took.begin(), took.begin() + kRuns / 2, took.end());
    return took[kRuns / 2];
}

} // namespace
} // namespace taihu

int main() {
    using namespace taihu;
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const ReliefPreset& preset = relief_preset("broken-rock");
    fmt::print("sphere of {} px radius        then s       now s      faster\n", kRadius_px);
    std::size_t n_shades = 0;
    for (const double hurst : {0.3, 0.8}) { // the two of its Plate 1
        ReliefSettings settings = preset.settings;
        settings.hurst = hurst;
        // Once round the sphere of radius 1.
        const auto around = [&] {
            ReliefTile tile = make_relief(settings);
            return ReliefAround(std::move(tile.heights), 3.1416 / settings.size_px, tile.tileable,
                                ReliefMap::sphere, {{-1, -1, -1}, {1, 1, 1}});
        };
        std::vector<std::uint16_t> picture;
        const double whole_s = median_s([&] { picture = frame(around(), preset.material); });
        const ReliefAround made = around();
        const double shading_s = median_s([&] { picture = frame(made, preset.material); });
        fmt::print("h {:.1f}: texture and frame   {:>8.0f}  {:>10.4f}  {:>8.0f} x\n", hurst,
                   kThen_s, whole_s, kThen_s / whole_s);
        fmt::print("h {:.1f}: frame alone                   {:>10.4f}\n", hurst, shading_s);
        std::sort(picture.begin(), picture.end());
        n_shades +=
            static_cast<std::size_t>(std::unique(picture.begin(), picture.end()) - picture.begin());
    }
    return n_shades > 20 ? 0 : 1; // else nothing was drawn
}
