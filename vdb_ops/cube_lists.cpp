#include <algorithm>
#include <cmath>

#include "vdb_ops/cube_lists_detail.h"

namespace taihu {
namespace {

constexpr double kMargin = 1e-3; // voxels: more than rounding does

/// Squared distance along one axis from `c` to the nearest of the voxels `first` to `last`.
double nearest2(double c, double first, double last) {
    const double out = std::max(std::max(first - c, c - last), 0.0);
    return out * out;
}

double farthest2(double c, double first, double last) {
    const double far = std::max(c - first, last - c);
    return far * far;
}

} // namespace

void CubeLists::find(const VoxelBall& ball, std::uint32_t number, std::vector<Hit>& hits) const {
    const double reach = ball.r + half_width_ + kMargin, inner = ball.r - half_width_ - kMargin;
    const double reach2 = reach * reach, inner2 = inner * inner;
    const double size = size_, edge = size - 1; // from the first voxel to the last
    const bool may_cover = inner >= std::sqrt(0.75) * edge;
    const Vec3 c = ball.center;
    int lo[3], hi[3];
    std::size_t n_box = 1;
    for (int axis = 0; axis < 3; ++axis) {
        const double from = (c[axis] - reach) * inverse_size_;
        const double to = (c[axis] + reach) * inverse_size_, last = n_[axis] - 1;
        if (!(to >= 0 && from < last + 1))
            return;
        lo[axis] = static_cast<int>(std::max(from, 0.0));
        hi[axis] = static_cast<int>(std::min(to, last));
        n_box *= static_cast<std::size_t>(hi[axis] - lo[axis] + 1);
    }
    std::size_t n = hits.size();
    hits.resize(n + n_box);
    for (int i = lo[0]; i <= hi[0]; ++i) {
        const double x = i * size, near_x2 = nearest2(c.x, x, x + edge),
                     far_x2 = farthest2(c.x, x, x + edge);
        for (int j = lo[1]; j <= hi[1]; ++j) {
            const double y = j * size, near2 = near_x2 + nearest2(c.y, y, y + edge),
                         far2 = far_x2 + farthest2(c.y, y, y + edge);
            auto cube = static_cast<std::uint32_t>(index(i, j, lo[2]));
            double z = lo[2] * size;
            for (int k = lo[2]; k <= hi[2]; ++k, ++cube, z += size) {
                const bool covered = may_cover && far2 + farthest2(c.z, z, z + edge) <= inner2;
                // Written in any case and kept if it counts: no branch to guess wrong.
                hits[n] = {cube, covered ? kCovered : number};
                n += near2 + nearest2(c.z, z, z + edge) < reach2;
            }
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
