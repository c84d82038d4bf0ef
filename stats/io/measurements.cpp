#include "stats/io/measurements.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <tuple>
#include <utility>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/sha256.h"
#include "stats/core/text.h"
#include "stats/io/table_detail.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

constexpr std::uint64_t kFewestProfiles = 8;

enum class Kind { plain, binned, segments, profiles };

struct Format {
    Kind kind;
    std::string_view mark; ///< the column that no other format has
    std::vector<std::string_view> required, optional;
};

const std::vector<Format>& formats() {
    static const std::vector<Format> kFormats = {
        {Kind::binned, "count", {"diameter_lo", "diameter_hi", "count"}, {}},
        {Kind::segments,
         "x1",
         {"image", "label", "x1", "y1", "x2", "y2", "unit_per_px"},
         {"minor"}},
        {Kind::profiles, "diameter_m", {"plane", "u_m", "v_m", "diameter_m"}, {}},
        {Kind::plain, "diameter", {"diameter"}, {}}};
    return kFormats;
}

// What one file says, before files are joined.
struct Part {
    Kind kind;
    std::string name;
    std::vector<double> diameters;
    std::vector<Bin> bins;
    std::vector<Segment> segments;
    bool scaled = false; ///< segments with a unit_per_px other than 1
    std::optional<LengthUnit> unit;
    std::optional<double> area;
};

const Format& recognise(const Table& table) {
    for (const Format& format : formats()) {
        if (!table.find(format.mark))
            continue;
        auto known = format.required;
        known.insert(known.end(), format.optional.begin(), format.optional.end());
        table.check_header(known);
        for (const std::string_view name : format.required)
            table.column(name);
        return format;
    }
    std::vector<std::string_view> known;
    for (const Format& format : formats())
        known.insert(known.end(), format.required.begin(), format.required.end());
    table.check_header(known);
    table.refuse_line(0, "the columns make no format; use diameter, or "
                         "diameter_lo,diameter_hi,count, or "
                         "image,label,x1,y1,x2,y2,unit_per_px");
}

void read_comments(const Table& table, Part& part, std::vector<std::string>& warnings) {
    const std::string_view area_key = part.kind == Kind::profiles ? "area_m2" : "area";
    const std::array<std::string_view, 2> known = {"unit", area_key};
    for (const Table::Comment& comment : table.comments()) {
        const std::string key(comment.key);
        if (comment.key == "unit") {
            if (part.unit)
                table.refuse_line(comment.line, "'unit' is there twice; keep one of them");
            try {
                part.unit = unit_from_name(comment.value);
            } catch (const Error& e) {
                table.refuse_line(comment.line, e.what());
            }
        } else if (comment.key == area_key) {
            const auto area = parse_number(comment.value);
            if (part.area)
                table.refuse_line(comment.line, "'" + key + "' is there twice; keep one of them");
            if (!area || !(*area > 0))
                table.refuse_line(comment.line, "'" + key + "' is '" + printable(comment.value) +
                                                    "'; must be a number > 0");
            part.area = area;
        } else if (!key.empty() && !did_you_mean(key, known).empty()) {
            warnings.push_back(part.name + ":" + std::to_string(comment.line) + ": comment '" +
                               printable(key) + "' is not read" + did_you_mean(key, known));
        }
    }
}

void read_plain(const Table& table, std::string_view name, Part& part) {
    const std::size_t column = table.column(name);
    for (std::size_t row = 0; row < table.n_rows(); ++row) {
        const double d = table.number(row, column);
        if (!(d > 0))
            table.refuse(row, column, "must be > 0");
        part.diameters.push_back(d);
    }
}

