#include "vdb_ops/bites.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string>
#include <utility>

#include "stats/core/error.h"
#include "stats/core/rng.h"
#include "stats/number_detail.h"
#include "vdb_ops/band_detail.h"
#include "vdb_ops/rasterize.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using Leaf = openvdb::FloatTree::LeafNodeType;
constexpr std::uint32_t kPlaceStream = 0x62697465, kShapeStream = 0x62697473,
                        kClusterStream = 0x62697463;

void require(bool good, const char* what, double value, const char* range) {
    if (!good)
        throw Error(Fault::bad_argument, std::string("bites: ") + what + " is " + shortest(value) +
                                             ", must be " + range);
}

/// A point of the unit ball's surface.
Vec3 direction(const Rng& rng, std::uint64_t item, std::uint32_t draw) {
    const double z = 2 * rng.uniform(item, draw) - 1,
                 turn = 2 * std::numbers::pi * rng.uniform(item, draw + 1),
                 r = std::sqrt(1 - z * z);
    return {r * std::cos(turn), z, r * std::sin(turn)};
}

double gaussian(const Rng& rng, std::uint64_t item, std::uint32_t draw) {
    return std::sqrt(-2 * std::log(rng.uniform(item, draw))) *
           std::cos(2 * std::numbers::pi * rng.uniform(item, draw + 1));
}

/// Places where bites begin, in the world.
class Starts {
public:
    struct Start {
        Vec3 place, outwards;
    };
    Starts(const FloatGrid::ConstPtr& near, const Box& box, const BiteSettings& s,
           const Similarity& at)
        : reader_(near), box_(box), s_(s), at_(at) {
        const double height = box.size().y;
        box_.lo.y = box.lo.y + s.bottom * height;
        box_.hi.y = box.lo.y + s.top * height;
        if (s.clusters)
            for (std::uint64_t i = 0; i < s.clusters->count; ++i)
                clusters_.push_back(
                    at_.inverse().point(found([&](std::uint32_t draw) {
                                            return anywhere({s_.seed, kClusterStream}, i, draw);
                                        }).place));
    }

    Start operator()(std::uint64_t i) const {
        const Rng rng{s_.seed, kPlaceStream};
        return found([&](std::uint32_t draw) {
            if (clusters_.empty())
                return anywhere(rng, i, draw);
            const auto n = static_cast<double>(clusters_.size());
            const auto k = static_cast<std::size_t>(rng.uniform(i, draw) * n);
            return clusters_[std::min(k, clusters_.size() - 1)] +
                   direction(rng, i, draw + 1) *
                       (s_.clusters->spread_m * std::cbrt(rng.uniform(i, draw + 3)));
        });
    }

private:
    Vec3 anywhere(const Rng& rng, std::uint64_t item, std::uint32_t draw) const {
        Vec3 p;
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = box_.lo[axis] + rng.uniform(item, draw + static_cast<std::uint32_t>(axis)) *
                                          (box_.hi[axis] - box_.lo[axis]);
        return p;
    }
    /// The first of many points that lies where it should.
    template <class Point>
    Start found(Point&& point) const {
        constexpr std::uint32_t kTries = 100'000, kDraws = 8;
        const double shell_m = 0.5 * s_.least_m * at_.scale();
        for (std::uint32_t k = 0; k < kTries; ++k) {
            const Vec3 p = at_.point(point(k * kDraws));
            const double d = reader_.at(p);
            if (s_.inside ? d < 0 : std::fabs(d) < shell_m) {
                const Vec3 out = reader_.normal_at(p);
                return {s_.inside ? p : p - out * d, out};
            }
        }
        throw Error(Fault::numeric,
                    std::string("bites: none of 100000 points is ") +
                        (s_.inside ? "in the solid" : "near the surface") +
                        " where they are to begin; allow more height, or a larger least_m");
    }

    BandReader reader_;
    Box box_;
    const BiteSettings& s_;
    Similarity at_;
    std::vector<Vec3> clusters_;
};

/// Signed, exact in sign, and to first order by the surface: (k - 1) k / |gradient of k|.
double ellipsoid_m(const Bite& b, const Vec3& p) {
    const Vec3 q = p - b.center;
    const double h = dot(q, b.axis), r2 = std::max(0.0, length_squared(q) - h * h);
    const double a = h / b.along_m, k2 = a * a + r2 / (b.across_m * b.across_m);
    const double slope2 =
        a * a / (b.along_m * b.along_m) + r2 / (b.across_m * b.across_m * b.across_m * b.across_m);
    if (slope2 * b.across_m * b.along_m < 1e-12)
        return -std::min(b.across_m, b.along_m);
    const double k = std::sqrt(k2);
    return k * (k - 1) / std::sqrt(slope2);
}

