#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include <openvdb/openvdb.h>

#include "stats/core/progress.h"

namespace taihu {

inline constexpr int kViews = 32;
/// Balls sent in from outside, diameter / size of the solid; 0 stands for anything that finds a way
/// over the faces of voxels.
inline constexpr std::array<double, 4> kBallShares = {0, 0.02, 0.04, 0.08};
inline constexpr double kOutlineBallShare = 0.5; ///< diameter of the ball of the outline / size
inline constexpr double kSmoothingShare = 0.02;  ///< sd of the smoothing / size

/// What a garden rock was praised for, as numbers: thin, seen through, leaky, wrinkled. `size` is
/// the diameter of the ball of the same volume; +Y is up. The outline is what a ball of half that
/// size, rolled round the solid, does not reach.
struct TraditionMeasures {
    double volume_m3 = 0, size_m = 0, height_m = 0;
    // Thin
    double body_in_hull = 0; ///< volume / volume of the convex hull
    double body_in_box = 0;  ///< volume / volume of the box along the axes
    double slenderness = 0;  ///< height / root of the mean horizontal section
    double waist = 0; ///< smallest / median horizontal section, between 20 and 80 % of height
    double wall = 0;  ///< mean local thickness / size
    // Seen through, from 32 sides
    double see_through = 0;       ///< open share of what the silhouette surrounds, mean
    double views_with_window = 0; ///< share of the views; windows are 1 % of the size across
    double windows_per_view = 0;
    double widest_window_m = 0; ///< diameter of the thickest straight horizontal rod that passes
    // Leaky
    std::array<double, 4> ways{};          ///< different ones of each ball through the solid
    std::array<double, 4> open_porosity{}; ///< volume of the outline that each ball sweeps / volume
    double channel_m = 0; ///< diameter of the largest ball that rolls, inside the outline, from a
                          ///< mouth in the upper quarter of the height to one in the lower; 0: none
                          ///< of two voxels
    double sealed_voids = 0;    ///< number of voids without a way out
    double sealed_porosity = 0; ///< their volume / volume of the outline
    // Wrinkled
    double area_ratio = 0; ///< area / area of the smoothed surface
    double roughness = 0;  ///< rms distance from the smoothed surface / size
    double curvature = 0;  ///< mean |mean curvature| of the smoothed surface * size; a ball has 2
    double concave_share = 0; ///< of the smoothed surface: mean curvature * size below -0.1
};

struct Tradition {
    TraditionMeasures fine;   ///< on the lattice
    TraditionMeasures coarse; ///< on every second of its voxels: what differs is not resolved
    double voxel_m = 0;       ///< of the lattice
    int coarser = 1;          ///< it takes every so many-th voxel of the solid
};

/// They differ by no more than 5 % of the larger one.
bool agree(double fine, double coarse);

/// Measure a solid on a lattice of at most 2^25 of its voxels, and on one of half the resolution.
/// The same on any number of threads. About a second of processor time for a million samples,
/// 24 bytes a sample.
///
/// \param hull_m3  volume of its convex hull, > 0
/// \throws Error bad_argument: hull_m3, or as lattice_of(); bad_input: the solid is empty, thinner
/// than two voxels everywhere, or its box is too large; cancelled.
Tradition measure_tradition(const openvdb::FloatGrid& solid, double hull_m3,
                            Progress* progress = nullptr);

} // namespace taihu
