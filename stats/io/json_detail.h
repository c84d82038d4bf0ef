#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace taihu {

/// JSON text as values. Stricter than the grammar: no object may have a key twice.
///
/// \param where  the file's base name; messages begin `where:line:column: `.
/// \throws Error bad_input: more than `max_bytes` or 8 million values, nested deeper than
///         `max_depth`, a key twice, not JSON, invalid UTF-8, a number outside of the range of a
///         double.
nlohmann::json parse_json(std::string_view text, std::string_view where,
                          std::size_t max_bytes = std::size_t{64} << 20,
                          std::size_t max_depth = 64);

/// The same with the keys in their order, of which no object may have more than 1000.
nlohmann::ordered_json parse_ordered_json(std::string_view text, std::string_view where,
                                          std::size_t max_bytes = std::size_t{64} << 20,
                                          std::size_t max_depth = 64);

/// Refuses all but an object that has every key of `required` and none but those and `optional`.
/// \param where  names the object in messages: `law.json: parameters`.
/// \throws Error bad_input, with the key and the nearest known one.
void check_keys(const nlohmann::json& object, const std::string& where,
                std::span<const std::string_view> required,
                std::span<const std::string_view> optional = {});

/// The number `object[key]`, which must be there, finite and in lo..hi.
/// \throws Error bad_input, with `where`, the key, the value and the range.
double json_number(const nlohmann::json& object, const std::string& where, std::string_view key,
                   double lo, double hi);

/// The text `object[key]`, which must be there.
std::string json_text(const nlohmann::json& object, const std::string& where, std::string_view key);

/// `text` as a JSON string, quotes included; invalid UTF-8 is replaced.
std::string json_quoted(std::string_view text);

} // namespace taihu
