#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "stats/sampler.h"
#include "vdb_ops/hole_region_detail.h"
#include "vdb_ops/place.h"

namespace taihu {

inline constexpr std::uint64_t kMaxHoles = 100'000'000;

/// Holes by number, before any are dropped: centres of a pattern about a box, diameters of a law.
/// A hard core has as many as were laid out; the other patterns have no end. Not for lattices.
class HoleSource {
public:
    HoleSource(const Law& law, const Placement& placement, const HoleRegion& region, const Box& box,
               std::uint64_t seed);

    std::uint64_t size() const;
    Sphere hole(std::uint64_t i) const;
    /// How many belong to a process of this density.
    double mean_count(double density_m3) const { return centers_->mean_count(density_m3); }

    /// Lay out the first n of a hard core anew, largest first; other patterns need none of it.
    /// \throws Error numeric: a ball finds no room; bad_argument: more than 1e8.
    void lay_out(double n, Progress* progress);
    /// As many more as it takes to have `wanted` of something that those laid out have `got` of.
    void lay_out_more(double got, double wanted, Progress* progress);

private:
    std::unique_ptr<CenterStream> centers_;
    HoleStream diameters_;
    std::optional<double> gap_m_; ///< of a hard core
    std::vector<Sphere> laid_out_;
};

/// Which holes of a list stay, by the shares of height and place. For one thread.
class Thinning {
public:
    Thinning(const Placement& placement, const HoleRegion& region);
    bool keeps(std::uint64_t i, const Vec3& center) const;

private:
    double share(const Vec3& p) const;
    std::uint64_t seed_;
    std::optional<HeightShare> height_;
    Box box_; ///< of the solid, for the height
    openvdb::FloatGrid::ConstPtr grid_;
    std::optional<openvdb::FloatGrid::ConstAccessor> where_;
};

} // namespace taihu
