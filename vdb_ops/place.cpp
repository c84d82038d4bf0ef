#include "vdb_ops/place.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <openvdb/tools/Interpolation.h>

#include "stats/core/error.h"
#include "stats/sampler.h"
#include "vdb_ops/analytic_field.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

constexpr double kTolerance = 0.005; // of the porosity, absolute
constexpr double kTail = 1e-7;       // share of diameters that the margin round a solid leaves out
constexpr double kMaxSamples = 4e6;  // points at which porosity is counted
constexpr std::uint64_t kMaxHoles = 100'000'000;
constexpr std::uint64_t kMaxStreams = 64; // tried for one porosity
constexpr std::uint32_t kAnotherStream = 0x73747265;

/// Where holes go: a box that holds it, whether a point lies inside, whether a ball meets it.
class Region {
public:
    virtual ~Region() = default;
    virtual Box box() const = 0;
    virtual bool inside(const Vec3& p) const = 0;
    virtual bool meets(const Sphere& ball) const = 0;
};

class BoxRegion final : public Region {
public:
    explicit BoxRegion(const Box& box) : box_(box) {}
    Box box() const override { return box_; }
    bool inside(const Vec3& p) const override { return box_.contains(p); }
    bool meets(const Sphere& ball) const override {
        return box_distance(ball.center - box_.center(), box_.size() * 0.5) < ball.radius_m;
    }

private:
    Box box_;
};

class SolidRegion final : public Region {
public:
    explicit SolidRegion(const openvdb::FloatGrid& grid)
        : lattice_(lattice_of(grid)), accessor_(grid.getConstAccessor()) {
        openvdb::CoordBBox box;
        if (!grid.tree().evalLeafBoundingBox(box))
            throw Error(Fault::bad_argument, "holes: the solid is empty; give one that is not");
        box_.include(world(box.min()));
        box_.include(world(box.max()));
    }
    Box box() const override { return box_; }
    bool inside(const Vec3& p) const override {
        const Vec3 i = (p - lattice_.origin) / lattice_.voxel_m;
        return openvdb::tools::BoxSampler::sample(accessor_, openvdb::Vec3d(i.x, i.y, i.z)) < 0;
    }
    bool meets(const Sphere& ball) const override {
        const Vec3 c = (ball.center - lattice_.origin) / lattice_.voxel_m;
        const double r = ball.radius_m / lattice_.voxel_m;
        const float d =
            openvdb::tools::BoxSampler::sample(accessor_, openvdb::Vec3d(c.x, c.y, c.z));
        if (d < 0.999f * lattice_.half_width_vox * static_cast<float>(lattice_.voxel_m))
            return d < ball.radius_m; // in the band, or inside
        return any_solid_leaf(c, r);
    }

private:
    Vec3 world(const openvdb::Coord& c) const {
        return lattice_.origin +
               Vec3{double(c.x()), double(c.y()), double(c.z())} * lattice_.voxel_m;
    }

    /// Beyond the band: look for solid voxels in the leaves that the ball meets.
    bool any_solid_leaf(const Vec3& c, double r) const {
        openvdb::Coord lo, hi;
        for (int axis = 0; axis < 3; ++axis) {
            const double first = (box_.lo[axis] - lattice_.origin[axis]) / lattice_.voxel_m;
            const double last = (box_.hi[axis] - lattice_.origin[axis]) / lattice_.voxel_m;
            if (c[axis] + r < first || c[axis] - r > last)
                return false;
            lo[axis] = static_cast<int>(std::floor(std::max(c[axis] - r, first))) & ~7;
            hi[axis] = static_cast<int>(std::ceil(std::min(c[axis] + r, last)));
        }
        for (int x = lo.x(); x <= hi.x(); x += 8)
            for (int y = lo.y(); y <= hi.y(); y += 8)
                for (int z = lo.z(); z <= hi.z(); z += 8)
                    if (leaf_meets(openvdb::Coord(x, y, z), c, r))
                        return true;
        return false;
    }

    bool leaf_meets(const openvdb::Coord& origin, const Vec3& c, double r) const {
        const Vec3 middle{origin.x() + 3.5, origin.y() + 3.5, origin.z() + 3.5};
        if (box_distance(c - middle, {3.5, 3.5, 3.5}) >= r)
            return false;
        const auto* leaf = accessor_.probeConstLeaf(origin);
        if (!leaf)
            return accessor_.getValue(origin) < 0;
        for (openvdb::Index v = 0; v < 512; ++v) {
            const openvdb::Coord p = leaf->offsetToGlobalCoord(v);
            // The surface lies a part of a voxel beyond a solid voxel: its own distance.
            if (const float d = leaf->getValue(v);
                d < 0 && length(Vec3{double(p.x()), double(p.y()), double(p.z())} - c) +
                                 d / lattice_.voxel_m <
                             r)
                return true;
        }
        return false;
    }

