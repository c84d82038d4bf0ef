#include "vdb_ops/roughen.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "stats/core/error.h"
#include "stats/core/rng.h"
#include "stats/number_detail.h"
#include "vdb_ops/band_detail.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/redistance.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
constexpr std::uint32_t kWarpStream = 0x77617270;
constexpr double kDepth = 0.25; ///< under a mouth / its radius: from there on it is inside

void require(bool good, const char* what, double value, const char* range) {
    if (!good)
        throw Error(Fault::bad_argument,
                    std::string(what) + " is " + shortest(value) + ", must be " + range);
}

void check_share(double share, const char* what) {
    require(share >= 0 && share <= 10, what, share, "0..10");
}

/// How far under the closed outside a point lies: positive in holes whose mouth is too narrow for a
/// ball.
FloatGrid::Ptr closed_outside(const FloatGrid& solid, double mouth_m, Progress* progress) {
    const float own = lattice_of(solid).half_width_vox;
    const auto grown_to = [&](const FloatGrid& from, double by_m) {
        auto moved = wide_band(from, std::fabs(by_m), "roughen", progress);
        set_values(*moved, progress,
                   [by_m] { return [by_m](const Coord&, double d) { return d - by_m; }; });
        return settled(moved, own, progress);
    };
    const auto closed = grown_to(*grown_to(solid, mouth_m), -mouth_m);
    return wide_band(*closed, kDepth * mouth_m, "roughen", progress);
}

/// Waves shorter than two voxels would be sampled as something else.
double least_m(const Lattice& lattice, const Similarity& at) {
    return 2 * lattice.voxel_m / at.scale();
}

/// The displacement at points of a surface, before `at`; outwards is positive.
class Displacement {
public:
    Displacement(const RoughenSettings& s, double least_m) : s_(s) {
        if (s.relief == Relief::tile)
            tile_ = std::make_unique<ReliefAround>(
                without_short_waves(s.tile.tile->heights, s.tile.tile->pixel_m,
                                    s.tile.tile->tileable, least_m),
                s.tile.tile->pixel_m, s.tile.tile->tileable, ReliefMap::triplanar, s.tile.frame,
                s.tile.sharpness);
        else if (s.relief == Relief::facets)
            cells_ = std::make_unique<CellNoise>(s.noise);
        else if (s.relief == Relief::beds)
            beds_ = std::make_unique<BedNoise>(s.noise);
        else
            fractal_ = std::make_unique<FractalNoise>(s.noise, least_m);
    }

    /// \param inside  0 outside of holes .. 1 deep in them.
    double at(const Vec3& p, const Vec3& normal, double inside) const {
        double v = profile(p, normal);
        if (s_.removes)
            v = std::min(v, 0.0);
        const double y = normal.y;
        const FacingShares& f = s_.facing;
        double share = y > 0 ? f.side + (f.up - f.side) * y : f.side + (f.side - f.down) * y;
        if (s_.inside)
            share *= 1 + (s_.inside->share - 1) * inside;
        if (s_.height) {
            const HeightShares& h = *s_.height;
            const double t = std::clamp((p.y - h.bottom_m) / (h.top_m - h.bottom_m), 0.0, 1.0);
            share *= h.bottom + (h.top - h.bottom) * t;
        }
        return s_.amplitude_m * share * v;
    }

private:
    double profile(const Vec3& p, const Vec3& normal) const {
        switch (s_.relief) {
        case Relief::furrows:
            return -std::pow(fractal_->ridged(p), s_.sharpness);
        case Relief::facets: {
            constexpr double kCrack = 0.08; // half its width / the size of a cell
            const CellNoise::Cell cell = cells_->at(p);
            return cell.facet - s_.crack * std::max(0.0, 1 - (cell.second - cell.nearest) / kCrack);
        }
        case Relief::beds:
            return beds_->at(p);
        case Relief::tile:
            return tile_->height_m(p, normal);
        case Relief::fractal:
            break;
        }
        if (!s_.hurst_down)
            return fractal_->at(p);
        const double up = std::clamp(0.5 + 0.5 * normal.y, 0.0, 1.0);
        return fractal_->at(p, *s_.hurst_down + (s_.noise.hurst - *s_.hurst_down) * up);
    }

    const RoughenSettings& s_;
    std::unique_ptr<FractalNoise> fractal_;
    std::unique_ptr<CellNoise> cells_;
    std::unique_ptr<BedNoise> beds_;
    std::unique_ptr<ReliefAround> tile_;
};

} // namespace

