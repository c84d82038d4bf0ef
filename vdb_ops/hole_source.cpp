#include <algorithm>
#include <cmath>
#include <numeric>

#include <openvdb/tools/Interpolation.h>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/hole_source_detail.h"

namespace taihu {
namespace {

constexpr std::uint64_t kEndless = std::uint64_t{1} << 40; // a centre stream has so many
constexpr std::size_t kMaxTriedJoints = 1'000'000;

/// Joints through points inside the region, so that each of them is seen.
std::vector<JointPlane> joints_through(const HoleRegion& region, int n, std::uint64_t seed) {
    for (std::size_t n_tried = 64; n_tried < kMaxTriedJoints; n_tried *= 4) {
        std::vector<JointPlane> planes = random_joints(region.box(), n_tried, seed);
        std::erase_if(planes, [&](const JointPlane& p) { return !region.inside(p.point); });
        if (planes.size() >= static_cast<std::size_t>(n)) {
            planes.resize(static_cast<std::size_t>(n));
            return planes;
        }
    }
    throw Error(Fault::numeric,
                "holes: the solid fills too little of its box for random joints to meet it; use a "
                "smaller voxel");
}

std::unique_ptr<CenterStream> centers_of(const Pattern& pattern, const HoleRegion& region,
                                         const Box& box, std::uint64_t seed) {
    if (const auto* clusters = std::get_if<ClusterSettings>(&pattern))
        return std::make_unique<ClusterCenters>(box, *clusters, seed);
    if (const auto* joints = std::get_if<JointsPattern>(&pattern))
        return std::make_unique<JointCenters>(box, joints_through(region, joints->n, seed),
                                              joints->scatter_m, seed);
    return std::make_unique<UniformCenters>(box, seed);
}

} // namespace

HoleSource::HoleSource(const Law& law, const Placement& placement, const HoleRegion& region,
                       const Box& box, std::uint64_t seed)
    : centers_(centers_of(placement.pattern, region, box, seed)),
      diameters_(law, box, placement.scale_m, seed) {
    if (const auto* apart = std::get_if<HardCorePattern>(&placement.pattern))
        gap_m_ = apart->gap_m;
}

std::uint64_t HoleSource::size() const {
    return gap_m_ ? laid_out_.size() : kEndless;
}

Sphere HoleSource::hole(std::uint64_t i) const {
    return gap_m_ ? laid_out_[static_cast<std::size_t>(i)]
                  : Sphere{centers_->center(i), diameters_.radius_m(i)};
}

void HoleSource::lay_out(double n, Progress* progress) {
    if (!gap_m_)
        return;
    if (!(n <= static_cast<double>(kMaxHoles)))
        throw Error(Fault::bad_argument,
                    "holes: " + shortest(n) +
                        " would have to be laid out apart, at most 1e8 are; ask for less");
    const auto all = static_cast<std::size_t>(n);
    std::vector<double> radii(all), sorted(all);
    for (std::size_t i = 0; i < all; ++i)
        radii[i] = diameters_.radius_m(i);
    std::vector<std::size_t> order(all);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return radii[a] > radii[b]; });
    for (std::size_t k = 0; k < all; ++k)
        sorted[k] = radii[order[k]];
    const auto centers = hard_core_centers(*centers_, sorted, *gap_m_, progress);
    laid_out_.resize(all);
    for (std::size_t k = 0; k < all; ++k)
        laid_out_[order[k]] = {centers[k], sorted[k]};
}

void HoleSource::lay_out_more(double got, double wanted, Progress* progress) {
    const double factor = got > 0 ? std::clamp(1.05 * wanted / got, 1.1, 4.0) : 4.0;
    lay_out(std::ceil(factor * static_cast<double>(size())) + 16, progress);
}

Thinning::Thinning(const Placement& placement, const HoleRegion& region)
    : seed_(placement.seed), height_(placement.height), grid_(placement.where) {
    if (height_)
        box_ = region.tight();
    if (grid_)
        where_.emplace(grid_->getConstAccessor());
}

bool Thinning::keeps(std::uint64_t i, const Vec3& center) const {
    return (!height_ && !where_) || center_stays(i, share(center), seed_);
}

double Thinning::share(const Vec3& p) const {
    double share = 1;
    if (height_) {
        const double t = std::clamp((p.y - box_.lo.y) / (box_.hi.y - box_.lo.y), 0.0, 1.0);
        share = (1 - t) * height_->bottom + t * height_->top;
    }
    if (where_) {
        const auto at = grid_->transform().worldToIndex(openvdb::Vec3d(p.x, p.y, p.z));
        const double value = openvdb::tools::BoxSampler::sample(*where_, at);
        share *= grid_->getGridClass() == openvdb::GRID_LEVEL_SET ? value < 0 : value;
    }
    return std::clamp(share, 0.0, 1.0); // interpolation may round beyond
}

} // namespace taihu
