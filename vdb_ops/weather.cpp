#include "vdb_ops/weather.h"

#include <algorithm>
#include <cmath>

#include <openvdb/tools/LevelSetMeasure.h>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/band_detail.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/volume.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;

void require(bool good, const char* what, double value, const char* range) {
    if (!good)
        throw Error(Fault::bad_argument, std::string("weather: ") + what + " is " +
                                             shortest(value) + ", must be " + range);
}

FloatGrid::Ptr step(const FloatGrid& solid, const WeatherSettings& s, const FractalNoise* noise,
                    const Similarity& at, Progress* progress) {
    constexpr double kTail = 4; // sigmas: what the blur sees of the band's edge is 1e-4
    const double sigma_m = s.sigma_m * at.scale();
    const auto wide = wide_band(solid, kTail * sigma_m, "weather", progress);
    auto moved = blurred(*wide, sigma_m, progress);
    const Similarity back = at.inverse();
    set_values(*moved, progress, [&] {
        return [&, reader = BandReader(wide)](const Coord& c, double blurred) {
            const double d = reader.value(c), curved = blurred - d;
            if (std::fabs(d) > 2 * sigma_m + 2 * solid.voxelSize().x())
                return d; // a step moves no farther than sigma
            double by = curved > 0 ? s.rounding * curved : -s.hollowing * curved;
            if (noise)
                by *= std::max(0.0,
                               1 + s.durability->contrast * noise->at(back.point(reader.place(c))));
            return d + std::clamp(by, -sigma_m, sigma_m);
        };
    });
    return settled(moved, lattice_of(solid).half_width_vox, progress);
}

} // namespace

void check_weather_settings(const WeatherSettings& s) {
    require(s.sigma_m >= 1e-9 && s.sigma_m <= 1e5, "sigma_m", s.sigma_m, "1e-9..1e5");
    require(s.steps >= 1 && s.steps <= 1000, "steps", s.steps, "1..1000");
    require(s.rounding >= 0 && s.rounding <= 1, "rounding", s.rounding, "0..1");
    require(s.hollowing >= -1 && s.hollowing <= 1, "hollowing", s.hollowing, "-1..1");
    if (s.durability) {
        const double contrast = s.durability->contrast;
        require(contrast >= 0 && contrast <= 2, "durability.contrast", contrast, "0..2");
        check_noise(s.durability->noise, "weather: durability");
    }
}

WeatherResult weather(const FloatGrid& solid, const WeatherSettings& s, const Similarity& at,
                      Progress* progress) {
    check_weather_settings(s);
    const Lattice lattice = lattice_of(solid);
    const double sigma_vox = s.sigma_m * at.scale() / lattice.voxel_m;
    require(sigma_vox <= 200, "sigma_m in voxels", sigma_vox, "at most 200");
    std::optional<FractalNoise> noise;
    if (s.durability)
        noise.emplace(s.durability->noise, 2 * lattice.voxel_m / at.scale());
    WeatherResult result;
    result.volume_before_m3 = volume_m3(solid);
    result.area_before_m2 = openvdb::tools::levelSetArea(solid);
    for (int i = 0; i < s.steps; ++i) {
        result.solid =
            step(i == 0 ? solid : *result.solid, s, noise ? &*noise : nullptr, at, progress);
        if (result.solid->tree().leafCount() == 0)
            throw Error(Fault::bad_input, "weather: nothing is left after step " +
                                              std::to_string(i + 1) +
                                              "; use fewer steps, or a smaller sigma_m");
        report_fraction(progress, (i + 1.0) / s.steps);
    }
    result.volume_after_m3 = volume_m3(*result.solid);
    result.area_after_m2 = openvdb::tools::levelSetArea(*result.solid);
    return result;
}

} // namespace taihu