void check_roughen_settings(const RoughenSettings& s) {
    if (s.relief != Relief::tile)
        check_noise(s.noise, "roughen");
    else if (!s.tile.tile ||
             std::any_of(s.tile.tile->heights.pixels.begin(), s.tile.tile->heights.pixels.end(),
                         [](float h) { return !(std::fabs(h) <= 1); }))
        throw Error(Fault::bad_argument, "roughen: a tile needs heights within -1..1; divide them "
                                         "by the greatest, and make that the amplitude");
    require(s.amplitude_m >= 0 && s.amplitude_m <= 1e5, "roughen: amplitude_m", s.amplitude_m,
            "0..1e5");
    if (s.hurst_down)
        require(*s.hurst_down >= 0.05 && *s.hurst_down <= 2, "roughen: hurst_down", *s.hurst_down,
                "0.05..2");
    require(s.sharpness >= 0.25 && s.sharpness <= 16, "roughen: sharpness", s.sharpness,
            "0.25..16");
    require(s.crack >= 0 && s.crack <= 2, "roughen: crack", s.crack, "0..2");
    check_share(s.facing.up, "roughen: facing.up");
    check_share(s.facing.side, "roughen: facing.side");
    check_share(s.facing.down, "roughen: facing.down");
    if (s.inside) {
        require(s.inside->mouth_m > 0 && s.inside->mouth_m <= 1e5, "roughen: inside.mouth_m",
                s.inside->mouth_m, "> 0 and at most 1e5");
        check_share(s.inside->share, "roughen: inside.share");
    }
    if (s.height) {
        check_share(s.height->bottom, "roughen: height.bottom");
        check_share(s.height->top, "roughen: height.top");
        require(s.height->top_m > s.height->bottom_m, "roughen: height.top_m", s.height->top_m,
                "above bottom_m");
    }
}

namespace {

double greatest_share(const RoughenSettings& s) {
    double share = std::max({s.facing.up, s.facing.side, s.facing.down});
    if (s.inside)
        share *= std::max(1.0, s.inside->share);
    if (s.height)
        share *= std::max(s.height->bottom, s.height->top);
    return share;
}

} // namespace

double reach_m(const RoughenSettings& s) {
    const double most = s.relief == Relief::fractal   ? FractalNoise::kMost
                        : s.relief == Relief::furrows ? 1
                        : s.relief == Relief::tile    ? 1
                        : s.relief == Relief::facets  ? 2 + s.crack
                                                      : 0.85;
    return most * greatest_share(s) * s.amplitude_m;
}

double usual_growth_m(const RoughenSettings& s) {
    if (s.removes || s.relief == Relief::furrows)
        return 0;
    const double usual = s.relief == Relief::fractal ? 2 : s.relief == Relief::tile ? 1 : 0.5;
    return usual * greatest_share(s) * s.amplitude_m;
}

FloatGrid::Ptr roughen(const FloatGrid& solid, const RoughenSettings& s, const Similarity& at,
                       Progress* progress) {
    check_roughen_settings(s);
    const Lattice lattice = lattice_of(solid);
    const double reach = reach_m(s) * at.scale();
    const auto wide = wide_band(solid, reach, "roughen", progress);
    const FloatGrid::Ptr outside =
        s.inside ? closed_outside(solid, s.inside->mouth_m * at.scale(), progress) : nullptr;
    const Displacement displacement(s, least_m(lattice, at));
    const Similarity back = at.inverse();
    auto moved = wide->deepCopy();
    set_values(*moved, progress, [&] {
        return [&, near = BandReader(wide),
                holes = BandReader(outside ? outside : wide)](const Coord& c, double d) {
            if (std::fabs(d) > reach + 1.8 * lattice.voxel_m) // a cell's diagonal: never reached
                return d;
            const Vec3 normal = near.normal(c), foot = near.place(c) - normal * d;
            const double inside =
                outside ? std::clamp(-holes.at(foot) / (kDepth * s.inside->mouth_m * at.scale()),
                                     0.0, 1.0)
                        : 0;
            return d -
                   at.scale() * displacement.at(back.point(foot), back.direction(normal), inside);
        };
    });
    return settled(moved, lattice.half_width_vox, progress);
}

void check_warp_settings(const WarpSettings& s) {
    check_noise(s.noise, "warp");
    require(s.amplitude_m >= 0 && s.amplitude_m <= 1e5, "warp: amplitude_m", s.amplitude_m,
            "0..1e5");
}

double reach_m(const WarpSettings& s) {
    return FractalNoise::kMost * std::sqrt(3.0) * s.amplitude_m;
}

double usual_growth_m(const WarpSettings& s) {
    return 1.5 * s.amplitude_m; // few waves cross a solid
}

FloatGrid::Ptr warp(const FloatGrid& solid, const WarpSettings& s, const Similarity& at,
                    Progress* progress) {
    check_warp_settings(s);
    const Lattice lattice = lattice_of(solid);
    std::vector<FractalNoise> noise;
    for (std::uint64_t axis = 0; axis < 3; ++axis) {
        NoiseSettings one = s.noise;
        const auto w = Rng{s.noise.seed, kWarpStream}.words(axis);
        one.seed = std::uint64_t{w[0]} << 32 | w[1];
        noise.emplace_back(one, least_m(lattice, at));
    }
    const auto wide = wide_band(solid, reach_m(s) * at.scale(), "warp", progress);
    const Similarity back = at.inverse();
    auto moved = wide->deepCopy();
    set_values(*moved, progress, [&] {
        return [&, reader = BandReader(wide)](const Coord& c, double) {
            const Vec3 p = reader.place(c), own = back.point(p);
            const Vec3 by{noise[0].at(own), noise[1].at(own), noise[2].at(own)};
            return reader.at(p + at.direction(by) * (s.amplitude_m * at.scale()));
        };
    });
    return settled(moved, lattice.half_width_vox, progress);
}

} // namespace taihu