/// The greater of two, rounded where they differ by less than k. Source: the cubic of Quilez,
/// Smooth minimum, from memory.
double smooth_max(double a, double b, double k) {
    const double h = k > 0 ? std::max(0.0, 1 - std::fabs(a - b) / k) : 0;
    return std::max(a, b) + h * h * h * k / 6;
}

double size_m(const Bite& b) {
    return std::max(b.along_m, b.across_m);
}

/// Which bites come near which leaves: leaf by leaf, large bites first.
using Pairs = std::vector<std::pair<Coord, std::uint32_t>>;

Pairs leaves_of(const FloatGrid& wide, std::span<const Bite> bites,
                const std::vector<std::uint32_t>& order) {
    constexpr double kMostPairs = 0x1p26;
    const double voxel = wide.voxelSize().x();
    const auto accessor = wide.getConstAccessor();
    Pairs pairs;
    double n = 0;
    for (std::uint32_t rank = 0; rank < order.size(); ++rank) {
        const Bite& b = bites[order[rank]];
        const double reach = b.rim_m + 2 * voxel;
        openvdb::Vec3d lo, hi;
        for (int axis = 0; axis < 3; ++axis) {
            const double t = b.axis[axis] * b.axis[axis];
            const double half =
                std::sqrt(t * b.along_m * b.along_m + (1 - t) * b.across_m * b.across_m) + reach;
            lo[axis] = b.center[axis] - half;
            hi[axis] = b.center[axis] + half;
        }
        const auto box = openvdb::CoordBBox(Coord::floor(wide.worldToIndex(lo)) & ~7,
                                            Coord::ceil(wide.worldToIndex(hi)));
        n += (box.dim().x() / 8 + 1.0) * (box.dim().y() / 8 + 1.0) * (box.dim().z() / 8 + 1.0);
        if (n > kMostPairs)
            throw Error(Fault::unsupported, "bites: they touch more than 2^26 leaves of 8^3 "
                                            "voxels; use fewer or smaller ones, or a larger voxel");
        for (int x = box.min().x(); x <= box.max().x(); x += 8)
            for (int y = box.min().y(); y <= box.max().y(); y += 8)
                for (int z = box.min().z(); z <= box.max().z(); z += 8)
                    if (const Coord leaf(x, y, z);
                        accessor.probeConstLeaf(leaf) || accessor.getValue(leaf) < 0)
                        pairs.push_back({leaf, rank});
    }
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

} // namespace

void check_bite_settings(const BiteSettings& s) {
    require(s.count >= 1 && s.count <= 1'000'000, "count", static_cast<double>(s.count), "1..1e6");
    require(s.mean_m > 0 && s.mean_m <= 1e6, "mean_m", s.mean_m, "> 0 and at most 1e6");
    require(s.least_m > 0 && s.least_m <= 1e6, "least_m", s.least_m, "> 0 and at most 1e6");
    require(s.most_m > s.least_m && s.most_m <= 1e6, "most_m", s.most_m,
            "above least_m and at most 1e6");
    require(s.aspect >= 0.1 && s.aspect <= 10, "aspect", s.aspect, "0.1..10");
    require(s.aspect_spread >= 0 && s.aspect_spread <= 1, "aspect_spread", s.aspect_spread, "0..1");
    require(s.jitter >= 0 && s.jitter <= 10, "jitter", s.jitter, "0..10");
    require(length(s.along) > 1e-9 && length(s.along) < 1e9, "length of along", length(s.along),
            "1e-9..1e9");
    require(s.offset >= -2 && s.offset <= 2, "offset", s.offset, "-2..2");
    require(s.offset_spread >= 0 && s.offset_spread <= 2, "offset_spread", s.offset_spread, "0..2");
    require(s.rim >= 0 && s.rim <= 2, "rim", s.rim, "0..2");
    require(s.chain >= 1 && s.chain <= 100, "chain", s.chain, "1..100");
    require(s.bottom >= 0 && s.bottom < s.top, "bottom", s.bottom, "0 or more, below top");
    require(s.top <= 1, "top", s.top, "at most 1");
    if (s.clusters) {
        const auto n = static_cast<double>(s.clusters->count);
        require(n >= 1 && n <= 1e5, "clusters.count", n, "1..1e5");
        require(s.clusters->spread_m > 0 && s.clusters->spread_m <= 1e6, "clusters.spread_m",
                s.clusters->spread_m, "> 0 and at most 1e6");
    }
}

