#include "stats/io/measurements.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "stats/core/error.h"
#include "stats/io/measurement_part_detail.h"
#include "stats/io/photo_pool_detail.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

using Part = MeasurementPart;
using Kind = Part::Kind;

constexpr std::uint64_t kFewestProfiles = 8;

// Segments of all files at once, because photos may be spread over files.
std::vector<std::optional<Image>>
join_segments(std::vector<Part>& parts, const MeasurementSettings& settings, Measurements& result) {
    std::vector<Annotations> files;
    for (Part& part : parts)
        if (part.annotations)
            files.push_back(std::move(*part.annotations));
    if (files.empty() && (settings.scale_bar_m || settings.label || !settings.masks.empty()))
        throw Error(Fault::bad_argument, "measurements: a scale bar, a label or a mask, but no "
                                         "file has segments; drop these settings");
    PhotoPool pool = pool_photos(files, settings, result.warnings);
    std::size_t f = 0;
    for (Part& part : parts)
        if (part.annotations)
            part.unit = pool.units[f++];
    for (const Segment& s : pool.segments)
        result.sample.diameters.push_back(s.diameter);
    result.segments = std::move(pool.segments);
    result.photos = std::move(pool.photos);
    return std::move(pool.masks);
}

void join(const Part& part, bool first, Measurements& result) {
    Sample& sample = result.sample;
    const auto refuse = [&](const std::string& what) {
        throw Error(Fault::bad_input, part.name + ": " + what);
    };
    if (!first && *part.unit != sample.unit)
        refuse("unit is " + std::string(unit_name(*part.unit)) + " but the files before are in " +
               std::string(unit_name(sample.unit)) + "; use one unit");
    if (!first && part.area.has_value() != sample.area.has_value())
        refuse("only some of the files say their area; give it for all or none");
    if (!first && (part.kind == Kind::binned) == sample.bins.empty())
        refuse("binned and single diameters do not mix; bring them to one form");
    if (!first && part.kind == Kind::binned) {
        if (!std::equal(part.bins.begin(), part.bins.end(), sample.bins.begin(), sample.bins.end(),
                        [](const Bin& a, const Bin& b) { return a.lo == b.lo && a.hi == b.hi; }))
            refuse("its bins differ from those of the files before; use the same edges");
        for (std::size_t i = 0; i < part.bins.size(); ++i)
            sample.bins[i].count += part.bins[i].count;
    } else if (part.kind == Kind::binned) {
        sample.bins = part.bins;
    }
    sample.unit = *part.unit;
    if (part.area)
        sample.area = sample.area.value_or(0) + *part.area;
    sample.diameters.insert(sample.diameters.end(), part.diameters.begin(), part.diameters.end());
}

// How many times larger the surface is than its image, by E[minor / major] when all have a minor
// axis.
std::optional<double> stretch_of(const std::vector<Segment>& segments) {
    double ratios = 0;
    for (const Segment& s : segments) {
        if (!s.minor_px)
            return std::nullopt;
        ratios += *s.minor_px / std::hypot(s.x2 - s.x1, s.y2 - s.y1);
    }
    if (segments.empty())
        return std::nullopt;
    return static_cast<double>(segments.size()) / ratios;
}

void straighten_area(const std::optional<double>& area_factor, Measurements& result) {
    std::optional<double> stretch = stretch_of(result.segments);
    if (area_factor) {
        if (stretch)
            throw Error(Fault::bad_argument, "area factor: the segments have minor axes, which "
                                             "say the slant already; leave it out");
        if (result.sample.frames.empty())
            throw Error(Fault::bad_argument,
                        "area factor: it is for photos whose window is known, and these have "
                        "none; give the area of the surface itself, or a mask");
        stretch = area_factor;
    }
    if (!result.sample.area || !stretch)
        return;
    *result.sample.area *= *stretch;
    for (Frame& frame : result.sample.frames)
        frame.area *= *stretch;
}

