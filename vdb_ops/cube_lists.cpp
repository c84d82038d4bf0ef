#include <algorithm>
#include <atomic>
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

CubeLists::Hit* CubeLists::Hits::room_for(std::size_t n) {
    if (size_ + n > room_) {
        room_ = std::max(2 * room_, size_ + n);
        auto larger = std::make_unique_for_overwrite<Hit[]>(room_);
        std::copy(begin(), end(), larger.get());
        hits_ = std::move(larger);
    }
    return hits_.get() + size_;
}

inline bool CubeLists::box_of(const VoxelBall& ball, openvdb::Coord& lo, openvdb::Coord& hi) const {
    const double reach = ball.r + half_width_ + kMargin;
    for (int axis = 0; axis < 3; ++axis) {
        const double from = (ball.center[axis] - reach) * inverse_size_;
        const double to = (ball.center[axis] + reach) * inverse_size_, last = n_[axis] - 1;
        if (!(to >= 0 && from < last + 1))
            return false;
        lo[axis] = static_cast<int>(std::max(from, 0.0));
        hi[axis] = static_cast<int>(std::min(to, last));
    }
    return true;
}

double CubeLists::n_looked_at(const VoxelBall& ball) const {
    openvdb::Coord lo, hi;
    return box_of(ball, lo, hi) ? double(openvdb::CoordBBox(lo, hi).volume()) : 0;
}

void CubeLists::find(const VoxelBall& ball, std::uint32_t number, Hits& hits) {
    openvdb::Coord lo, hi;
    if (!box_of(ball, lo, hi))
        return;
    const double reach = ball.r + half_width_ + kMargin, inner = ball.r - half_width_ - kMargin;
    const double reach2 = reach * reach, inner2 = inner * inner;
    const double edge = size_ - 1; // from the first voxel of a cube to its last
    const bool may_cover = inner >= std::sqrt(0.75) * edge;
    const Vec3 c = ball.center;
    Hit* const first = hits.room_for(openvdb::CoordBBox(lo, hi).volume());
    Hit* hit = first;
    for (int i = lo.x(); i <= hi.x(); ++i) {
        const double x = i * size_, near_x2 = nearest2(c.x, x, x + edge),
                     far_x2 = farthest2(c.x, x, x + edge);
        for (int j = lo.y(); j <= hi.y(); ++j) {
            const double y = j * size_, near2 = near_x2 + nearest2(c.y, y, y + edge),
                         far2 = far_x2 + farthest2(c.y, y, y + edge);
            std::size_t cube = index(i, j, lo.z());
            double z = lo.z() * size_;
            for (int k = lo.z(); k <= hi.z(); ++k, ++cube, z += size_) {
                const std::atomic_ref<char> covered(covered_[cube]);
                if (may_cover && far2 + farthest2(c.z, z, z + edge) <= inner2)
                    covered.store(1, std::memory_order_relaxed);
                // Written in any case and kept if it counts: no branch to guess wrong.
                *hit = {static_cast<std::uint32_t>(cube), number};
                const int is_near = near2 + nearest2(c.z, z, z + edge) < reach2;
                const int is_open = !covered.load(std::memory_order_relaxed);
                hit += is_near & is_open;
            }
        }
    }
    hits.size_ += static_cast<std::size_t>(hit - first);
}

void CubeLists::sort(std::span<const Hits> hits) {
    const std::size_t n_cubes = covered_.size();
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