std::vector<Bite> place_bites(const FloatGrid& solid, const Box& box, const BiteSettings& s,
                              const Similarity& at, Progress* progress) {
    check_bite_settings(s);
    const double scale = at.scale();
    const auto near = wide_band(solid, 0.5 * s.least_m * scale, "bites", progress);
    const Starts starts(near, box, s, at);
    const Rng rng{s.seed, kShapeStream};
    // An exponential law between its ends: by inversion.
    const double none = std::exp(-s.least_m / s.mean_m), all = std::exp(-s.most_m / s.mean_m);
    std::vector<Bite> bites;
    for (std::uint64_t i = 0; i < s.count; ++i) {
        check_cancelled(progress);
        std::uint32_t draw = 0;
        const double diameter_m =
            std::clamp(-s.mean_m * std::log(none - rng.uniform(i, draw++) * (none - all)),
                       s.least_m, s.most_m);
        double radius = 0.5 * diameter_m * scale;
        const Starts::Start start = starts(i);
        const double off =
            s.inside ? 0 : s.offset + s.offset_spread * (2 * rng.uniform(i, draw) - 1);
        ++draw;
        Vec3 center = start.place + start.outwards * (off * radius);
        Vec3 axis =
            normalized(at.direction(normalized(s.along) + direction(rng, i, draw) * s.jitter));
        draw += 2;
        const int n = s.chain == 1 ? 1
                                   : std::max(1, static_cast<int>(std::lround(
                                                     s.chain * (0.5 + rng.uniform(i, draw)))));
        ++draw;
        for (int link = 0; link < n; ++link, draw += 8) {
            const double aspect = s.aspect * std::exp(s.aspect_spread * gaussian(rng, i, draw));
            const double across = radius * std::cbrt(1 / aspect), along = across * aspect;
            bites.push_back({center, axis, along, across, s.rim * radius});
            // The next one begins within this one, a little thinner, a little turned.
            axis = normalized(axis + direction(rng, i, draw + 2) * 0.5);
            center += axis * (along * (0.6 + 0.6 * rng.uniform(i, draw + 4)));
            radius = std::max(0.85 * radius, 0.5 * s.least_m * scale);
        }
    }
    return bites;
}

FloatGrid::Ptr bitten(const FloatGrid& solid, std::span<const Bite> bites, Progress* progress) {
    double rim_m = 0;
    for (std::size_t i = 0; i < bites.size(); ++i) {
        const Bite& b = bites[i];
        const auto good = [](double v) { return v > 0 && v <= 1e9; };
        if (!good(b.along_m) || !good(b.across_m) || !(b.rim_m >= 0 && b.rim_m <= 1e9) ||
            !is_finite(b.center) || !(std::fabs(length(b.axis) - 1) < 1e-6))
            throw Error(Fault::bad_argument, "bites[" + std::to_string(i) +
                                                 "] has a length out of range; semi-axes "
                                                 "must be > 0, the rim >= 0, the axis of length 1");
        rim_m = std::max(rim_m, b.rim_m);
    }
    std::vector<std::uint32_t> order(bites.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return size_m(bites[a]) > size_m(bites[b]);
    });
    const auto wide = wide_band(solid, rim_m, "bites", progress);
    const Pairs pairs = leaves_of(*wide, bites, order);
    std::vector<std::size_t> first;
    std::vector<Leaf*> leaves;
    auto moved = wide->deepCopy();
    for (std::size_t i = 0; i < pairs.size(); ++i)
        if (i == 0 || pairs[i].first != pairs[i - 1].first) {
            first.push_back(i);
            leaves.push_back(moved->tree().touchLeaf(pairs[i].first));
        }
    first.push_back(pairs.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 8), [&](const auto& range) {
        check_cancelled(progress);
        const BandReader reader(wide);
        for (std::size_t l = range.begin(); l < range.end(); ++l)
            for (openvdb::Index i = 0; i < 512; ++i) {
                const Vec3 p = reader.place(leaves[l]->offsetToGlobalCoord(i));
                auto d = static_cast<double>(leaves[l]->getValue(i));
                for (std::size_t k = first[l]; k < first[l + 1]; ++k) {
                    const Bite& b = bites[order[pairs[k].second]];
                    d = smooth_max(d, -ellipsoid_m(b, p), b.rim_m);
                }
                leaves[l]->setValueOnly(i, static_cast<float>(d));
            }
    });
    return settled(moved, lattice_of(solid).half_width_vox, progress);
}

} // namespace taihu
