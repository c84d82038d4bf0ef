#include "stats/io/imagej_file_detail.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>

#include <zip.h>

#include "stats/core/error.h"
#include "stats/core/text.h"
#include "stats/io/utf_detail.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

constexpr std::size_t kMostEntries = 100'000;
constexpr std::size_t kMostEntryBytes = std::size_t{1} << 20;
constexpr std::size_t kMostBytes = std::size_t{256} << 20;

// Types of ROI, in the order of their numbers.
constexpr std::array<std::string_view, 11> kTypes = {
    "polygon",  "rectangle", "oval",         "line",  "freehand line", "polyline",
    "no shape", "freehand",  "traced shape", "angle", "points"};
constexpr std::size_t kLine = 3, kPolyline = 5;

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
    throw Error(Fault::bad_input, where + ": " + what);
}

/// Big-endian numbers of a .roi, each checked against its end.
class RoiBytes {
public:
    RoiBytes(std::string_view bytes, std::string where) : bytes_(bytes), where_(std::move(where)) {}

    std::string_view part(std::size_t at, std::size_t size) const {
        if (at > bytes_.size() || size > bytes_.size() - at)
            refuse(where_,
                   std::to_string(bytes_.size()) + " bytes, the ROI is cut short; save it again");
        return bytes_.substr(at, size);
    }
    std::uint32_t u32(std::size_t at) const {
        std::uint32_t value = 0;
        for (const char c : part(at, 4))
            value = value << 8 | static_cast<unsigned char>(c);
        return value;
    }
    std::uint16_t u16(std::size_t at) const {
        const std::string_view two = part(at, 2);
        return static_cast<std::uint16_t>(static_cast<unsigned char>(two[0]) << 8 |
                                          static_cast<unsigned char>(two[1]));
    }
    double i16(std::size_t at) const { return static_cast<std::int16_t>(u16(at)); }
    double f32(std::size_t at) const {
        const auto value = std::bit_cast<float>(u32(at));
        if (!std::isfinite(value))
            refuse(where_, "a coordinate is not finite; mark it again");
        return value;
    }

private:
    std::string_view bytes_;
    std::string where_;
};

// The name kept inside, or an empty text.
std::string inner_name(const RoiBytes& roi) {
    const std::size_t header2 = roi.u32(60);
    if (header2 == 0)
        return {};
    const std::size_t at = roi.u32(header2 + 16), length = roi.u32(header2 + 20);
    if (at == 0 || length == 0)
        return {};
    return utf8_from_utf16(roi.part(at, 2 * length), true).value_or(std::string());
}

