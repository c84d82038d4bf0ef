#include "stats/io/measurement_part_detail.h"

#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/sha256.h"
#include "stats/core/text.h"
#include "stats/io/cvat_file_detail.h"
#include "stats/io/imagej_file_detail.h"
#include "stats/io/json_detail.h"
#include "stats/io/labelme_file_detail.h"
#include "stats/io/table_detail.h"
#include "stats/io/via_file_detail.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

using Part = MeasurementPart;
using Kind = Part::Kind;

constexpr std::size_t kMostBytes = std::size_t{256} << 20;

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
         {"minor", "width_px", "height_px"}},
        {Kind::profiles, "diameter_m", {"plane", "u_m", "v_m", "diameter_m"}, {}},
        {Kind::plain, "diameter", {"diameter"}, {}}};
    return kFormats;
}

// Chinese names of columns, for people who head their tables so.
constexpr std::array kAliases = std::to_array<Table::Alias>({
    {"图像", "image"},
    {"图片", "image"},
    {"照片", "image"},
    {"标签", "label"},
    {"类别", "label"},
    {"直径", "diameter"},
    {"直径下限", "diameter_lo"},
    {"直径上限", "diameter_hi"},
    {"数量", "count"},
    {"个数", "count"},
    {"起点x", "x1"},
    {"起点y", "y1"},
    {"终点x", "x2"},
    {"终点y", "y2"},
    {"起点X", "x1"},
    {"起点Y", "y1"},
    {"终点X", "x2"},
    {"终点Y", "y2"},
    {"每像素长度", "unit_per_px"},
    {"短轴", "minor"},
    {"图像宽度", "width_px"},
    {"图像高度", "height_px"},
});

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
            const auto area = table.parse(comment.value);
            if (part.area)
                table.refuse_line(comment.line, "'" + key + "' is there twice; keep one of them");
            if (!area || !(*area > 0))
                table.refuse_line(comment.line, "'" + key + "' is '" + printable(comment.value) +
                                                    "'; must be a number > 0");
            part.area = area;
        } else if (part.kind == Kind::profiles && (key == "planes" || key == "volume_m3")) {
            const auto value = table.parse(comment.value);
            if (!value || !(*value > 0))
                table.refuse_line(comment.line, "'" + key + "' is '" + printable(comment.value) +
                                                    "'; must be a number > 0");
            if (key == "planes" && !(*value <= 1e9 && *value == std::floor(*value)))
                table.refuse_line(comment.line, "'planes' is '" + printable(comment.value) +
                                                    "'; must be a whole number from 1 to 1e9");
            (key == "planes" ? part.planes : part.volume) = value;
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
    constexpr std::size_t kMostBins = 2000; // each asks for an integral of every law that is tried
    if (table.n_rows() > kMostBins)
        table.refuse_line(0, std::to_string(table.n_rows()) + " bins, at most " +
                                 std::to_string(kMostBins) + " are read; join them");
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

// A cell that may be empty, and else holds a number > 0.
std::optional<double> optional_cell(const Table& table, std::size_t row,
                                    std::optional<std::size_t> column) {
    if (!column || table.cell(row, *column).empty())
        return std::nullopt;
    const double value = table.number(row, *column);
    if (!(value > 0))
        table.refuse(row, *column, "must be > 0, or empty when it is not known");
    return value;
}

int side_cell(const Table& table, std::size_t row, std::optional<std::size_t> column) {
    const auto value = optional_cell(table, row, column);
    const auto side = value ? picture_side(*value) : std::nullopt;
    if (value && !side)
        table.refuse(row, *column, "must be a whole number in 1..1000000");
    return side.value_or(0);
}

Annotations read_segments(const Table& table, const std::string& name) {
    const std::array<std::size_t, 4> ends = {table.column("x1"), table.column("y1"),
                                             table.column("x2"), table.column("y2")};
    const auto image = table.column("image"), label = table.column("label"),
               per_px = table.column("unit_per_px");
    const auto minor = table.find("minor"), width = table.find("width_px"),
               height = table.find("height_px");
    Annotations result;
    result.file = name;
    for (std::size_t row = 0; row < table.n_rows(); ++row) {
        Mark m;
        m.photo = result.photo(std::string(table.cell(row, image)));
        m.label = table.cell(row, label);
        m.x1 = table.number(row, ends[0]);
        m.y1 = table.number(row, ends[1]);
        m.x2 = table.number(row, ends[2]);
        m.y2 = table.number(row, ends[3]);
        m.line = table.line(row);
        m.unit_per_px = optional_cell(table, row, per_px);
        m.minor_px = optional_cell(table, row, minor);
        const double length_px = std::hypot(m.x2 - m.x1, m.y2 - m.y1);
        if (m.minor_px && *m.minor_px > length_px)
            table.refuse(row, *minor,
                         "must be > 0 and at most the segment's length, " + shortest(length_px));
        const int w = side_cell(table, row, width), h = side_cell(table, row, height);
        if ((w == 0) != (h == 0))
            table.refuse_line(m.line, "only one of width_px and height_px is there; give both");
        result.set_size(m.photo, w, h);
        result.marks.push_back(std::move(m));
    }
    return result;
}

void take_unit(const MeasurementSettings& settings, Part& part) {
    if (settings.unit && part.unit && *settings.unit != *part.unit)
        throw Error(Fault::bad_input,
                    part.name + ": unit is " + std::string(unit_name(*part.unit)) + ", not " +
                        std::string(unit_name(*settings.unit)) + " as asked for; drop one of them");
    if (settings.unit)
        part.unit = settings.unit;
}

void read_own_table(Table& table, const MeasurementSettings& settings, Part& part,
                    std::vector<std::string>& warnings) {
    table.rename(kAliases);
    part.kind = recognise(table).kind;
    if (part.kind == Kind::profiles)
        part.unit = LengthUnit::metre;
    read_comments(table, part, warnings);
    take_unit(settings, part);
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
        part.annotations = read_segments(table, part.name);
        if (part.unit == LengthUnit::greatest && (part.area || settings.area))
            table.refuse_line(0, "an area has no unit when segments are scaled to the greatest; "
                                 "use unit=px or leave the area out");
        return;
    }
    if (!part.unit)
        table.refuse_line(0, "the unit of the lengths is not said; add a line '# unit=m', "
                             "'# unit=px' or '# unit=greatest'");
}

