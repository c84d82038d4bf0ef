#include "tests/support/bound_check.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "stats/core/rng.h"
#include "tests/support/cgal_oracle.h"

namespace taihu {
namespace {

constexpr double kMeshSpacing = 1.0 / 3, kSurfaceSpacing = 0.5; // voxels
/// Fields hold voxels as floats, and agree with formulas to 1e-5 voxels and better.
constexpr double kRounding = 1e-3; // voxels
constexpr std::size_t kClimbed =
    400; ///< far samples of the surface that farther ones are sought by

bool in_any(std::span<const Sphere> balls, const Vec3& p) {
    return std::any_of(balls.begin(), balls.end(),
                       [&](const Sphere& b) { return length(p - b.center) <= b.radius_m; });
}

void note(OffBound& off, const Vec3& p, double rel, bool thin) {
    ++off.n;
    off.n_thin += thin;
    if (rel > off.worst_rel) {
        off.worst_rel = rel;
        off.worst = p;
    }
}

} // namespace

BoundCheck::BoundCheck(Lipschitz formula, const Box& box, double voxel_m)
    : formula_(std::move(formula)), voxel_m_(voxel_m),
      // Off the lattice of the voxels, on which awkward surfaces lie.
      points_(
          surface_crossings(formula_, box.dilated(2.0371 * voxel_m), kSurfaceSpacing * voxel_m)) {}

bool BoundCheck::is_thin(const Vec3& on_surface) const {
    const Vec3 n = gradient(formula_, on_surface, 0.01 * voxel_m_);
    for (int i = 1; i <= 8; ++i) {
        const Vec3 to = n * (i * voxel_m_ / 8);
        if (formula_(on_surface + to) < 0 || formula_(on_surface - to) > 0)
            return true;
    }
    return false;
}

bool BoundCheck::is_near_thin(const Vec3& p) const {
    for (std::size_t i = 0; i < points_.size(); ++i)
        if (is_thin_[i] && length(points_[i] - p) < 1.5 * voxel_m_)
            return true;
    return false;
}

void BoundCheck::judge_mesh(const TriMesh& mesh, double bound_m, std::span<const Sphere> named,
                            BoundVerdict& verdict) const {
    const double reach_m = bound_m + kRounding * voxel_m_;
    std::mutex lock; // sums and maxima only, and all that depends on the order is which of equals
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, mesh.triangles.size(), 64), [&](const auto& range) {
            std::size_t n_samples = 0, n_named = 0, n_unclear = 0;
            std::vector<Vec3> beyond;
            for (std::size_t t = range.begin(); t < range.end(); ++t) {
                const auto [ia, ib, ic] = mesh.triangles[t];
                const Vec3 &a = mesh.positions[ia], &b = mesh.positions[ib],
                           &c = mesh.positions[ic];
                const Vec3 out = normalized(cross(b - a, c - a)) * reach_m;
                const double edge = std::max({length(b - a), length(c - b), length(a - c)});
                const int n = std::clamp(
                    static_cast<int>(std::ceil(edge / (kMeshSpacing * voxel_m_))), 2, 96);
                for (int u = 0; u <= n; ++u)
                    for (int v = 0; u + v <= n; ++v) {
                        const Vec3 p = a + (b - a) * (double(u) / n) + (c - a) * (double(v) / n);
                        ++n_samples;
                        if ((formula_(p + out) < 0) != (formula_(p - out) < 0))
                            continue; // it passes between them
                        if (in_any(named, p)) {
                            ++n_named;
                            continue;
                        }
                        const Nearby nearby = surface_within(formula_, p, reach_m);
                        n_unclear += nearby == Nearby::unclear;
                        if (nearby == Nearby::no)
                            beyond.push_back(p);
                    }
            }
            std::vector<std::pair<double, bool>> found;
            for (const Vec3& p : beyond) {
                double rel = 1;
                while (rel < 8 && surface_within(formula_, p, 1.05 * rel * bound_m) == Nearby::no)
                    rel *= 1.05;
                found.push_back({rel, is_near_thin(p)});
            }
            const std::scoped_lock held(lock);
            verdict.n_samples += n_samples;
            verdict.n_named += n_named;
            verdict.n_unclear += n_unclear;
            for (std::size_t i = 0; i < beyond.size(); ++i)
                note(verdict.mesh, beyond[i], found[i].first, found[i].second);
        });
}

void BoundCheck::judge_surface(const TriMesh& mesh, double bound_m, std::span<const Sphere> named,
                               BoundVerdict& verdict) const {
    const CgalDistance distance(mesh);
    const double reach_m = bound_m + kRounding * voxel_m_;
    std::vector<std::pair<double, Vec3>> far(points_.size()); // negative distances: farthest first
    tbb::parallel_for(std::size_t{0}, points_.size(), [&](std::size_t i) {
        far[i] = {-distance(points_[i]), points_[i]};
    });
    const auto before = [](const auto& a, const auto& b) { return a.first < b.first; };
    std::stable_sort(far.begin(), far.end(), before);
    // Rims lie between samples: other points of the surface around those that are far.
    const std::size_t n_climbed = std::min(kClimbed, far.size());
    tbb::parallel_for(std::size_t{0}, n_climbed, [&](std::size_t i) {
        double& negative = far[i].first;
        Vec3& p = far[i].second;
        if (-negative > reach_m || -negative < 0.5 * bound_m)
            return;
        double radius = kSurfaceSpacing * voxel_m_;
        for (std::uint32_t draw = 0; draw < 48; radius *= draw % 16 == 15 ? 0.5 : 1, ++draw) {
            const auto at = [&](std::uint32_t k) {
                const auto u = [&](std::uint32_t a) {
                    return 2 * Rng{5, 7}.uniform(i, 6 * draw + k + a) - 1;
                };
                return p + Vec3{u(0), u(1), u(2)} * radius;
            };
            const Vec3 from = at(0), to = at(3);
            if ((formula_(from) < 0) == (formula_(to) < 0))
                continue;
            const Vec3 y = crossing_between(formula_, from, to);
            const double d = distance(y);
            if (d > -negative) {
                negative = -d;
                p = y;
            }
        }
    });
    verdict.n_samples += far.size();
    for (const auto& [negative, p] : far) {
        if (-negative <= reach_m)
            continue;
        if (in_any(named, p))
            ++verdict.n_named;
        else
            note(verdict.surface, p, std::min(8.0, -negative / bound_m), is_thin(p));
    }
}

BoundVerdict BoundCheck::judge(const TriMesh& mesh, double bound_m,
                               std::span<const Sphere> named) const {
    BoundVerdict verdict;
    judge_mesh(mesh, bound_m, named, verdict);
    judge_surface(mesh, bound_m, named, verdict);
    return verdict;
}

} // namespace taihu
