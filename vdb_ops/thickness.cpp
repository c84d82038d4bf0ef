#include "vdb_ops/thickness_detail.h"

#include <array>
#include <atomic>
#include <map>
#include <numeric>
#include <tuple>

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

namespace taihu {
namespace {

// Away from the medial surface a distance changes by 1 a sample; less than this on it. Ridges of
// walls that open wider than 144 degrees are left out: a ball beside them covers what theirs would
// within 5 % of its radius.
constexpr float kRidgeSlope = 0.95f;
// Samples this near to a ball belong to it: centres lie on ridges only to within so much.
constexpr float kCover = 0.5f;

/// Central differences of the distances, squared length.
float slope_squared(const DenseLattice& lattice, std::span<const float> d, std::size_t i) {
    float sum = 0;
    for (int a = 0; a < 3; ++a) {
        const float g = 0.5f * (d[i + lattice.stride(a)] - d[i - lattice.stride(a)]);
        sum += g * g;
    }
    return sum;
}

std::vector<RidgeBall> ridge_balls(const DenseLattice& lattice, std::span<const float> d,
                                   const Progress* progress) {
    std::vector<std::vector<RidgeBall>> by_plane(static_cast<std::size_t>(lattice.n[0]));
    tbb::parallel_for(1, std::max(lattice.n[0] - 1, 1), [&](int x) {
        check_cancelled(progress);
        for (int y = 1; y + 1 < lattice.n[1]; ++y)
            for (int z = 1; z + 1 < lattice.n[2]; ++z) {
                const std::size_t i = lattice.at(x, y, z);
                if (d[i] < 0 && slope_squared(lattice, d, i) < kRidgeSlope * kRidgeSlope)
                    by_plane[static_cast<std::size_t>(x)].push_back(
                        ridge_ball(lattice, d, x, y, z));
            }
    });
    std::vector<RidgeBall> all;
    for (auto& plane : by_plane) {
        all.insert(all.end(), plane.begin(), plane.end());
        std::vector<RidgeBall>().swap(plane);
    }
    tbb::parallel_sort(all.begin(), all.end(), [](const RidgeBall& a, const RidgeBall& b) {
        return std::tie(b.radius, a.x, a.y, a.z) < std::tie(a.radius, b.x, b.y, b.z);
    });
    return all;
}

/// One plane of samples, painted by balls of falling radius.
class PaintedPlane {
public:
    PaintedPlane(const DenseLattice& lattice, std::span<const float> d, int x)
        : x_(x), ny_(lattice.n[1]), nz_(lattice.n[2]),
          next_(static_cast<std::size_t>(ny_) * static_cast<std::size_t>(nz_ + 1)) {
        for (int y = 0; y < ny_; ++y) {
            next_[at(y, nz_)] = nz_;
            for (int z = nz_ - 1; z >= 0; --z)
                next_[at(y, z)] = d[lattice.at(x, y, z)] < 0 ? z : next_[at(y, z + 1)];
        }
    }

    /// How many samples nobody painted before.
    std::uint32_t paint(const RidgeBall& ball) {
        const float reach = ball.radius + kCover, dx = static_cast<float>(x_) - ball.x;
        const float in_plane = reach * reach - dx * dx;
        if (in_plane <= 0)
            return 0;
        const float half = std::sqrt(in_plane);
        std::uint32_t n = 0;
        for (int y = std::max(0, static_cast<int>(std::ceil(ball.y - half)));
             y < ny_ && static_cast<float>(y) <= ball.y + half; ++y) {
            const float dy = static_cast<float>(y) - ball.y, w2 = in_plane - dy * dy;
            const float w = std::sqrt(std::max(w2, 0.f));
            const int last = std::min(nz_ - 1, static_cast<int>(std::floor(ball.z + w)));
            for (int z = unpainted(y, std::max(0, static_cast<int>(std::ceil(ball.z - w))));
                 z <= last; z = unpainted(y, z)) {
                next_[at(y, z)] = z + 1;
                ++n;
            }
        }
        return n;
    }