Annotations read_json_annotations(std::string_view text, const std::string& name) {
    // labelme may keep the photo itself in its file.
    const nlohmann::json file = parse_json(text, name, kMostBytes);
    if (is_labelme(file))
        return read_labelme(file, name);
    if (is_via(file))
        return read_via(file, name);
    throw Error(Fault::bad_input, name + ": is JSON, but neither of labelme nor of VIA; save the "
                                         "segments in one of their formats or as CSV");
}

bool is_results_table(const Table& table) {
    return table.find("Length") || table.header()[0].empty();
}

void refuse_roi_list(const Table& table) {
    if (table.find("Name") && table.find("Type") && table.find("LWidth"))
        table.refuse_line(0, "is the list of ImageJ's ROI Manager, which has no ends; save the "
                             "ROIs themselves (More, Save) or the results of Measure");
}

} // namespace

MeasurementPart read_measurement_part(const std::filesystem::path& path,
                                      const MeasurementSettings& settings, Measurements& result) {
    const std::string bytes = read_file(path, kMostBytes);
    Part part;
    part.name = base_name(path);
    result.sources.push_back({part.name, sha256_hex(bytes)});
    std::string_view text = bytes;
    if (text.starts_with("\xef\xbb\xbf"))
        text.remove_prefix(3);
    const std::size_t first = text.find_first_not_of(" \t\r\n");
    const char begin = first == std::string_view::npos ? '\0' : text[first];
    if (text.empty())
        throw Error(Fault::bad_input, part.name + ": is empty; save the marks again");
    if (text.starts_with("\x89PNG") || text.starts_with("\xff\xd8\xff") ||
        text.starts_with("II*") || text.starts_with("MM"))
        throw Error(Fault::bad_input, part.name + ": is a picture; give the file of the marks on "
                                                  "it, as labelme's .json");
    if (is_imagej_roi(text)) {
        part.annotations = read_imagej_roi(text, part.name);
    } else if (is_zip(text)) {
        part.annotations = read_imagej_zip(text, part.name);
    } else if (begin == '{' || begin == '[') {
        part.annotations = read_json_annotations(text, part.name);
    } else if (begin == '<') {
        part.annotations = read_cvat(text, part.name);
    } else {
        Table table(bytes, part.name);
        refuse_roi_list(table);
        if (table.find(kViaShapeColumn))
            part.annotations = read_via_table(table, part.name);
        else if (is_results_table(table))
            part.annotations = read_imagej_results(table, part.name);
        else
            read_own_table(table, settings, part, result.warnings);
    }
    if (part.annotations) {
        take_unit(settings, part);
        if (part.unit == LengthUnit::greatest && settings.area)
            throw Error(Fault::bad_argument,
                        "area: has no unit when segments are scaled to the greatest; use unit px "
                        "or leave the area out");
        part.annotations->unit = part.unit;
    }
    return part;
}

} // namespace taihu