// Lengths are final by now. A given area has no parts, so it makes no frames.
void add_windows(const std::vector<std::optional<Image>>& masks, Measurements& result) {
    for (std::size_t i = 0; i < result.photos.size(); ++i) {
        Photo& photo = result.photos[i];
        photo.masked = masks[i].has_value();
        if (masks[i])
            photo.window = Window::mask(*masks[i], photo.unit_per_px);
        else if (photo.width_px > 0)
            photo.window = Window::rectangle(photo.width_px * photo.unit_per_px,
                                             photo.height_px * photo.unit_per_px);
    }
    // Profiles from other tables lie on no photo, so photos are not all that was searched.
    if (result.sample.area || result.segments.size() != n_profiles(result.sample) ||
        !std::all_of(result.photos.begin(), result.photos.end(),
                     [](const Photo& p) { return p.window.has_value(); }))
        return;
    result.sample.area = 0;
    for (const Photo& photo : result.photos) {
        result.sample.frames.push_back({photo.window->area(), {}, photo.window});
        *result.sample.area += photo.window->area();
    }
}

void scale_to_greatest(Measurements& result) {
    Sample& sample = result.sample;
    if (sample.unit != LengthUnit::greatest)
        return;
    const double greatest =
        sample.bins.empty() ? *std::max_element(sample.diameters.begin(), sample.diameters.end())
                            : 1;
    for (Segment& s : result.segments)
        s.diameter /= greatest;
    for (Photo& photo : result.photos)
        photo.unit_per_px /= greatest;
    if (!result.segments.empty())
        for (double& d : sample.diameters)
            d /= greatest;
    const auto past_1 = [](const Bin& bin) { return bin.lo >= 1 && bin.count > 0; };
    const bool fits = sample.bins.empty()
                          ? result.segments.size() == sample.diameters.size() || greatest == 1
                          : std::none_of(sample.bins.begin(), sample.bins.end(), past_1);
    if (!fits)
        throw Error(Fault::bad_input, result.sources.back().name +
                                          ": unit is greatest but the greatest diameter is "
                                          "not 1; divide by it, or say unit=px or m");
}

void check_settings(const MeasurementSettings& settings) {
    const auto check = [](const char* name, const std::optional<double>& value, bool zero) {
        if (value && !(std::isfinite(*value) && (*value > 0 || (zero && *value == 0))))
            throw Error(Fault::bad_argument, std::string("measurements: ") + name + " is " +
                                                 shortest(*value) + "; must be finite and " +
                                                 (zero ? ">= 0" : "> 0"));
    };
    check("unit_per_px", settings.unit_per_px, false);
    check("area", settings.area, false);
    check("detection limit", settings.detection_limit, true);
    check("scale bar", settings.scale_bar_m, false);
    if (settings.area_factor && !(*settings.area_factor >= 1 && *settings.area_factor <= 100))
        throw Error(Fault::bad_argument, "measurements: area factor is " +
                                             shortest(*settings.area_factor) +
                                             "; must be in 1..100, 1 / cos of the tilt");
    if (settings.scale_bar_m && settings.unit == LengthUnit::pixel)
        throw Error(Fault::bad_argument, "measurements: a scale bar gives metres but unit is px; "
                                         "drop one of them");
    if (settings.label == "scale")
        throw Error(Fault::bad_argument, "measurements: label is 'scale', which names scale bars "
                                         "and never holes; use another");
}

} // namespace

Measurements read_measurements(std::span<const std::filesystem::path> paths,
                               const MeasurementSettings& settings) {
    check_settings(settings);
    if (paths.empty())
        throw Error(Fault::bad_argument, "measurements: no files; give at least one");
    Measurements result;
    std::vector<Part> parts;
    for (const std::filesystem::path& path : paths)
        parts.push_back(read_measurement_part(path, settings, result));
    if (parts.size() == 1 && parts.front().planes && parts.front().volume)
        result.shared =
            SharedHoles{static_cast<std::size_t>(*parts.front().planes), *parts.front().volume};
    const auto masks = join_segments(parts, settings, result);
    for (std::size_t i = 0; i < parts.size(); ++i)
        join(parts[i], i == 0, result);
    if (settings.area)
        result.sample.area = settings.area;
    result.sample.detection_limit = settings.detection_limit;
    result.sample.counting = settings.counting;
    const std::uint64_t n = n_profiles(result.sample);
    if (n < kFewestProfiles)
        throw Error(Fault::bad_input,
                    result.sources.back().name + ": " + std::to_string(n) +
                        " profiles; at least 8 are needed, mark more holes" +
                        (settings.masks.empty()
                             ? ""
                             : ", or see whether the masks are bright where was searched"));
    scale_to_greatest(result);
    add_windows(masks, result);
    straighten_area(settings.area_factor, result);
    check_sample(result.sample);
    return result;
}

} // namespace taihu
