#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <openvdb/openvdb.h>

#include "stats/core/progress.h"

namespace taihu {

struct PoreSettings {
    std::uint64_t n_lines = 20'000; ///< random lines, 100..10^7
    std::uint64_t seed = 0;         ///< of the lines
};

/// A number measured on one sample. `se`: how far it is likely to be off as a measure of the stuff
/// that the sample was taken from, from the spread over 4^3 blocks of it; too small when holes are
/// as large as the blocks; nothing when fewer than 8 blocks say anything.
struct Estimate {
    double value = 0;
    std::optional<double> se;
};

/// Of the quantiles below: the share that is smaller.
inline constexpr std::array<double, 5> kQuantiles = {0.05, 0.25, 0.5, 0.75, 0.95};

/// Lengths of the stretches that random lines have in solid or in holes.
struct ChordLengths {
    std::optional<Estimate> mean_m;                   ///< nothing when no line crosses a surface
    std::array<std::optional<double>, 5> quantiles_m; ///< nothing where all chords so long leave
                                                      ///< the region
    double bin_m = 0;
    std::array<double, 20> shares{}; ///< of chords in 20 bins from 0; the rest is longer or unknown
    std::uint64_t n = 0;             ///< that were seen from end to end
};

/// Diameters of the greatest balls inside that contain a point, for points all over the volume.
struct BallDiameters {
    double mean_m = 0;
    std::array<double, 5> quantiles_m{};
    double greatest_m = 0;
};

struct CorrelationPoint {
    double distance_m = 0;
    std::optional<Estimate> both; ///< share of the pairs inside the region that lie in holes
};

struct PoreMeasures {
    double voxel_m = 0;        ///< of the lattice that diameters and Euler numbers are taken on
    int coarser = 1;           ///< it takes every so many-th voxel of the solid
    double margin_m = 0;       ///< the region begins so deep below the surface of the base
    Estimate porosity;         ///< of the region
    Estimate s_v_m1;           ///< surface of holes / volume of the region
    double s_v_line_se_m1 = 0; ///< standard error of s_v_m1 from the lines alone: of this solid
    ChordLengths solid_chords, hole_chords;
    std::vector<CorrelationPoint> correlation; ///< 32 distances up to half the box's shortest side
    std::optional<BallDiameters> walls;        ///< of the whole solid: its local thickness
    std::optional<BallDiameters> pores;        ///< of the holes, where they are inside the region
    std::int64_t euler_faces = 0; ///< Euler characteristic of the solid, voxels adjacent over faces
    std::int64_t euler_corners = 0; ///< and over corners too
};

/// Measure the holes of a solid inside its base: by random lines through the level set (surface,
/// chords, correlation) and on a lattice of at most 2^25 of its voxels (diameters, Euler numbers).
///
/// Lines are isotropic and uniform. Surface per volume is twice the crossings per length; mean
/// chords are lengths over numbers, without edge effect; quantiles of chords are those of Kaplan
/// and Meier, for whom a chord that leaves the region is one of at least that length. Ridges
/// between holes are rounded by the voxels: 2 % of the surface of holes ten voxels wide is lost,
/// and chords below two voxels are too few. Diameters are low by up to a voxel in rods and round
/// holes. The same on any number of threads. Time O(lines + voxels), 24 bytes a lattice voxel.
///
/// \param base  the solid before holes were cut; nothing: the solid with its voids filled where a
/// plane along the lattice, in one of its three directions, shows them enclosed.
/// \throws Error bad_argument: a setting, or as lattice_of(); bad_input: the solid or the base is
/// empty, the base has nothing deeper than a voxel, or the box is too large; cancelled.
///
/// Source: textbook stereology, Kaplan & Meier 1958, Hildebrand & Ruegsegger 1997, all from memory;
/// checked on solids whose numbers are known.
PoreMeasures measure_pores(const openvdb::FloatGrid& solid,
                           const openvdb::FloatGrid* base = nullptr,
                           const PoreSettings& settings = {}, Progress* progress = nullptr);

} // namespace taihu
