#include "vdb_ops/relief.h"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "stats/core/error.h"
#include "stats/core/rng.h"
#include "stats/core/text.h"

namespace taihu {
namespace {

constexpr std::uint32_t kColorStream = 0x636f6c6f;   // "colo"
constexpr std::uint32_t kPaletteStream = 0x70616c65; // "pale"

[[noreturn]] void refuse(const std::string& what) {
    throw Error(Fault::bad_argument, "relief: " + what);
}

/// Stages that give at least so many points.
int levels_for(const ReliefSettings& s) {
    if (s.patches < 1)
        refuse("patches is " + std::to_string(s.patches) + ", must be 1..4096");
    const std::int64_t wanted = s.size_px - !s.tileable;
    int levels = 0;
    while (levels < 13 && std::int64_t{s.patches} << levels < wanted)
        ++levels;
    if (s.tileable && std::int64_t{s.patches} << levels != wanted)
        refuse("a tileable side of " + std::to_string(s.patches) +
               " patches has as many points times a power of two, not " +
               std::to_string(s.size_px) + "; use " +
               std::to_string(std::int64_t{s.patches} << levels));
    return levels;
}

Image upper_left(Image image, int size) {
    if (image.width == size)
        return image;
    Image out(size, size, 1);
    for (int y = 0; y < size; ++y)
        std::copy_n(image.at(0, y), size, out.at(0, y));
    return out;
}

Image midpoint_tile(const ReliefSettings& s, Progress* progress) {
    MidpointSettings m;
    m.law = s.law == ReliefLaw::casting ? MidpointLaw::between : MidpointLaw::free;
    m.draws = s.draws;
    m.hurst = s.hurst;
    m.amplitude_m = s.amplitude_m;
    m.patches = s.patches;
    m.levels = levels_for(s);
    m.tileable = s.tileable;
    m.seed = s.seed;
    m.corners_m = s.corners_m;
    return upper_left(midpoint_heights(m, progress), s.size_px);
}

RegionPlane plane_of(const ReliefSettings& s, int n_regions, std::uint64_t seed) {
    return {s.size_px, s.pixel_m, n_regions, s.tileable, seed};
}

/// The seed of the colour centres: unlike that of the others even if both seeds are the same.
std::uint64_t color_centers(const ReliefSettings& s) {
    const auto words = Rng{s.color_seed, kColorStream}.words(0);
    return std::uint64_t{words[0]} << 32 | words[1];
}

RegionSettings region_settings(const ReliefSettings& s) {
    RegionSettings r;
    r.law = s.law == ReliefLaw::convex     ? RegionLaw::convex
            : s.law == ReliefLaw::concave  ? RegionLaw::concave
            : s.law == ReliefLaw::sinusoid ? RegionLaw::sinusoid
                                           : RegionLaw::damped_wave;
    r.height_m = s.amplitude_m;
    r.radius_m = s.radius_m;
    r.wavelength_m = s.wavelength_m;
    r.phase_turns = s.phase_turns;
    r.arms = s.arms;
    return r;
}

// Linear: slate, ochre, brick, moss, sand, plum, chalk, rust.
constexpr std::array<Vec3, 8> kPalette = {{{0.12, 0.16, 0.22},
                                           {0.55, 0.33, 0.07},
                                           {0.42, 0.09, 0.05},
                                           {0.14, 0.24, 0.08},
                                           {0.62, 0.50, 0.32},
                                           {0.20, 0.07, 0.17},
                                           {0.75, 0.73, 0.66},
                                           {0.34, 0.14, 0.04}}};

ReliefSettings law_of(ReliefLaw law, double amplitude_m) {
    ReliefSettings s;
    s.law = law;
    s.amplitude_m = amplitude_m;
    return s;
}

std::vector<ReliefPreset> make_presets() {
    const Vec3 grey{0.42, 0.40, 0.37}, clay{0.58, 0.27, 0.15}, aluminium{0.78, 0.79, 0.80};
    const ReliefMaterial rock{{0.15, 1, 0.35, 12}, grey};
    const ReliefMaterial china{{0.15, 1, 0, 1}, clay};
    const ReliefMaterial metal{{0.15, 0, 1, 10}, aluminium};
    ReliefSettings broken = law_of(ReliefLaw::fractal, 0.128);
    broken.hurst = 0.75;
    ReliefSettings clayish = law_of(ReliefLaw::fractal, 0.0045);
    clayish.hurst = 0.55;
    clayish.patches = 16;
    ReliefSettings cast = law_of(ReliefLaw::casting, 0.05);
    cast.hurst = 0;
    cast.patches = 2;
    return {{"fractal",
             "Procedure 1 in plain stone",
             law_of(ReliefLaw::fractal, 0.05),
             {{0.15, 1, 0, 1}, grey}},
            {"broken-rock", "rock broken by a hammer: powder and crystals", broken, rock},
            {"unglazed-china", "unglazed china: matt, no highlight", clayish, china},
            {"casting", "aluminium casting: shiny, flats with edges like coasts", cast, metal},
            {"convex", "subregions like cobbles", law_of(ReliefLaw::convex, 0), rock},
            {"concave", "subregions like scoops", law_of(ReliefLaw::concave, 0), rock},
            {"sinusoid", "rings or spirals about the centre of each subregion",
             law_of(ReliefLaw::sinusoid, 0.002), china},
            {"modified-sinusoid", "the same, dying down towards the borders",
             law_of(ReliefLaw::damped_wave, 0.004), china}};
}

const std::vector<ReliefPreset>& all_presets() {
    static const std::vector<ReliefPreset> presets = make_presets();
    return presets;
}

} // namespace

Vec3 region_color(float id) {
    const bool known = id >= 0 && id < 1e9F; // files hold anything
    const auto words = Rng{0, kPaletteStream}.words(known ? static_cast<std::uint64_t>(id) : 0);
    return kPalette[words[0] % kPalette.size()];
}

ReliefTile make_relief(const ReliefSettings& settings, Progress* progress) {
    const RegionPlane plane = plane_of(settings, settings.n_regions, settings.seed);
    check_plane(plane);
    if (settings.n_colors < 0 || settings.n_colors > 100'000)
        refuse("n_colors is " + std::to_string(settings.n_colors) + ", must be 0..100000");
    ReliefTile tile;
    tile.pixel_m = settings.pixel_m;
    tile.tileable = settings.tileable;
    if (is_midpoint(settings.law)) {
        tile.heights = midpoint_tile(settings, progress);
    } else {
        RegionRelief made = region_relief(plane, region_settings(settings));
        tile.heights = std::move(made.heights);
        tile.ids = std::move(made.ids);
    }
    check_cancelled(progress);
    if (settings.n_colors > 0)
        tile.color_ids = region_ids(plane_of(settings, settings.n_colors, color_centers(settings)));
    return tile;
}

int scale_px(const ReliefSettings& settings) {
    return is_midpoint(settings.law) ? std::min(settings.size_px, 1 << levels_for(settings))
                                     : settings.size_px;
}

Image relief_picture(const ReliefTile& tile, const ReliefMaterial& material,
                     const DistantLight& light) {
    const Image grey =
        shaded_heights(tile.heights, tile.pixel_m, tile.tileable, material.reflection, light);
    Image out(grey.width, grey.height, 3);
    for (std::size_t i = 0; i < grey.pixels.size(); ++i) {
        const Vec3 color =
            tile.color_ids.width > 0 ? region_color(tile.color_ids.pixels[i]) : material.color;
        for (int c = 0; c < 3; ++c)
            out.pixels[3 * i + static_cast<std::size_t>(c)] =
                static_cast<float>(color[c] * grey.pixels[i]);
    }
    return out;
}

std::span<const ReliefPreset> relief_presets() {
    return all_presets();
}

const ReliefPreset& relief_preset(std::string_view name) {
    std::vector<std::string_view> names;
    for (const ReliefPreset& p : all_presets()) {
        if (p.name == name)
            return p;
        names.push_back(p.name);
    }
    std::string all;
    for (const std::string_view n : names)
        all += (all.empty() ? "" : ", ") + std::string(n);
    refuse("no kind '" + printable(name) + "'" + did_you_mean(name, names) + " (" + all + ")");
}

} // namespace taihu
