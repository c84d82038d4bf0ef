#include "stats/io/json_detail.h"

#include <algorithm>
#include <set>
#include <vector>

#include "stats/core/error.h"
#include "stats/core/text.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

using nlohmann::json;

// One takes up to 100 bytes of memory however few bytes of text it has.
constexpr std::size_t kMostValues = 8'000'000;
// Keys in their order are sought one by one.
constexpr std::size_t kMostOrderedKeys = 1000;

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
    throw Error(Fault::bad_input, where + ": " + what);
}

// `where:line:column` of a byte; columns count characters, not bytes.
std::string place(std::string_view where, std::string_view text, std::size_t byte) {
    const std::string_view before = text.substr(0, byte);
    const auto line = std::count(before.begin(), before.end(), '\n') + 1;
    const std::string_view row = before.substr(before.rfind('\n') + 1); // npos + 1 is 0
    const auto column = std::count_if(row.begin(), row.end(), [](char c) {
        return (static_cast<unsigned char>(c) & 0xc0) != 0x80;
    });
    return std::string(where) + ":" + std::to_string(line) + ":" + std::to_string(column + 1);
}

// Byte behind the string that begins with the quote at `at`.
std::size_t end_of_string(std::string_view text, std::size_t at) {
    for (++at; at < text.size(); ++at) {
        if (text[at] == '\\')
            ++at;
        else if (text[at] == '"')
            return at + 1;
    }
    return text.size();
}

// A key as it compares, escapes resolved; what is no string is left for the parser to refuse.
std::string key_text(std::string_view quoted) {
    if (quoted.find('\\') != std::string_view::npos) {
        const json value = json::parse(quoted, nullptr, false);
        if (value.is_string())
            return value.get<std::string>();
    }
    return std::string(quoted.substr(1, quoted.size() - std::min<std::size_t>(2, quoted.size())));
}

// One pass over the brackets and keys of text that may not be JSON at all: the parser itself would
// take any depth, and would keep the last of equal keys.
void check_nesting(std::string_view text, std::string_view where, std::size_t max_depth,
                   std::size_t max_keys) {
    struct Level {
        bool object;
        bool key_next;
        std::set<std::string> keys;
    };
    std::vector<Level> levels;
    std::size_t n_values = 0;
    for (std::size_t i = 0; i < text.size();) {
        const char c = text[i];
        if ((c == '{' || c == '[' || c == ',') && ++n_values > kMostValues)
            refuse(std::string(where),
                   "more than " + std::to_string(kMostValues) + " values; split the file");
        if (c == '{' || c == '[') {
            if (levels.size() == max_depth)
                refuse(place(where, text, i),
                       "nested deeper than " + std::to_string(max_depth) + " levels; flatten it");
            levels.push_back({c == '{', c == '{', {}});
        } else if ((c == '}' || c == ']') && !levels.empty()) {
            levels.pop_back();
        } else if (c == ',' && !levels.empty()) {
            levels.back().key_next = levels.back().object;
        } else if (c == '"') {
            const std::size_t end = end_of_string(text, i);
            if (!levels.empty() && levels.back().key_next) {
                const std::string_view quoted = text.substr(i, end - i);
                if (!levels.back().keys.insert(key_text(quoted)).second)
                    refuse(place(where, text, i),
                           "key " + printable(quoted) + " is there twice; keep one of them");
                if (levels.back().keys.size() > max_keys)
                    refuse(place(where, text, i), "an object of more than " +
                                                      std::to_string(max_keys) + " keys; split it");
                levels.back().key_next = false;
            }
            i = end;
            continue;
        }
        ++i;
    }
}

template <class Json>
Json parse(std::string_view text, std::string_view where, std::size_t max_bytes,
           std::size_t max_depth, std::size_t max_keys) {
    if (text.size() > max_bytes)
        refuse(std::string(where), std::to_string(text.size()) + " bytes of JSON, at most " +
                                       std::to_string(max_bytes) + " are read; reduce it");
    check_nesting(text, where, max_depth, max_keys);
    try {
        return Json::parse(text.begin(), text.end());
    } catch (const json::parse_error& e) {
        std::string_view what = e.what(); // `[...] parse error at line 1, column 2: ...`
        what.remove_prefix(std::min(what.find(": ") + 2, what.size()));
        refuse(place(where, text, e.byte == 0 ? 0 : std::min(e.byte - 1, text.size())),
               "not JSON: " + printable(what, 160) + "; correct the file");
    } catch (const json::exception&) { // the one other: a number that overflows
        refuse(std::string(where), "a number is too great for a double; correct the file");
    }
}

} // namespace

json parse_json(std::string_view text, std::string_view where, std::size_t max_bytes,
                std::size_t max_depth) {
    return parse<json>(text, where, max_bytes, max_depth, text.size());
}

nlohmann::ordered_json parse_ordered_json(std::string_view text, std::string_view where,
                                          std::size_t max_bytes, std::size_t max_depth) {
    return parse<nlohmann::ordered_json>(text, where, max_bytes, max_depth, kMostOrderedKeys);
}

void check_keys(const json& object, const std::string& where,
                std::span<const std::string_view> required,
                std::span<const std::string_view> optional) {
    if (!object.is_object())
        refuse(where, "is " + std::string(object.type_name()) + ", must be an object; correct it");
    std::vector<std::string_view> known(required.begin(), required.end());
    known.insert(known.end(), optional.begin(), optional.end());
    for (const auto& [key, value] : object.items()) {
        if (std::find(known.begin(), known.end(), key) != known.end())
            continue;
        const std::string nearest = did_you_mean(key, known);
        refuse(where,
               "unknown key '" + printable(key) + "'" + (nearest.empty() ? "; drop it" : nearest));
    }
    for (const std::string_view key : required)
        if (!object.contains(key))
            refuse(where, "key '" + std::string(key) + "' is missing; add it");
}

double json_number(const json& object, const std::string& where, std::string_view key, double lo,
                   double hi) {
    const auto found = object.find(key);
    if (found == object.end() || !found->is_number())
        refuse(where, "'" + std::string(key) + "' is " +
                          (found == object.end() ? "missing" : found->type_name()) +
                          ", must be a number; correct it");
    const double value = found->get<double>();
    if (!(value >= lo && value <= hi))
        refuse(where, "'" + std::string(key) + "' is " + shortest(value) + ", must be in " +
                          shortest(lo) + ".." + shortest(hi) + "; correct it");
    return value;
}

std::string json_text(const json& object, const std::string& where, std::string_view key) {
    const auto found = object.find(key);
    if (found == object.end() || !found->is_string())
        refuse(where, "'" + std::string(key) + "' is " +
                          (found == object.end() ? "missing" : found->type_name()) +
                          ", must be a string; correct it");
    return found->get<std::string>();
}

std::string json_quoted(std::string_view text) {
    return json(std::string(text)).dump(-1, ' ', false, json::error_handler_t::replace);
}

} // namespace taihu
