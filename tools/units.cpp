#include "tools/units.h"

#include <array>
#include <cctype>
#include <cmath>
#include <utility>
#include <vector>

#include "stats/core/error.h"
#include "stats/core/text.h"

namespace taihu {
namespace {

constexpr double kLeast = 1e-9, kMost_m = 1e6; // as recipes have them
constexpr double kMostRelative = 1e9, kMost_deg = 1e6;

[[noreturn]] void refuse_range(const std::string& option, const std::string& text,
                               const char* range) {
    throw Error(Fault::bad_argument,
                option + ": '" + printable(text) + "' is out of range; give " + range);
}

} // namespace

Length parse_length(const std::string& option, const std::string& text) {
    std::size_t end = text.size();
    while (end > 0 &&
           (std::isalpha(static_cast<unsigned char>(text[end - 1])) || text[end - 1] == '%'))
        --end;
    const auto value = parse_number(std::string_view(text).substr(0, end));
    const std::string_view unit = std::string_view(text).substr(end);
    static constexpr std::array<std::pair<std::string_view, double>, 5> kMetric = {
        {{"", 1}, {"m", 1}, {"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}}};
    if (value && *value > 0) {
        for (const auto& [name, metres] : kMetric)
            if (unit == name) {
                if (!(*value * metres >= kLeast && *value * metres <= kMost_m))
                    refuse_range(option, text, "1e-9m to 1e6m");
                return {*value * metres, Length::Unit::metre};
            }
        if (unit == "vox" || unit == "%") {
            if (!(*value >= kLeast && *value <= kMostRelative))
                refuse_range(option, text, "1e-9 to 1e9 voxels or percent");
            return {*value, unit == "%" ? Length::Unit::percent : Length::Unit::voxel};
        }
    }
    throw Error(Fault::bad_argument, option + ": '" + printable(text) +
                                         "' is no length > 0; write 0.5m, 12mm, 2vox or 25%");
}

double in_metres(const std::string& option, const Length& length, const Measure& of) {
    const double one = length.unit == Length::Unit::metre   ? 1
                       : length.unit == Length::Unit::voxel ? of.voxel_m
                                                            : of.longest_m / 100;
    if (!(one > 0))
        throw Error(Fault::bad_argument,
                    option + ": a length in " +
                        (length.unit == Length::Unit::voxel ? "voxels" : "percent") +
                        " has nothing to refer to here; give it in metres");
    return length.value * one;
}

double length_m(const std::string& option, const std::string& text, const Measure& of) {
    return in_metres(option, parse_length(option, text), of);
}

double angle_deg(const std::string& option, const std::string& text) {
    std::string_view number = text;
    if (number.ends_with("deg"))
        number.remove_suffix(3);
    if (const auto value = parse_number(number)) {
        if (!(std::abs(*value) <= kMost_deg))
            refuse_range(option, text, "-1e6deg to 1e6deg");
        return *value;
    }
    throw Error(Fault::bad_argument,
                option + ": '" + printable(text) + "' is no angle; write 25deg");
}

double memory_bytes(const std::string& option, const std::string& text) {
    std::size_t end = text.size();
    while (end > 0 && std::isalpha(static_cast<unsigned char>(text[end - 1])))
        --end;
    const auto value = parse_number(std::string_view(text).substr(0, end));
    const std::string_view unit = std::string_view(text).substr(end);
    static constexpr std::array<std::pair<std::string_view, double>, 5> kUnits = {
        {{"", 1}, {"kB", 1e3}, {"MB", 1e6}, {"GB", 1e9}, {"TB", 1e12}}};
    for (const auto& [name, bytes] : kUnits)
        if (value && *value > 0 && unit == name)
            return *value * bytes;
    throw Error(Fault::bad_argument, option + ": '" + printable(text) +
                                         "' is no amount of memory > 0; write 4GB or 500MB");
}

Vec3 parse_size(const std::string& option, const std::string& text) {
    std::vector<double> parts;
    for (std::size_t at = 0; at <= text.size();) {
        const std::size_t comma = std::min(text.find(',', at), text.size());
        parts.push_back(length_m(option, text.substr(at, comma - at)));
        at = comma + 1;
    }
    if (parts.size() == 1)
        return {parts[0], parts[0], parts[0]};
    if (parts.size() != 3)
        throw Error(Fault::bad_argument,
                    option + ": '" + printable(text) + "' must be one length or three: X or X,Y,Z");
    return {parts[0], parts[1], parts[2]};
}

} // namespace taihu