    Lattice lattice_;
    mutable openvdb::FloatGrid::ConstAccessor accessor_; // a cache: one thread
    Box box_;
};

[[noreturn]] void refuse(const std::string& what) {
    throw Error(Fault::bad_argument, "holes: " + what);
}

void check_placement(const Placement& p) {
    const int given = p.count.has_value() + p.porosity.has_value() + p.density_m3.has_value();
    if (given != 1)
        refuse(std::to_string(given) +
               " of count, porosity and density are given; give exactly one");
    if (!(p.scale_m > 0) || !std::isfinite(p.scale_m))
        refuse("scale is " + std::to_string(p.scale_m) +
               " m, must be finite and > 0; give a length");
    if (p.count && (*p.count < 1 || *p.count > kMaxHoles))
        refuse("count is " + std::to_string(*p.count) + ", must be 1..1e8; ask for fewer");
    if (p.porosity && !(*p.porosity >= 0 && *p.porosity <= 0.95))
        refuse("porosity is " + std::to_string(*p.porosity) + ", must be 0..0.95; ask for less");
    if (p.density_m3 && !(*p.density_m3 > 0 && std::isfinite(*p.density_m3)))
        refuse("density is " + std::to_string(*p.density_m3) + " per m^3, must be finite and > 0");
}

/// The box that centres of a stationary process are drawn in: all but kTail of the holes that meet
/// the region have theirs there.
Box stationary_box(const Law& law, const Placement& placement, const Region& region) {
    return region.box().dilated(0.5 * placement.scale_m * law.quantile(1 - kTail));
}

