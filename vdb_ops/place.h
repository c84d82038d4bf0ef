#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include <openvdb/openvdb.h>

#include "stats/core/box.h"
#include "stats/core/progress.h"
#include "stats/core/sphere.h"
#include "stats/law.h"
#include "stats/point_process.h"

namespace taihu {

/// Anywhere, with no regard to each other.
struct UniformPattern {};

/// Along planes of weakness, in random directions through random points of the solid.
struct JointsPattern {
    int n = 3;               ///< planes, 1..1000
    double scatter_m = 0.02; ///< standard deviation of the distance to the plane, > 0
};

/// Anywhere, but apart: balls do not touch.
struct HardCorePattern {
    double gap_m = 0; ///< at least so much between two balls, >= 0
};

/// The nodes of a cubic lattice in the middle of the solid's box; as many as lie inside.
struct LatticePattern {
    double spacing_m = 0.1; ///< > 0
};

/// How the centres of holes lie; clusters are those of stats/point_process.h.
using Pattern =
    std::variant<UniformPattern, ClusterSettings, JointsPattern, HardCorePattern, LatticePattern>;

/// `uniform`, `thomas`, `matern`, `joints`, `hard-core`, `lattice`.
std::string_view pattern_name(const Pattern& pattern);

/// The share of holes that is there, by height: straight from the bottom of the solid to its top.
struct HeightShare {
    double bottom = 1, top = 1; ///< 0..1, not both 0
};

/// How many holes, how they lie, and how long a unit of the law is. Exactly one of the three
/// numbers is given; of a lattice none.
struct Placement {
    double scale_m = 1;                 ///< length of one law unit [m], > 0
    std::optional<std::uint64_t> count; ///< this many centres inside, 1..1e8
    std::optional<double> porosity;     ///< removed volume / volume, 0..0.95, reached within 0.005
    std::optional<double> density_m3;   ///< centres per m^3 where the share is 1, > 0
    std::uint64_t seed = 0;
    Pattern pattern;
    std::optional<HeightShare> height;
    /// A volume that has the share of holes at each place, 0..1; of a level set, 1 inside it and 0
    /// outside. With `height` the two are multiplied.
    openvdb::FloatGrid::ConstPtr where;
};

struct PlacedHoles {
    std::vector<Sphere> holes;
    std::uint64_t n_missed = 0;     ///< of the stream, dropped because they do not touch the solid
    std::optional<double> porosity; ///< reached, when it was asked for, on a lattice of samples
};

/// Holes of a law in a solid. `count`: centres of the pattern inside the solid. `density`,
/// `porosity`: centres of a stationary process, so they may lie outside by a radius; holes that
/// miss the solid are dropped; `porosity` takes the first holes of a stream, as many as come
/// nearest to the target; where one large hole steps over it, other streams of the same seed are
/// tried in turn. Clusters have the density on average over many; joints have it inside the solid.
///
/// The same on any number of threads. A longer list (more `count`) begins with the shorter one, but
/// for a hard core: it is laid out together, largest ball first, because small ones would leave no
/// room; each number of balls has a list of its own.
/// \throws Error bad_argument: not exactly one number, one with a lattice, something out of range,
///         or `where` with a value outside of 0..1; numeric: the porosity cannot be met (the
///         message says what can), a ball finds no room, or hardly any centre falls into what the
///         solid, the pattern and the shares leave.
PlacedHoles place_holes(const Law& law, const Placement& placement, const openvdb::FloatGrid& solid,
                        Progress* progress = nullptr);

/// The same in a box.
PlacedHoles place_holes(const Law& law, const Placement& placement, const Box& box,
                        Progress* progress = nullptr);

/// How many of `holes` do not touch `solid`.
std::size_t count_missing(std::span<const Sphere> holes, const openvdb::FloatGrid& solid);

} // namespace taihu