bool is_number(std::string_view text) {
    return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

std::string label_of(std::string_view roi) {
    if (roi.ends_with(".roi"))
        roi.remove_suffix(4);
    while (true) {
        const std::size_t dash = roi.rfind('-');
        if (dash == std::string_view::npos || !is_number(roi.substr(dash + 1)))
            return is_number(roi) ? std::string() : std::string(roi);
        roi = roi.substr(0, dash);
    }
}

std::vector<std::pair<double, double>> polyline_points(const RoiBytes& roi) {
    static constexpr std::size_t kCoordinates = 64, kHasFloats = 128;
    const std::size_t n = roi.u16(16);
    const bool floats = roi.u16(4) >= 222 && (roi.u16(50) & kHasFloats) != 0;
    const double left = roi.i16(10), top = roi.i16(8);
    std::vector<std::pair<double, double>> points;
    for (std::size_t i = 0; i < n; ++i) {
        const std::size_t x = kCoordinates + 4 * n + 4 * i; // floats follow the integers
        if (floats)
            points.emplace_back(roi.f32(x), roi.f32(x + 4 * n));
        else
            points.emplace_back(left + roi.u16(kCoordinates + 2 * i),
                                top + roi.u16(kCoordinates + 2 * n + 2 * i));
    }
    return points;
}

/// \param roi_name  of the ROI in its container, used when it has no name inside.
void add_roi(std::string_view bytes, const std::string& roi_name, Mark mark, Annotations& result) {
    const RoiBytes roi(bytes, place_of(result, mark));
    if (!is_imagej_roi(bytes))
        return result.leave_out("file that is no ROI");
    const auto type = static_cast<std::size_t>(static_cast<unsigned char>(roi.part(6, 1)[0]));
    roi.part(0, 64); // the header is always whole
    if (type != kLine && type != kPolyline)
        return result.leave_out(type < kTypes.size() ? kTypes[type] : "unknown type");
    const std::string inner = inner_name(roi);
    mark.label = label_of(inner.empty() ? roi_name : inner);
    if (type == kLine)
        result.add_polyline(std::move(mark),
                            {{roi.f32(18), roi.f32(22)}, {roi.f32(26), roi.f32(30)}}, "line");
    else
        result.add_polyline(std::move(mark), polyline_points(roi), "polyline");
}

using Archive = std::unique_ptr<zip_t, decltype(&zip_discard)>;

Archive open_zip(std::string_view bytes, const std::string& name) {
    zip_error_t error;
    zip_error_init(&error);
    zip_source_t* source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error);
    zip_t* archive = source ? zip_open_from_source(source, ZIP_RDONLY, &error) : nullptr;
    const std::string why = archive ? "" : zip_error_strerror(&error);
    zip_error_fini(&error);
    if (!archive) {
        if (source)
            zip_source_free(source);
        refuse(name, "damaged zip: " + printable(why, 100) + "; save it again");
    }
    return {archive, zip_discard};
}

std::string read_entry(zip_t* archive, std::size_t index, const zip_stat_t& entry,
                       const std::string& where) {
    if (entry.encryption_method != ZIP_EM_NONE ||
        (entry.comp_method != ZIP_CM_STORE && entry.comp_method != ZIP_CM_DEFLATE))
        refuse(where, "has a password or a rare compression; save it again in ImageJ");
    if (entry.size > kMostEntryBytes)
        refuse(where, std::to_string(entry.size) + " bytes, a ROI has at most " +
                          std::to_string(kMostEntryBytes) + "; drop it");
    const std::unique_ptr<zip_file_t, decltype(&zip_fclose)> file(
        zip_fopen_index(archive, index, 0), zip_fclose);
    // One byte more than it should have: its checksum is only looked at behind the last one.
    std::string bytes(static_cast<std::size_t>(entry.size) + 1, '\0');
    std::size_t done = 0;
    zip_int64_t n = file ? 1 : -1;
    while (n > 0 && done < bytes.size()) {
        n = zip_fread(file.get(), bytes.data() + done, bytes.size() - done);
        done += static_cast<std::size_t>(std::max<zip_int64_t>(n, 0));
    }
    if (n < 0 || done != entry.size)
        refuse(where, "is damaged; save the ROIs again");
    bytes.resize(done);
    return bytes;
}

/// The columns of a table of results that are read.
struct ResultColumns {
    std::size_t length;
    std::optional<std::size_t> label, bx, by, width, height, angle;

    explicit ResultColumns(const Table& table)
        : length(table.column("Length")), label(table.find("Label")), bx(table.find("BX")),
          by(table.find("BY")), width(table.find("Width")), height(table.find("Height")),
          angle(table.find("Angle")) {}
    bool tell_ends() const { return bx && by && width && height && angle; }
};

// The box of a line and which of its diagonals the line is. ImageJ rounds the box to pixels and
// the numbers to three decimals; a longer way than the diagonal is no straight line.
void read_ends(const Table& table, std::size_t row, const ResultColumns& columns, Mark& mark) {
    const double x = table.number(row, *columns.bx), y = table.number(row, *columns.by);
    const double w = table.number(row, *columns.width), h = table.number(row, *columns.height);
    const double angle = table.number(row, *columns.angle) * std::numbers::pi / 180;
    mark.has_ends =
        std::abs(std::hypot(w, h) - *mark.length_px) <= std::max(0.02 * *mark.length_px, 1.0);
    if (!mark.has_ends)
        return;
    const bool rightwards = std::cos(angle) >= 0, upwards = std::sin(angle) > 0;
    mark.x1 = rightwards ? x : x + w;
    mark.x2 = rightwards ? x + w : x;
    mark.y1 = upwards ? y + h : y;
    mark.y2 = upwards ? y : y + h;
}

