#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <openvdb/openvdb.h>

#include "stats/core/box.h"
#include "stats/core/progress.h"
#include "stats/core/sphere.h"
#include "stats/law.h"

namespace taihu {

/// How many holes, and how long a unit of the law is. Exactly one of the three numbers is given.
struct Placement {
    double scale_m = 1;                 ///< length of one law unit [m], > 0
    std::optional<std::uint64_t> count; ///< this many centres inside, 1..1e8
    std::optional<double> porosity;     ///< removed volume / volume, 0..0.95, reached within 0.005
    std::optional<double> density_m3;   ///< centres per m^3 (a Poisson process), > 0
    std::uint64_t seed = 0;
};

struct PlacedHoles {
    std::vector<Sphere> holes;
    std::uint64_t n_missed = 0;     ///< of the stream, dropped because they do not touch the solid
    std::optional<double> porosity; ///< reached, when it was asked for, on a lattice of samples
};

/// Holes of a law in a solid. `count`: uniform centres inside the solid. `density`, `porosity`:
/// centres of a stationary process, so they may lie outside by a radius; holes that miss the solid
/// are dropped; `porosity` takes the first holes of a stream, as many as come nearest to the
/// target; where one large hole steps over it, other streams of the same seed are tried in turn.
/// The same on any number of threads; a longer list (more `count`) begins with the shorter one.
/// \throws Error bad_argument: not exactly one number, or one out of range; numeric: the porosity
/// cannot be
///   met (the message says what can), or the solid is too thin for uniform centres to meet it.
PlacedHoles place_holes(const Law& law, const Placement& placement, const openvdb::FloatGrid& solid,
                        Progress* progress = nullptr);

/// The same in a box.
PlacedHoles place_holes(const Law& law, const Placement& placement, const Box& box,
                        Progress* progress = nullptr);

/// How many of `holes` do not touch `solid`.
std::size_t count_missing(std::span<const Sphere> holes, const openvdb::FloatGrid& solid);

} // namespace taihu
