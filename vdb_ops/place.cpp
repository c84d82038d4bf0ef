#include "vdb_ops/place.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/estimate.h"
#include "vdb_ops/hole_source_detail.h"

namespace taihu {
namespace {

constexpr double kTolerance = 0.005; // of the porosity, absolute
constexpr double kTail = 1e-7;       // share of diameters that the margin round a solid leaves out
constexpr double kMaxSamples = 4e6;  // points at which porosity is counted
constexpr double kHole_bytes = 100;  // at the peak: a list grows by doubling
constexpr std::uint64_t kMaxStreams = 64; // tried for one porosity
constexpr std::uint32_t kAnotherStream = 0x73747265;
constexpr int kMaxJoints = 1000;
constexpr std::uint64_t kCentersPerHole = 100'000; // fewer come through: the search is given up

[[noreturn]] void refuse(const std::string& what) {
    throw Error(Fault::bad_argument, "holes: " + what);
}

template <class Kind>
bool is(const Pattern& pattern) {
    return std::holds_alternative<Kind>(pattern);
}

/// Nothing but the law decides where holes are.
bool plain(const Placement& p) {
    return is<UniformPattern>(p.pattern) && !p.height && !p.where;
}

void check_number(const Placement& p) {
    const int given = p.count.has_value() + p.porosity.has_value() + p.density_m3.has_value();
    if (is<LatticePattern>(p.pattern)) {
        if (given > 0)
            refuse(
                "a lattice has as many as its spacing fits in; drop count, porosity and density");
        return;
    }
    if (given != 1)
        refuse(std::to_string(given) +
               " of count, porosity and density are given; give exactly one");
    if (p.count && (*p.count < 1 || *p.count > kMaxHoles))
        refuse("count is " + std::to_string(*p.count) + ", must be 1..1e8; ask for fewer");
    if (p.porosity && !(*p.porosity >= 0 && *p.porosity <= 0.95))
        refuse("porosity is " + std::to_string(*p.porosity) + ", must be 0..0.95; ask for less");
    if (p.density_m3 && !(*p.density_m3 > 0 && std::isfinite(*p.density_m3)))
        refuse("density is " + std::to_string(*p.density_m3) + " per m^3, must be finite and > 0");
}

void check_where(const openvdb::FloatGrid& grid) {
    if (!grid.transform().isLinear())
        refuse("the volume 'where' is a frustum; resample it to cubic voxels");
    if (grid.getGridClass() == openvdb::GRID_LEVEL_SET)
        return;
    for (auto v = grid.cbeginValueAll(); v; ++v)
        if (!(*v >= 0 && *v <= 1))
            refuse("the volume 'where' is " + shortest(double{*v}) +
                   " somewhere, must be 0..1; scale it, or give a level set");
}

void check_placement(const Placement& p) {
    check_number(p);
    if (!(p.scale_m > 0) || !std::isfinite(p.scale_m))
        refuse("scale is " + std::to_string(p.scale_m) +
               " m, must be finite and > 0; give a length");
    if (const auto* joints = std::get_if<JointsPattern>(&p.pattern);
        joints && (joints->n < 1 || joints->n > kMaxJoints))
        refuse(std::to_string(joints->n) + " joints, must be 1..1000; ask for fewer");
    if (p.height) {
        const auto [bottom, top] = *p.height;
        if (!(bottom >= 0 && bottom <= 1 && top >= 0 && top <= 1 && bottom + top > 0))
            refuse("the share is " + shortest(bottom) + " at the bottom and " + shortest(top) +
                   " at the top, both must be 0..1 and one > 0");
    }
    if (p.where)
        check_where(*p.where);
}

/// The box that centres of a stationary process are drawn in: all but kTail of the holes that meet
/// the region have theirs there.
Box stationary_box(const Law& law, const Placement& placement, const HoleRegion& region) {
    return region.box().dilated(0.5 * placement.scale_m * law.quantile(1 - kTail));
}

[[noreturn]] void refuse_thin(const Placement& p) {
    throw Error(Fault::numeric,
                plain(p) ? "holes: the solid fills less than 1e-5 of its box; use a "
                           "smaller voxel, or give the holes as a table"
                         : "holes: the solid, the pattern and the shares of height and place let "
                           "fewer than 1 in 1e5 centres through; widen one of them");
}

/// Before any is placed. \throws Error bad_argument, unsupported.
void refuse_too_many(double n, const std::string& what) {
    if (n > static_cast<double>(kMaxHoles))
        refuse(what + " asks for " + shortest(std::round(n)) +
               " holes, at most 1e8 are placed; use a larger scale or a smaller solid");
    if (const double limit = memory_limit_bytes(); n * kHole_bytes > limit)
        throw Error(Fault::unsupported,
                    "refused: " + what + " asks for " + shortest(std::round(n)) +
                        " holes, which would need about " + human_bytes(n * kHole_bytes) +
                        " (limit " + human_bytes(limit) +
                        "); use a larger scale or a smaller solid");
}

PlacedHoles place_count(const Law& law, const Placement& p, const HoleRegion& region,
                        Progress* progress) {
    refuse_too_many(static_cast<double>(*p.count), "the count");
    HoleSource source(law, p, region, region.box(), p.seed);
    const Thinning thinning(p, region);
    const auto wanted = static_cast<double>(*p.count);
    source.lay_out(wanted, progress);
    while (true) {
        PlacedHoles placed;
        for (std::uint64_t i = 0; i < source.size(); ++i) {
            if (i % 65536 == 0)
                check_cancelled(progress);
            if (placed.holes.size() < i / kCentersPerHole)
                refuse_thin(p);
            const Sphere hole = source.hole(i);
            if (!region.inside(hole.center) || !thinning.keeps(i, hole.center))
                continue;
            placed.holes.push_back(hole);
            if (placed.holes.size() == *p.count)
                return placed;
        }
        source.lay_out_more(static_cast<double>(placed.holes.size()), wanted, progress);
    }
}

PlacedHoles place_density(const Law& law, const Placement& p, const HoleRegion& region,
                          Progress* progress) {
    HoleSource source(law, p, region, stationary_box(law, p, region), p.seed);
    const Thinning thinning(p, region);
    // Joints pass the solid, so they are denser in it than around it: of their holes so many are
    // taken that as many centres as the density says lie inside.
    const bool joints = is<JointsPattern>(p.pattern);
    const double mean =
        joints ? *p.density_m3 * region.volume_m3() : source.mean_count(*p.density_m3);
    refuse_too_many(mean, "the density");
    const std::uint64_t n = poisson_count(mean, {p.seed, kCountStream});
    source.lay_out(static_cast<double>(n), progress);
    PlacedHoles placed;
    std::uint64_t n_counted = 0;
    for (std::uint64_t i = 0; n_counted < n; ++i) {
        if (i % 65536 == 0)
            check_cancelled(progress);
        if (n_counted < i / kCentersPerHole)
            refuse_thin(p);
        const Sphere hole = source.hole(i);
        n_counted += !joints || region.inside(hole.center);
        if (!thinning.keeps(i, hole.center))
            continue;
        if (region.meets(hole))
            placed.holes.push_back(hole);
        else
            ++placed.n_missed;
    }
    return placed;
}

/// A lattice is filled: its number follows from its spacing.
PlacedHoles place_lattice(const Law& law, const Placement& p, const HoleRegion& region) {
    const HoleStream diameters(law, region.box(), p.scale_m, p.seed);
    const Thinning thinning(p, region);
    PlacedHoles placed;
    const auto nodes =
        lattice_centers(region.tight(), std::get<LatticePattern>(p.pattern).spacing_m);
    for (std::size_t i = 0; i < nodes.size(); ++i)
        if (region.inside(nodes[i]) && thinning.keeps(i, nodes[i]))
            placed.holes.push_back({nodes[i], diameters.radius_m(i)});
    return placed;
}

/// Points of a lattice that lie inside the region, taken away as holes come.
class PorositySamples {
public:
    explicit PorositySamples(const HoleRegion& region) : box_(region.box()) {
        const Vec3 size = box_.size();
        step_ = std::max(std::cbrt(size.x * size.y * size.z / kMaxSamples), 1e-7 * box_.longest());
        const auto n = [&](double side) { return std::floor(side / step_) + 1; };
        while (!(n(size.x) * n(size.y) * n(size.z) <= 8 * kMaxSamples)) // a flat or a thin one
            step_ *= 1.25;
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

/// Notices when holes go where there are holes already, or nowhere: patterns and shares may leave
/// no more to take, and the search would go on to 1e8 of them.
class Stall {
public:
    explicit Stall(const Placement& p) : p_(p) {}
    void check(std::uint64_t n_tried, std::size_t n, double porosity) {
        if (plain(p_))
            return;
        if (n < n_tried / kCentersPerHole)
            refuse_thin(p_);
        if (n < next_)
            return;
        // Once the gain falls, each doubling of their number takes away less than the one before.
        const double gain = porosity - before_;
        const double n_doublings = (*p_.porosity - porosity) / gain;
        const double n_needed = static_cast<double>(n_tried) * std::exp2(n_doublings);
        if (gain / porosity < 0.2 && n_needed > kMaxHoles)
            throw Error(Fault::numeric, "holes: " + std::to_string(n) +
                                            " of them reach a porosity of " +
                                            std::to_string(porosity) +
                                            " only, and more take hardly more away; widen the "
                                            "pattern or the shares, or ask for less");
        before_ = porosity;
        next_ *= 2;
    }

private:
    const Placement& p_;
    std::size_t next_ = 4096;
    double before_ = 0;
};

/// The first holes of a stream whose porosity is nearest to a target.
struct Prefix {
    PlacedHoles placed;
    double porosity = 0;
    double other = 0;    ///< of one hole more or fewer, on the other side of the target
    bool enough = false; ///< a hard core may have been laid out with too few
};

Prefix place_prefix(const HoleSource& source, const Placement& p, const HoleRegion& region,
                    const Thinning& thinning, PorositySamples samples, Progress* progress) {
    const double target = *p.porosity;
    Prefix prefix;
    auto& [placed, now, before, enough] = prefix;
    Stall stall(p);
    for (std::uint64_t i = 0; now < target; ++i) {
        if (i == source.size())
            return prefix;
        if (i % 4096 == 0)
            check_cancelled(progress);
        if (i >= kMaxHoles)
            throw Error(Fault::numeric, "holes: 1e8 of them reach a porosity of " +
                                            std::to_string(now) + " only; use a larger scale");
        stall.check(i, placed.holes.size(), now);
        const Sphere hole = source.hole(i);
        if (!thinning.keeps(i, hole.center))
            continue;
        if (!region.meets(hole)) {
            ++placed.n_missed;
            continue;
        }
        before = now;
        samples.remove(hole);
        now = samples.porosity();
        placed.holes.push_back(hole);
    }
    enough = true;
    if (!placed.holes.empty() && target - before < now - target) {
        placed.holes.pop_back();
        std::swap(before, now);
    }
    placed.porosity = now;
    return prefix;
}

/// Balls that take away this share of a box when none of them overlap.
double balls_for(double porosity, const Box& box, const Law& law, double scale_m) {
    const double mean_m3 = std::numbers::pi / 6 * scale_m * scale_m * scale_m * law.moment(3);
    return std::ceil(1.05 * porosity * box.volume() / mean_m3) + 16;
}

PlacedHoles place_porosity(const Law& law, const Placement& p, const HoleRegion& region,
                           Progress* progress) {
    const double target = *p.porosity;
    const Box box = stationary_box(law, p, region);
    const double least = balls_for(target, box, law, p.scale_m); // more, as they overlap
    refuse_too_many(least, "the porosity");
    const PorositySamples samples(region);
    const Thinning thinning(p, region);
    // One large hole may step over the target: then another stream of the same seed is tried.
    Prefix prefix;
    for (std::uint64_t stream = 0; stream < kMaxStreams; ++stream) {
        const auto w = Rng{p.seed, kAnotherStream}.words(stream);
        const std::uint64_t seed = stream == 0 ? p.seed : std::uint64_t{w[0]} << 32 | w[1];
        HoleSource source(law, p, region, box, seed);
        source.lay_out(least, progress);
        while (!(prefix = place_prefix(source, p, region, thinning, samples, progress)).enough)
            source.lay_out_more(prefix.porosity, target, progress);
        if (std::fabs(prefix.porosity - target) <= kTolerance)
            return prefix.placed;
    }
    const auto [lo, hi] = std::minmax(prefix.porosity, prefix.other);
    throw Error(Fault::numeric, "holes: porosity " + std::to_string(target) + " lies between " +
                                    std::to_string(lo) + " and " + std::to_string(hi) +
                                    ", one hole apart; use a smaller scale");
}

PlacedHoles place(const Law& law, const Placement& p, const HoleRegion& region,
                  Progress* progress) {
    report_stage(progress, "placing holes");
    if (is<LatticePattern>(p.pattern))
        return place_lattice(law, p, region);
    if (p.count)
        return place_count(law, p, region, progress);
    if (p.density_m3)
        return place_density(law, p, region, progress);
    return place_porosity(law, p, region, progress);
}

} // namespace

std::string_view pattern_name(const Pattern& pattern) {
    static constexpr std::array<std::string_view, 5> kNames = {"uniform", "thomas", "joints",
                                                               "hard-core", "lattice"};
    const auto* clusters = std::get_if<ClusterSettings>(&pattern);
    return clusters && clusters->shape == ClusterSettings::Shape::matern ? "matern"
                                                                         : kNames[pattern.index()];
}

PlacedHoles place_holes(const Law& law, const Placement& placement, const openvdb::FloatGrid& solid,
                        Progress* progress) {
    check_placement(placement);
    return place(law, placement, *hole_region(solid), progress);
}

PlacedHoles place_holes(const Law& law, const Placement& placement, const Box& box,
                        Progress* progress) {
    check_placement(placement);
    return place(law, placement, *hole_region(box), progress);
}

std::size_t count_missing(std::span<const Sphere> holes, const openvdb::FloatGrid& solid) {
    const auto region = hole_region(solid);
    return static_cast<std::size_t>(std::count_if(
        holes.begin(), holes.end(), [&](const Sphere& hole) { return !region->meets(hole); }));
}

} // namespace taihu
