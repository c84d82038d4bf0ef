#include <algorithm>
#include <cmath>

#include "vdb_ops/cube_lists_detail.h"

namespace taihu {
namespace {

constexpr double kMargin = 1e-3; // voxels: more than rounding does

/// A row of cubes along one axis, seen from a point at `c`.
struct Row {
    double c, size;

    double nearest2(int i) const { // of the voxels of cube i, squared
        const double first = i * size, out = std::max({first - c, c - (first + size - 1), 0.0});
        return out * out;
    }
    double farthest2(int i) const {
        const double first = i * size, far = std::max(c - first, first + size - 1 - c);
        return far * far;
    }
};

} // namespace

void CubeLists::find(const VoxelBall& ball, std::uint32_t number, std::vector<Hit>& hits) const {
    const double reach = ball.r + half_width_ + kMargin, inner = ball.r - half_width_ - kMargin;
    const double reach2 = reach * reach;
    int lo[3], hi[3];
    for (int axis = 0; axis < 3; ++axis) {
        const double c = ball.center[axis];
        lo[axis] =
            static_cast<int>(std::clamp(std::floor((c - reach) / size_), 0.0, double(n_[axis])));
        hi[axis] =
            static_cast<int>(std::clamp(std::floor((c + reach) / size_), -1.0, n_[axis] - 1.0));
        if (lo[axis] > hi[axis])
            return;
    }
    const Row x{ball.center.x, double(size_)}, y{ball.center.y, double(size_)},
        z{ball.center.z, double(size_)};
    const double half_diagonal = std::sqrt(0.75) * (size_ - 1);
    const bool may_cover = inner >= half_diagonal;
    std::size_t n = hits.size();
    for (int i = lo[0]; i <= hi[0]; ++i)
        for (int j = lo[1]; j <= hi[1]; ++j) {
            const double near2 = x.nearest2(i) + y.nearest2(j);
            if (near2 >= reach2)
                continue;
            hits.resize(n + static_cast<std::size_t>(hi[2] - lo[2] + 1));
            const double far2 = x.farthest2(i) + y.farthest2(j);
            for (int k = lo[2]; k <= hi[2]; ++k) {
                const bool covered = may_cover && far2 + z.farthest2(k) <= inner * inner;
                // Written in any case and kept if it counts: no branch to guess wrong.
                hits[n] = {static_cast<std::uint32_t>(index(i, j, k)), covered ? kCovered : number};
                n += near2 + z.nearest2(k) < reach2;
            }
        }
    hits.resize(n);
}

void CubeLists::sort(std::span<const std::vector<Hit>> hits) {
    const std::size_t n_cubes = index(n_.x(), 0, 0);
    covered_.assign(n_cubes, 0);
    for (const auto& part : hits)
        for (const Hit& hit : part)
            if (hit.ball == kCovered)
                covered_[hit.cube] = 1;
    first_.assign(n_cubes + 1, 0);
    for (const auto& part : hits)
        for (const Hit& hit : part)
            first_[hit.cube + 1] += !covered_[hit.cube];
    for (std::size_t i = 0; i < n_cubes; ++i)
        first_[i + 1] += first_[i];
    balls_.resize(first_[n_cubes]);
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for (const auto& part : hits)
        for (const Hit& hit : part)
            if (!covered_[hit.cube])
                balls_[next[hit.cube]++] = hit.ball;
}

} // namespace taihu
