#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "stats/core/image.h"
#include "stats/core/progress.h"
#include "stats/core/vec3.h"
#include "vdb_ops/midpoint_relief.h"
#include "vdb_ops/reflection.h"
#include "vdb_ops/region_relief.h"

namespace taihu {

/// The law of a tile's heights: one of MidpointLaw or of RegionLaw.
enum class ReliefLaw { fractal, casting, convex, concave, sinusoid, damped_wave };

inline constexpr bool is_midpoint(ReliefLaw law) {
    return law == ReliefLaw::fractal || law == ReliefLaw::casting;
}

/// A whole tile in a few numbers. What a law does not use is left at its default.
struct ReliefSettings {
    ReliefLaw law = ReliefLaw::fractal;
    /// Points along each side, 2..8193. Midpoint laws are cut from the next patches * 2^n + 1
    /// points; tileable ones must have patches * 2^n.
    int size_px = 513;
    double pixel_m = 1e-3; ///< between points, 1e-9..1e6
    /// Midpoint laws: S(0), and by how much corners may differ. Half spheres: their height, 0:
    /// their radius. Waves: height of the crest. 0..1e6
    double amplitude_m = 0.05;
    bool tileable = false;
    std::uint64_t seed = 0;

    double hurst = 0.5;                           ///< midpoint laws: h, 0..2
    MidpointDraws draws = MidpointDraws::uniform; ///< fractal alone: a casting has uniform ones
    int patches = 1;                              ///< midpoint laws: along each side
    std::vector<double> corners_m = {};           ///< midpoint laws: as MidpointSettings

    int n_regions = 60;         ///< region laws: subregions, 1..100000
    double radius_m = 0;        ///< half spheres; 0: they just cover the tile
    double wavelength_m = 0.02; ///< waves
    double phase_turns = 0;     ///< waves
    int arms = 0;               ///< waves

    /// Colour subregions, whatever the law is: centres of their own; 0: none.
    int n_colors = 0;
    std::uint64_t color_seed = 0;

    friend bool operator==(const ReliefSettings&, const ReliefSettings&) = default;
};

/// Heights on a square lattice, the first row at the top: a patch between any four of them.
struct ReliefTile {
    Image heights;   ///< 1 channel [m], + towards the viewer
    Image ids;       ///< region laws: index of the subregion of each point; else empty
    Image color_ids; ///< with n_colors: that of the colour subregion; else empty
    double pixel_m = 1e-3;
    bool tileable = false; ///< the point after the last of a row is its first
};

/// The same bytes on every machine and any number of threads.
/// \throws Error bad_argument: a setting out of range, or a size that cannot be tileable;
/// cancelled.
ReliefTile make_relief(const ReliefSettings& settings, Progress* progress = nullptr);

/// Points across one patch, or the tile where that is smaller: up to where its law holds.
int scale_px(const ReliefSettings& settings);

/// What a surface is made of, evenly: colour and shine.
struct ReliefMaterial {
    Reflection reflection;
    Vec3 color{0.5, 0.5, 0.5}; ///< linear, times the intensity
};

/// Of a colour subregion, linear: one of eight earths, by its index; what is no index counts as 0.
Vec3 region_color(float id);

/// The tile from straight above, 3 channels, linear light: Eq. 1 times the material's colour; a
/// colour subregion has its own instead.
Image relief_picture(const ReliefTile& tile, const ReliefMaterial& material,
                     const DistantLight& light = {});

struct ReliefPreset {
    std::string_view name, about;
    ReliefSettings settings;
    ReliefMaterial material;
};

/// fractal, broken-rock, unglazed-china, casting, convex, concave, sinusoid, modified-sinusoid.
std::span<const ReliefPreset> relief_presets();
/// \throws Error bad_argument: no such preset, with the nearest name.
const ReliefPreset& relief_preset(std::string_view name);

/// The settings as JSON in one line, `{"taihu_relief": 1, "law": ...}`, without what the law does
/// not use: all that it takes to make the tile again.
std::string format_relief(const ReliefSettings& settings);
/// \param where  the file's name, for messages.
/// \throws Error bad_input: no such JSON, another version, an unknown key, a value out of range.
ReliefSettings parse_relief(std::string_view text, const std::string& where);

} // namespace taihu
