#pragma once
#include <cstdint>
#include <vector>

#include "stats/core/image.h"

namespace taihu {

/// What fills the subregions of a plane.
enum class RegionLaw {
    convex,     ///< the highest of half spheres on the centres
    concave,    ///< the lowest of half spheres that hang there: the negative of convex
    sinusoid,   ///< a polar wave about each centre: sin(2 pi r / wavelength + arms theta + phase)
    damped_wave ///< the same times 1 - (r / r2)^2, r2 the distance of the next centre: 0 at borders
};

/// A square lattice of points and the centres on it.
struct RegionPlane {
    int size_px = 513;     ///< points along each side, 2..8193
    double pixel_m = 1e-3; ///< between points, > 0
    int n_regions = 60;    ///< 1..100000
    bool tileable = false; ///< the plane is a torus of side size_px * pixel_m
    std::uint64_t seed = 0;

    /// Side of the square in which centres lie: to the last point, or to the first of the next
    /// tile.
    double side_m() const { return (tileable ? size_px : size_px - 1) * pixel_m; }
};

/// \throws Error bad_argument: a setting out of range.
void check_plane(const RegionPlane& plane);

struct RegionCenter {
    double x_m = 0, y_m = 0; ///< x to the right, y downwards, from the first point
};

struct RegionSettings {
    RegionLaw law = RegionLaw::convex;
    double radius_m = 0;     ///< of half spheres; 0: the least that leaves no point uncovered
    double height_m = 0;     ///< of a half sphere, 0: its radius; of a wave's crest
    double wavelength_m = 0; ///< of waves, > 0
    double phase_turns = 0;  ///< of waves
    int arms = 0;            ///< of waves: 0 rings, else that many spiral arms, -64..64
};

struct RegionRelief {
    Image heights;       ///< 1 channel [m]
    Image ids;           ///< 1 channel: index of the nearest centre, exact in a float
    double radius_m = 0; ///< of the half spheres; 0 for waves
};

/// Poisson's arrangement: x and y of each centre uniform and independent. More centres leave the
/// first where they were.
std::vector<RegionCenter> region_centers(const RegionPlane& plane);

/// The number of the nearest centre of each point, the lower of two as near: 1 channel. Its borders
/// are the perpendicular bisectors of neighbours, the Voronoi diagram of the centres.
/// \throws Error bad_argument: a setting out of range.
Image region_ids(const RegionPlane& plane);

/// Heights over subregions. Where half spheres are too small to meet, the plane at 0 shows.
///
/// The same bytes on every machine and any number of threads. Time about 100 ns a point.
/// \throws Error bad_argument: a setting out of range.
/// Source: Tsuruoka et al., Rugged Texture Generation by Stochastic Models, Procedure 2, Fig. 6,
/// Examples 4 (plates 4 to 7); the text does not give its "modified" wave: damped_wave is ours.
RegionRelief region_relief(const RegionPlane& plane, const RegionSettings& settings = {});

} // namespace taihu
