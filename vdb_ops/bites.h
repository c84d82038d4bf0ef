#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <openvdb/openvdb.h>

#include "stats/core/box.h"
#include "stats/core/progress.h"
#include "vdb_ops/similarity.h"

namespace taihu {

/// An ellipsoid of revolution to take away.
struct Bite {
    Vec3 center;
    Vec3 axis{0, 1, 0};               ///< of length 1
    double along_m = 0, across_m = 0; ///< semi-axes, > 0
    double rim_m = 0;                 ///< the rim is rounded over so much, >= 0
};

/// Holes that are not balls, and hollows of which only a cap cuts: long ones through, chains of
/// them, chips, wrinkles.
struct BiteSettings {
    std::uint64_t count = 100;   ///< of chains, 1..1e6
    double mean_m = 0.08;        ///< diameters of an exponential law of this mean, > 0
    double least_m = 0.03;       ///< cut off below, > 0
    double most_m = 0.24;        ///< and above, > least
    double aspect = 1.5;         ///< length / width, 0.1..10, at the same volume
    double aspect_spread = 0.25; ///< its standard deviation / itself, 0..1
    Vec3 along{0, 1, 0};         ///< which way they are long
    double jitter = 0.5;         ///< how far from it, 0: none, 10: anyhow
    bool inside = false;         ///< centres anywhere in the solid; else by its surface:
    double offset = 0.75;        ///< out from there / radius, -2..2
    double offset_spread = 0.25; ///< up to so much more or less, 0..2
    double rim = 0.12;           ///< width of the rounded rim / radius, 0..2
    int chain = 1;               ///< each goes on as so many on average, 1..100
    double bottom = 0, top = 1;  ///< where centres begin: shares of the height of the box, 0..1
    /// Begin within `spread_m` of one of so many places.
    struct Clusters {
        std::uint64_t count = 12; ///< 1..1e5
        double spread_m = 0.05;   ///< > 0
    };
    std::optional<Clusters> clusters;
    std::uint64_t seed = 0;
};

/// \throws Error bad_argument: the setting out of range.
void check_bite_settings(const BiteSettings& settings);

/// Bites by a solid, in its place. Centres are drawn from `box` and taken to the surface, so that
/// they do not know of the lattice: a few in a hundred fall elsewhere on another voxel.
/// \param box  holds the solid, before `at`. \param at  where it was put: lengths are of before.
/// \throws Error bad_argument: as check_bite_settings(); numeric: hardly a point of the box is near
/// the surface, or in the solid, where they are to begin.
std::vector<Bite> place_bites(const openvdb::FloatGrid& solid, const Box& box,
                              const BiteSettings& settings, const Similarity& at = {},
                              Progress* progress = nullptr);

/// A level set without the bites: large ones first, each with its rim; cubic smooth maxima, so a
/// surface between two is once differentiable. Distances are true again.
/// The order of bites does not matter, but for equal sizes. The same bits on any number of threads.
/// \return on the lattice and band of `solid`.
/// \throws Error bad_argument: `bites[i]` with a length out of range; unsupported: they touch more
/// than 2^26 leaves in all, and as redistance(); cancelled.
openvdb::FloatGrid::Ptr bitten(const openvdb::FloatGrid& solid, std::span<const Bite> bites,
                               Progress* progress = nullptr);

} // namespace taihu
