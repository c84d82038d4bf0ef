#pragma once
#include <optional>

#include <openvdb/openvdb.h>

#include "stats/core/progress.h"
#include "vdb_ops/noise.h"
#include "vdb_ops/similarity.h"

namespace taihu {

/// Stone that resists here more than there: erosion times max(0, 1 + contrast * noise).
struct Durability {
    double contrast = 0.5; ///< 0..2
    NoiseSettings noise;
};

/// How a surface weathers. Its distances blurred by sigma, minus themselves, are about sigma^2 / 2
/// times the sum of its principal curvatures: positive on convex places, negative in concave ones.
/// A step moves the surface inwards by shares of that.
struct WeatherSettings {
    double sigma_m = 0.01; ///< 1e-9..1e5: details smaller than that go
    int steps = 1;         ///< 1..1000
    double rounding = 1;   ///< share on convex places, 0..1: horns and edges wear off
    double hollowing = -1; ///< in concave ones, -1..1: -1 fills them, 1 deepens them (tafoni)
    std::optional<Durability> durability;
};

struct WeatherResult {
    openvdb::FloatGrid::Ptr solid; ///< on the lattice and band of the input
    double volume_before_m3 = 0, volume_after_m3 = 0;
    double area_before_m2 = 0, area_after_m2 = 0;
};

/// \throws Error bad_argument: the setting out of range.
void check_weather_settings(const WeatherSettings& settings);

/// A level set after weathering. With rounding 1 and hollowing -1, steps are mean-curvature flow by
/// the time sigma^2 / 2 each: a ball of radius r shrinks to sqrt(r^2 - 2 sigma^2 steps). Rounding
/// alone is spheroidal weathering; hollowing above 0 eats caverns, whose size sigma sets.
///
/// \param at  where the solid was put: lengths and places of settings are of before.
/// The same bits on any number of threads. Time O(steps * leaves near the surface *
/// (sigma / voxel)^2). Distances are true again after each step.
/// \throws Error bad_argument: as check_weather_settings() and lattice_of(), or a sigma above 200
///   voxels; bad_input: nothing is left; unsupported: as redistance(); cancelled.
/// Source: diffusion of distances as a flow, Esedoglu, Ruuth, Tsai 2010, from memory; durability
/// and hollowing are ours.
WeatherResult weather(const openvdb::FloatGrid& solid, const WeatherSettings& settings,
                      const Similarity& at = {}, Progress* progress = nullptr);

} // namespace taihu