void read_bins(const Table& table, Part& part) {
    const auto lo = table.column("diameter_lo"), hi = table.column("diameter_hi"),
               count = table.column("count");
    for (std::size_t row = 0; row < table.n_rows(); ++row) {
        const Bin bin{table.number(row, lo), table.number(row, hi), 0};
        const auto n = parse_integer(table.cell(row, count));
        if (!n || *n < 0 || *n > 1'000'000'000)
            table.refuse(row, count, "must be a whole number from 0 to 1e9");
        if (!(bin.lo >= 0))
            table.refuse(row, lo, "must be >= 0");
        if (!(bin.hi > bin.lo))
            table.refuse(row, hi, "must be above the lower edge");
        if (row > 0 && bin.lo != part.bins.back().hi)
            table.refuse(row, lo,
                         "the bin before ends at " + shortest(part.bins.back().hi) +
                             ", bins must touch, empty ones included");
        part.bins.push_back({bin.lo, bin.hi, static_cast<std::uint64_t>(*n)});
    }
}

// The scale of a row, or nothing when neither the row nor the setting has one.
std::optional<double> row_scale(const Table& table, std::size_t row, std::size_t column,
                                const MeasurementSettings& settings) {
    if (table.cell(row, column).empty())
        return settings.unit_per_px;
    const double scale = table.number(row, column);
    if (!(scale > 0))
        table.refuse(row, column, "must be > 0, or empty when it is not known");
    return scale;
}

void read_segments(const Table& table, const MeasurementSettings& settings, Part& part) {
    const std::array<std::size_t, 4> ends = {table.column("x1"), table.column("y1"),
                                             table.column("x2"), table.column("y2")};
    const auto image = table.column("image"), label = table.column("label"),
               per_px = table.column("unit_per_px");
    const auto minor = table.find("minor");
    std::optional<bool> all_known;
    for (std::size_t row = 0; row < table.n_rows(); ++row) {
        Segment s{std::string(table.cell(row, image)),
                  std::string(table.cell(row, label)),
                  table.number(row, ends[0]),
                  table.number(row, ends[1]),
                  table.number(row, ends[2]),
                  table.number(row, ends[3]),
                  0,
                  {},
                  table.line(row)};
        const double length_px = std::hypot(s.x2 - s.x1, s.y2 - s.y1);
        if (!(length_px > 0 && std::isfinite(length_px)))
            table.refuse_line(s.line, "the segment has length " + shortest(length_px) +
                                          "; drop the row or fix its ends");
        const auto scale = row_scale(table, row, per_px, settings);
        if (all_known.value_or(scale.has_value()) != scale.has_value())
            table.refuse(row, per_px, "some rows have a scale and some have none; fill in all");
        all_known = scale.has_value();
        part.scaled = part.scaled || scale.value_or(1) != 1;
        s.diameter = length_px * scale.value_or(1);
        if (minor && !table.cell(row, *minor).empty()) {
            s.minor_px = table.number(row, *minor);
            if (!(*s.minor_px > 0 && *s.minor_px <= length_px))
                table.refuse(row, *minor,
                             "must be > 0 and at most the segment's length, " +
                                 shortest(length_px));
        }
        part.diameters.push_back(s.diameter);
        part.segments.push_back(std::move(s));
    }
    if (part.unit == LengthUnit::metre && all_known == false)
        table.refuse_line(0, "unit is m but unit_per_px is empty; give the metres of a pixel");
}

void warn_of_duplicates(const Part& part, std::vector<std::string>& warnings) {
    using Key = std::tuple<std::string_view, std::pair<double, double>, std::pair<double, double>>;
    std::vector<std::pair<Key, std::size_t>> keys;
    for (const Segment& s : part.segments) {
        const std::pair a{s.x1, s.y1}, b{s.x2, s.y2};
        keys.push_back({Key{s.image, std::min(a, b), std::max(a, b)}, s.line});
    }
    std::sort(keys.begin(), keys.end());
    for (std::size_t i = 1; i < keys.size(); ++i)
        if (keys[i].first == keys[i - 1].first)
            warnings.push_back(part.name + ":" + std::to_string(keys[i].second) +
                               ": the same segment as on line " +
                               std::to_string(keys[i - 1].second) + "; it is counted twice");
}

Part read_part(const std::filesystem::path& path, const MeasurementSettings& settings,
               Measurements& result) {
    const std::string text = read_file(path, std::size_t{256} << 20);
    Part part{};
    part.name = base_name(path);
    result.sources.push_back({part.name, sha256_hex(text)});
    const Table table(text, part.name);
    part.kind = recognise(table).kind;
    if (part.kind == Kind::profiles)
        part.unit = LengthUnit::metre;
    read_comments(table, part, result.warnings);
    if (settings.unit && part.unit && *settings.unit != *part.unit)
        table.refuse_line(0, "unit is " + std::string(unit_name(*part.unit)) + ", not " +
                                 std::string(unit_name(*settings.unit)) +
                                 " as asked for; drop one of them");
    if (settings.unit)
        part.unit = settings.unit;
    switch (part.kind) {
    case Kind::plain:
        read_plain(table, "diameter", part);
        break;
    case Kind::profiles:
        read_plain(table, "diameter_m", part);
        break;
    case Kind::binned:
        read_bins(table, part);
        break;
    case Kind::segments:
        read_segments(table, settings, part);
        warn_of_duplicates(part, result.warnings);
        if (!part.unit && !part.scaled)
            part.unit = LengthUnit::pixel;
        if (part.unit == LengthUnit::greatest && (part.area || settings.area))
            table.refuse_line(0, "an area has no unit when segments are scaled to the greatest; "
                                 "use unit=px or leave the area out");
        break;
    }
    if (!part.unit)
        table.refuse_line(0, "the unit of the lengths is not said; add a line '# unit=m', "
                             "'# unit=px' or '# unit=greatest'");
    return part;
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
    result.segments.insert(result.segments.end(), part.segments.begin(), part.segments.end());
}

// E[minor / major] is how much the picture shortens the surface.
void straighten_area(Measurements& result) {
    if (!result.sample.area || result.segments.empty())
        return;
    double ratios = 0;
    for (const Segment& s : result.segments) {
        if (!s.minor_px)
            return;
        ratios += *s.minor_px / std::hypot(s.x2 - s.x1, s.y2 - s.y1);
    }
    *result.sample.area *= static_cast<double>(result.segments.size()) / ratios;
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
    if (!result.segments.empty())
        for (double& d : sample.diameters)
            d /= greatest;
    const auto past_1 = [](const Bin& bin) { return bin.lo >= 1 && bin.count > 0; };
    const bool fits = sample.bins.empty()
                          ? result.segments.size() == sample.diameters.size() || greatest == 1
                          : std::none_of(sample.bins.begin(), sample.bins.end(), past_1);
    if (!fits)
        throw Error(Fault::bad_input, "measurements: unit is greatest but the greatest diameter is "
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
}

} // namespace

Measurements read_measurements(std::span<const std::filesystem::path> paths,
                               const MeasurementSettings& settings) {
    check_settings(settings);
    if (paths.empty())
        throw Error(Fault::bad_argument, "measurements: no files; give at least one");
    Measurements result;
    for (std::size_t i = 0; i < paths.size(); ++i)
        join(read_part(paths[i], settings, result), i == 0, result);
    if (settings.area)
        result.sample.area = settings.area;
    result.sample.detection_limit = settings.detection_limit;
    const std::uint64_t n = n_profiles(result.sample);
    if (n < kFewestProfiles)
        throw Error(Fault::bad_input, result.sources.back().name + ": " + std::to_string(n) +
                                          " profiles; at least 8 are needed, mark more holes");
    straighten_area(result);
    scale_to_greatest(result);
    check_sample(result.sample);
    return result;
}

} // namespace taihu