bool is_summary(std::string_view label) {
    return label == "Mean" || label == "SD" || label == "Min" || label == "Max";
}

} // namespace

bool is_imagej_roi(std::string_view bytes) {
    return bytes.starts_with("Iout");
}

bool is_zip(std::string_view bytes) {
    return bytes.starts_with("PK\x03\x04") || bytes.starts_with("PK\x05\x06");
}

Annotations read_imagej_roi(std::string_view bytes, const std::string& name) {
    Annotations result;
    result.file = name;
    Mark mark;
    mark.photo = result.photo(""); // the ROIs of one photo may come as one file each
    mark.item = "its ROI";
    add_roi(bytes, name, std::move(mark), result);
    return result;
}

Annotations read_imagej_zip(std::string_view bytes, const std::string& name) {
    const Archive archive = open_zip(bytes, name);
    const auto n_entries = static_cast<std::size_t>(zip_get_num_entries(archive.get(), 0));
    if (n_entries > kMostEntries)
        refuse(name, std::to_string(n_entries) + " entries, at most " +
                         std::to_string(kMostEntries) + " are read; split it");
    Annotations result;
    result.file = name;
    std::size_t total_bytes = 0;
    for (std::size_t i = 0; i < n_entries; ++i) {
        zip_stat_t entry;
        zip_stat_init(&entry);
        static constexpr zip_uint64_t kNeeded =
            ZIP_STAT_NAME | ZIP_STAT_SIZE | ZIP_STAT_COMP_METHOD | ZIP_STAT_ENCRYPTION_METHOD;
        if (zip_stat_index(archive.get(), i, 0, &entry) != 0 || (entry.valid & kNeeded) != kNeeded)
            refuse(name, "entry " + std::to_string(i + 1) + " is damaged; save the ROIs again");
        const std::string roi_name = last_part(entry.name);
        if (roi_name.empty()) // a folder
            continue;
        Mark mark;
        mark.photo = result.photo(std::nullopt);
        mark.item = "'" + printable(roi_name) + "'";
        const std::string roi = read_entry(archive.get(), i, entry, place_of(result, mark));
        total_bytes += roi.size();
        if (total_bytes > kMostBytes)
            refuse(name, "more than " + std::to_string(kMostBytes) + " bytes unpacked; split it");
        add_roi(roi, roi_name, std::move(mark), result);
    }
    return result;
}

Annotations read_imagej_results(const Table& table, const std::string& name) {
    Annotations result;
    result.file = name;
    result.perhaps_calibrated = true;
    const ResultColumns columns(table);
    for (std::size_t row = 0; row < table.n_rows(); ++row) {
        const std::string_view label = columns.label ? table.cell(row, *columns.label) : "";
        if (is_summary(label)) {
            result.leave_out("row of Summarize");
            continue;
        }
        const std::size_t colon = std::min(label.find(':'), label.size());
        Mark mark;
        mark.photo = result.photo(columns.label && colon > 0
                                      ? std::optional(std::string(label.substr(0, colon)))
                                      : std::nullopt);
        mark.label = label_of(label.substr(std::min(colon + 1, label.size())));
        mark.line = table.line(row);
        mark.length_px = table.number(row, columns.length);
        if (!(*mark.length_px > 0))
            table.refuse(row, columns.length, "must be > 0, drop the row");
        mark.has_ends = false;
        if (columns.tell_ends())
            read_ends(table, row, columns, mark);
        result.marks.push_back(std::move(mark));
    }
    return result;
}

} // namespace taihu
