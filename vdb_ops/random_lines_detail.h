#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "stats/core/box.h"
#include "stats/core/progress.h"
#include "stats/core/rng.h"
#include "stats/core/vec3.h"

namespace taihu {

/// What is at a point, and how far from there it stays so.
enum class Phase : std::uint8_t { outside, solid, hole };
struct Spot {
    Phase phase = Phase::outside;
    double clear_m = 0;
};
using Probe = std::function<Spot(const Vec3&)>; ///< for one thread

/// What random lines met inside a region of solid and holes.
struct LineSums {
    static constexpr int kAlong = 4; ///< blocks along each side of the box: their spread tells how
                                     ///< much another part of the same stuff would differ
    static constexpr int kBins = 4096;
    static constexpr int kDistances = 32;

    /// Points of lines that have another of the region, or both of them of holes, k + 1 distances
    /// on.
    struct Pairs {
        double all_m = 0, holes_m = 0;
    };
    struct Block {
        double length_m = 0, hole_m = 0;       ///< of lines inside the region, inside its holes
        double n_crossings = 0;                ///< between solid and hole
        std::array<Pairs, kDistances> pairs{}; ///< that have an end or both in the block
    };
    /// Chords, by length, as seen from each of their ends: `whole`, or from one end to where they
    /// leave the region.
    struct Chords {
        std::vector<std::uint64_t> whole = std::vector<std::uint64_t>(kBins),
                                   cut = std::vector<std::uint64_t>(kBins);
    };
    std::vector<Block> blocks = std::vector<Block>(kAlong * kAlong * kAlong);
    std::array<Pairs, kDistances> pairs{}; ///< each once
    Chords solid, hole;
    double bin_m = 0; ///< of the chords
    /// Sums over lines of crossings^2, crossings * length and length^2.
    double nn = 0, nl = 0, ll = 0;
};

struct LineSettings {
    Box box; ///< of the region
    std::uint64_t n_lines = 0;
    double least_m = 0;    ///< chords below it may be missed
    double distance_m = 0; ///< between the distances of pairs
    Rng rng;
};

/// Lines of all directions and places, uniform among those that meet the ball round the box. The
/// same on any number of threads. \throws Error cancelled: within 100 lines.
LineSums measure_lines(const LineSettings& settings, const std::function<Probe()>& make_probe,
                       Progress* progress);

} // namespace taihu