    template <class Fn>
    void each_unpainted(const Fn& fn) {
        for (int y = 0; y < ny_; ++y)
            for (int z = unpainted(y, 0); z < nz_; z = unpainted(y, z + 1))
                fn(y, z);
    }

private:
    std::size_t at(int y, int z) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(nz_ + 1) +
               static_cast<std::size_t>(z);
    }
    int unpainted(int y, int z) {
        if (z > nz_)
            return nz_;
        while (next_[at(y, z)] != z) // the way is halved for the next who comes
            z = next_[at(y, z)] = next_[at(y, next_[at(y, z)])];
        return z;
    }

    int x_, ny_, nz_;
    std::vector<int> next_; // of each row: a sample at or after this one that may be unpainted
};

} // namespace

RidgeBall ridge_ball(const DenseLattice& lattice, std::span<const float> distances, int x, int y,
                     int z) {
    const std::size_t i = lattice.at(x, y, z);
    const float here = std::abs(distances[i]), sign = distances[i] < 0 ? -1.f : 1.f;
    RidgeBall best{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z), here};
    for (int dx = -1; dx <= 1; ++dx)
        for (int dy = -1; dy <= 1; ++dy)
            for (int dz = -1; dz <= 1; ++dz) {
                const int by[3] = {dx, dy, dz}, to[3] = {x + dx, y + dy, z + dz};
                bool room = dx != 0 || dy != 0 || dz != 0;
                for (int a = 0; a < 3; ++a) // a picture is a lattice of one plane
                    room &= by[a] == 0 || (to[a] >= 2 && to[a] + 2 < lattice.n[a]);
                if (!room)
                    continue;
                const auto step = static_cast<std::ptrdiff_t>(lattice.at(to[0], to[1], to[2])) -
                                  static_cast<std::ptrdiff_t>(i);
                const auto depth = [&](std::ptrdiff_t k) {
                    return sign * distances[static_cast<std::size_t>(
                                      static_cast<std::ptrdiff_t>(i) + k * step)];
                };
                const float rise = here - depth(-1), fall = depth(1) - depth(2);
                if (!(rise > 0 && fall > 0))
                    continue;
                const float s = (depth(1) - here + fall) / (rise + fall), peak = here + rise * s;
                if (s >= 0 && s <= 1 && peak > best.radius)
                    best = {static_cast<float>(x) + s * static_cast<float>(dx),
                            static_cast<float>(y) + s * static_cast<float>(dy),
                            static_cast<float>(z) + s * static_cast<float>(dz), peak};
            }
    return best;
}

SizeCounts local_thickness(const DenseLattice& lattice, std::span<const float> distances,
                           Progress* progress) {
    const std::vector<RidgeBall> balls = ridge_balls(lattice, distances, progress);
    std::vector<std::atomic<std::uint32_t>> painted(balls.size());
    std::vector<std::vector<float>> left(static_cast<std::size_t>(lattice.n[0]));
    std::atomic<int> n_done{0};
    tbb::parallel_for(0, lattice.n[0], [&](int x) {
        check_cancelled(progress);
        PaintedPlane plane(lattice, distances, x);
        for (std::size_t b = 0; b < balls.size(); ++b)
            if (const std::uint32_t n = plane.paint(balls[b]))
                painted[b].fetch_add(n, std::memory_order_relaxed);
        // In corners that no ball of the ridges reaches, a sample's own ball is what there is.
        plane.each_unpainted([&](int y, int z) {
            left[static_cast<std::size_t>(x)].push_back(-distances[lattice.at(x, y, z)]);
        });
        report_fraction(progress, static_cast<double>(++n_done) / lattice.n[0]);
    });
    std::map<float, std::uint64_t> by_diameter;
    for (std::size_t b = 0; b < balls.size(); ++b)
        if (painted[b] > 0)
            by_diameter[2 * balls[b].radius] += painted[b];
    for (const auto& plane : left)
        for (const float radius : plane)
            ++by_diameter[2 * radius];
    return {by_diameter.begin(), by_diameter.end()};
}

} // namespace taihu
