#include "tests/support/zero_set.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

namespace taihu {
namespace {

constexpr int kDeepest = 7; ///< halvings of the cube round a ball
constexpr int kMostCubes = 50'000;
const double kHalfDiagonal = std::sqrt(3.0);

class Search {
public:
    Search(const Lipschitz& f, const Vec3& p, double reach_m, int deepest)
        : f_(f), p_(p), reach_m_(reach_m), inside_(f(p) < 0), deepest_(deepest) {}

    /// Whether a point of the other sign is in the part of the cube that is within reach.
    bool in_cube(const Vec3& center, double half, int depth) {
        double gap2 = 0;
        for (int a = 0; a < 3; ++a) {
            const double gap = std::max(0.0, std::fabs(center[a] - p_[a]) - half);
            gap2 += gap * gap;
        }
        if (gap2 > reach_m_ * reach_m_)
            return false;
        if (--n_left_ < 0) {
            unclear_ = true;
            return false;
        }
        const double value = f_(center);
        if ((value < 0) != inside_ && length(center - p_) <= reach_m_)
            return true;
        if ((value < 0) == inside_ && std::fabs(value) > half * kHalfDiagonal)
            return false;
        if (depth == deepest_) {
            unclear_ = true;
            return false;
        }
        for (int i = 0; i < 8; ++i) {
            const Vec3 to{i & 1 ? half / 2 : -half / 2, i & 2 ? half / 2 : -half / 2,
                          i & 4 ? half / 2 : -half / 2};
            if (in_cube(center + to, half / 2, depth + 1))
                return true;
        }
        return false;
    }
    bool unclear() const { return unclear_; }

private:
    const Lipschitz& f_;
    const Vec3 p_;
    const double reach_m_;
    const bool inside_;
    const int deepest_;
    int n_left_ = kMostCubes;
    bool unclear_ = false;
};

/// A block of lattice cells, `1 << level` along an edge.
struct Block {
    std::array<int, 3> at;
    int level;
};

void crossings_in(const Lipschitz& f, const Vec3& origin, double spacing_m, const Block& block,
                  std::vector<Vec3>& out) {
    const auto node = [&](int x, int y, int z) {
        return origin + Vec3{double(x), double(y), double(z)} * spacing_m;
    };
    const auto [x, y, z] = block.at;
    // The lower faces of the cells count, and the edges that go on from there.
    const double half = (1 << block.level) * spacing_m / 2;
    const Vec3 low = node(x, y, z), middle = low + Vec3{half, half, half};
    if (std::fabs(f(middle)) > half * kHalfDiagonal * 1.001)
        return;
    if (block.level == 0) {
        const bool inside = f(low) < 0;
        for (const Vec3& next : {node(x + 1, y, z), node(x, y + 1, z), node(x, y, z + 1)})
            if ((f(next) < 0) != inside)
                out.push_back(crossing_between(f, low, next));
        return;
    }
    const int step = 1 << (block.level - 1);
    for (int i = 0; i < 8; ++i)
        crossings_in(f, origin, spacing_m,
                     {{x + (i & 1 ? step : 0), y + (i & 2 ? step : 0), z + (i & 4 ? step : 0)},
                      block.level - 1},
                     out);
}

} // namespace

Nearby surface_within(const Lipschitz& f, const Vec3& p, double reach_m) {
    // Straight down the slope it mostly is there.
    const double value = f(p);
    const Vec3 down = gradient(f, p, 1e-3 * reach_m) * -std::copysign(1.0, value);
    const Vec3 beyond = p + down * std::min(reach_m, 1.01 * std::fabs(value) + 1e-3 * reach_m);
    if ((f(beyond) < 0) != (value < 0))
        return Nearby::yes;
    for (const int deepest : {3, 5, kDeepest}) {
        Search search(f, p, reach_m, deepest);
        if (search.in_cube(p, reach_m, 0))
            return Nearby::yes;
        if (!search.unclear())
            return Nearby::no;
    }
    return Nearby::unclear;
}

Vec3 gradient(const Lipschitz& f, const Vec3& p, double step_m) {
    Vec3 g;
    for (int a = 0; a < 3; ++a) {
        Vec3 to = p, from = p;
        to[a] += step_m;
        from[a] -= step_m;
        g[a] = f(to) - f(from);
    }
    return length(g) > 0 ? normalized(g) : Vec3{};
}

std::vector<Vec3> surface_crossings(const Lipschitz& f, const Box& box, double spacing_m) {
    constexpr int kLevel = 4;
    const Vec3 size = box.size() / (spacing_m * (1 << kLevel));
    const int nx = static_cast<int>(size.x) + 1, ny = static_cast<int>(size.y) + 1,
              nz = static_cast<int>(size.z) + 1;
    std::vector<std::vector<Vec3>> parts(static_cast<std::size_t>(nx * ny * nz));
    tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t i) {
        const int b = static_cast<int>(i), step = 1 << kLevel;
        crossings_in(f, box.lo, spacing_m,
                     {{b / (ny * nz) * step, b / nz % ny * step, b % nz * step}, kLevel}, parts[i]);
    });
    std::vector<Vec3> all;
    for (const std::vector<Vec3>& part : parts)
        all.insert(all.end(), part.begin(), part.end());
    return all;
}

Vec3 crossing_between(const Lipschitz& f, Vec3 a, Vec3 b) {
    constexpr int kHalvings = 24; // of a voxel: 1e-7 of it
    const bool inside = f(a) < 0;
    for (int i = 0; i < kHalvings; ++i) {
        const Vec3 middle = (a + b) / 2;
        ((f(middle) < 0) == inside ? a : b) = middle;
    }
    return (a + b) / 2;
}

} // namespace taihu