PlacedHoles place_count(const Law& law, const Placement& placement, const Region& region,
                        Progress* progress) {
    const HoleStream stream(law, region.box(), placement.scale_m, placement.seed);
    PlacedHoles placed;
    for (std::uint64_t i = 0; placed.holes.size() < *placement.count; ++i) {
        if (i % 65536 == 0)
            check_cancelled(progress);
        if (i > 1000 && placed.holes.size() < i / 100'000)
            throw Error(Fault::numeric, "holes: the solid fills less than 1e-5 of its box; use a "
                                        "smaller voxel, or give the holes as a table");
        if (const Sphere hole = stream.hole(i); region.inside(hole.center))
            placed.holes.push_back(hole);
    }
    return placed;
}

PlacedHoles place_density(const Law& law, const Placement& placement, const Region& region,
                          Progress* progress) {
    const Box box = stationary_box(law, placement, region);
    const double mean = *placement.density_m3 * box.volume();
    if (mean > static_cast<double>(kMaxHoles))
        refuse("the density asks for " + std::to_string(mean) +
               " holes, at most 1e8 are placed; use a larger scale or a smaller solid");
    const HoleStream stream(law, box, placement.scale_m, placement.seed);
    const std::uint64_t n = poisson_count(mean, {placement.seed, kCountStream});
    PlacedHoles placed;
    for (std::uint64_t i = 0; i < n; ++i) {
        if (i % 65536 == 0)
            check_cancelled(progress);
        const Sphere hole = stream.hole(i);
        if (region.meets(hole))
            placed.holes.push_back(hole);
        else
            ++placed.n_missed;
    }
    return placed;
}

/// Points of a lattice that lie inside the region, taken away as holes come.
class PorositySamples {
public:
    explicit PorositySamples(const Region& region) : box_(region.box()) {
        const Vec3 size = box_.size();
        step_ = std::cbrt(size.x * size.y * size.z / kMaxSamples);
        for (int axis = 0; axis < 3; ++axis)
            n_[axis] = static_cast<int>(size[axis] / step_) + 1;
        there_.resize(static_cast<std::size_t>(n_[0]) * static_cast<std::size_t>(n_[1]) *
                      static_cast<std::size_t>(n_[2]));
        for (int x = 0; x < n_[0]; ++x)
            for (int y = 0; y < n_[1]; ++y)
                for (int z = 0; z < n_[2]; ++z)
                    if (region.inside(box_.lo + Vec3{double(x), double(y), double(z)} * step_)) {
                        there_[index(x, y, z)] = 1;
                        ++n_all_;
                    }
        n_left_ = n_all_;
        if (n_all_ < 1000)
            throw Error(Fault::numeric, "holes: the solid is too small for its voxel to count "
                                        "porosity; use a smaller voxel");
    }

    void remove(const Sphere& hole) {
        int lo[3], hi[3];
        const Vec3 c = (hole.center - box_.lo) / step_;
        const double r = hole.radius_m / step_;
        for (int axis = 0; axis < 3; ++axis) {
            lo[axis] = static_cast<int>(std::ceil(std::clamp(c[axis] - r, 0.0, double(n_[axis]))));
            hi[axis] = static_cast<int>(std::floor(std::clamp(c[axis] + r, -1.0, n_[axis] - 1.0)));
        }
        for (int x = lo[0]; x <= hi[0]; ++x)
            for (int y = lo[1]; y <= hi[1]; ++y) {
                const double rest = r * r - (x - c.x) * (x - c.x) - (y - c.y) * (y - c.y);
                for (int z = lo[2]; rest > 0 && z <= hi[2]; ++z)
                    if (char& there = there_[index(x, y, z)];
                        there && (z - c.z) * (z - c.z) < rest) {
                        there = 0;
                        --n_left_;
                    }
            }
    }
    double porosity() const {
        return 1 - static_cast<double>(n_left_) / static_cast<double>(n_all_);
    }

private:
    std::size_t index(int x, int y, int z) const {
        return (static_cast<std::size_t>(x) * static_cast<std::size_t>(n_[1]) +
                static_cast<std::size_t>(y)) *
                   static_cast<std::size_t>(n_[2]) +
               static_cast<std::size_t>(z);
    }
    Box box_;
    double step_ = 0;
    int n_[3] = {};
    std::vector<char> there_;
    std::size_t n_all_ = 0, n_left_ = 0;
};

/// The prefix of one stream whose porosity is nearest to the target; `next` is that of one hole
/// more or fewer, on the other side of it.
PlacedHoles place_prefix(const HoleStream& stream, double target, const Region& region,
                         PorositySamples samples, double& next, Progress* progress) {
    PlacedHoles placed;
    double before = 0, now = 0;
    for (std::uint64_t i = 0; now < target; ++i) {
        if (i % 4096 == 0)
            check_cancelled(progress);
        if (i >= kMaxHoles)
            throw Error(Fault::numeric, "holes: 1e8 of them reach a porosity of " +
                                            std::to_string(now) + " only; use a larger scale");
        const Sphere hole = stream.hole(i);
        if (!region.meets(hole)) {
            ++placed.n_missed;
            continue;
        }
        before = now;
        samples.remove(hole);
        now = samples.porosity();
        placed.holes.push_back(hole);
    }
    next = before;
    if (!placed.holes.empty() && target - before < now - target) {
        placed.holes.pop_back();
        std::swap(next, now);
    }
    placed.porosity = now;
    return placed;
}

PlacedHoles place_porosity(const Law& law, const Placement& placement, const Region& region,
                           Progress* progress) {
    const double target = *placement.porosity;
    const PorositySamples samples(region);
    const Box box = stationary_box(law, placement, region);
    // One large hole may step over the target: then another stream of the same seed is tried.
    PlacedHoles placed;
    double next = 0;
    for (std::uint64_t stream = 0; stream < kMaxStreams; ++stream) {
        const auto w = Rng{placement.seed, kAnotherStream}.words(stream);
        const std::uint64_t seed = stream == 0 ? placement.seed : std::uint64_t{w[0]} << 32 | w[1];
        placed = place_prefix(HoleStream(law, box, placement.scale_m, seed), target, region,
                              samples, next, progress);
        if (std::fabs(*placed.porosity - target) <= kTolerance)
            return placed;
    }
    throw Error(Fault::numeric, "holes: porosity " + std::to_string(target) + " lies between " +
                                    std::to_string(std::min(*placed.porosity, next)) + " and " +
                                    std::to_string(std::max(*placed.porosity, next)) +
                                    ", one hole apart; use a smaller scale");
}

PlacedHoles place(const Law& law, const Placement& placement, const Region& region,
                  Progress* progress) {
    check_placement(placement);
    report_stage(progress, "placing holes");
    if (placement.count)
        return place_count(law, placement, region, progress);
    if (placement.density_m3)
        return place_density(law, placement, region, progress);
    return place_porosity(law, placement, region, progress);
}

} // namespace

PlacedHoles place_holes(const Law& law, const Placement& placement, const openvdb::FloatGrid& solid,
                        Progress* progress) {
    return place(law, placement, SolidRegion(solid), progress);
}

PlacedHoles place_holes(const Law& law, const Placement& placement, const Box& box,
                        Progress* progress) {
    if (box.empty() || !(box.volume() > 0) || !is_finite(box.lo) || !is_finite(box.hi))
        throw Error(Fault::bad_argument, "holes: the box has no volume; give three lengths > 0");
    return place(law, placement, BoxRegion(box), progress);
}

std::size_t count_missing(std::span<const Sphere> holes, const openvdb::FloatGrid& solid) {
    const SolidRegion region(solid);
    return static_cast<std::size_t>(std::count_if(
        holes.begin(), holes.end(), [&](const Sphere& hole) { return !region.meets(hole); }));
}

} // namespace taihu
