#pragma once
#include <memory>
#include <optional>

#include <openvdb/openvdb.h>

#include "stats/core/progress.h"
#include "vdb_ops/noise.h"
#include "vdb_ops/relief.h"
#include "vdb_ops/relief_around.h"
#include "vdb_ops/similarity.h"

namespace taihu {

/// What a surface is displaced by, along its normal; amplitude_m is its size.
enum class Relief {
    fractal, ///< FractalNoise, rms 1
    furrows, ///< grooves where FractalNoise::ridged() is high, 0..1 deep
    facets,  ///< CellNoise: a plane in each cell, slopes up to 1, cracks between
    beds,    ///< BedNoise: steps of layers, 0..0.5 up and down, grooves at the joints
    tile     ///< heights of a tile laid around, -1..1
};

/// Shares of the amplitude where the surface looks up (+Y), sideways and down; straight between.
struct FacingShares {
    double up = 1, side = 1, down = 1; ///< 0..10
};

/// The share inside of holes: of what lies under a mouth that a ball of this radius does not pass.
struct InsideShare {
    double mouth_m = 0.1; ///< > 0
    double share = 0;     ///< 0..10, reached a quarter of that radius down
};

/// Shares of the amplitude by height, straight from `bottom_m` to `top_m` (Y), level beyond.
struct HeightShares {
    double bottom_m = 0, top_m = 1; ///< bottom < top
    double bottom = 1, top = 1;     ///< 0..10
};

/// A height tile laid triplanar around a box.
struct TileLayer {
    std::shared_ptr<const ReliefTile> tile; ///< heights within -1..1, times the amplitude
    Box frame;                              ///< the middle of the tile is over its middle
    double sharpness = 4;                   ///< as ReliefAround
};

struct RoughenSettings {
    Relief relief = Relief::fractal;
    NoiseSettings noise;              ///< of all but a tile
    TileLayer tile;                   ///< of a tile alone
    double amplitude_m = 0.01;        ///< rms of a fractal, depth of the rest, 0..1e5
    bool removes = false;             ///< what would stand out stays as it was; furrows always do
    std::optional<double> hurst_down; ///< of a fractal, where it faces down; noise.hurst: up
    double sharpness = 2;             ///< of furrows: their profile's exponent, 0.25..16
    double crack = 0.2;               ///< of facets: depth of cracks / amplitude, 0..2
    FacingShares facing;
    std::optional<InsideShare> inside;
    std::optional<HeightShares> height;
};

/// \throws Error bad_argument: the setting out of range.
void check_roughen_settings(const RoughenSettings& settings);

/// How far a surface moves at most, and outwards usually at its outermost [m].
double reach_m(const RoughenSettings& settings);
double usual_growth_m(const RoughenSettings& settings);

/// A level set displaced along its normal by noise or a tile at the surface: rough stone. Each
/// point takes the displacement of the nearest point of the surface, and the result is where the
/// displaced distance is 0: a proper level set, which cannot cross itself, with true distances. Its
/// H is that of the noise or the tile down to two voxels. Thin walls may break, and pieces come
/// off: clean() afterwards.
///
/// \param at  where the solid was put: settings (lengths, places, directions) are of before.
/// \return on the lattice and band of `solid`.
/// The same bits on any number of threads, the same rock on any lattice that shows its details.
/// Time and memory O(leaves within the reach of the surface).
/// \throws Error bad_argument: as check_roughen_settings(), lattice_of(), or a reach of more than
/// 1000 voxels; unsupported: as redistance(); cancelled: within a few leaves.
/// Source: orientation as in Deix 2004 (rough above, smooth below); the rest is ours.
openvdb::FloatGrid::Ptr roughen(const openvdb::FloatGrid& solid, const RoughenSettings& settings,
                                const Similarity& at = {}, Progress* progress = nullptr);

struct WarpSettings {
    NoiseSettings noise;       ///< one for each axis
    double amplitude_m = 0.05; ///< rms along each axis, 0..1e5
};

/// The level set of p -> solid(p + amplitude * noise(p)): lumps, leans and bends. Throws and costs
/// as roughen().
openvdb::FloatGrid::Ptr warp(const openvdb::FloatGrid& solid, const WarpSettings& settings,
                             const Similarity& at = {}, Progress* progress = nullptr);

/// \throws Error bad_argument: the setting out of range.
void check_warp_settings(const WarpSettings& settings);
double reach_m(const WarpSettings& settings);
double usual_growth_m(const WarpSettings& settings);

} // namespace taihu
