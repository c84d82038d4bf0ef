#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace taihu {

/// A finite number that fills the whole of `text` (a leading + is allowed), read without locale;
/// nothing for anything else, `nan`, `inf` and overflow included.
std::optional<double> parse_number(std::string_view text);

/// A decimal integer that fills the whole of `text`; nothing for anything else.
std::optional<std::int64_t> parse_integer(std::string_view text);

/// `text` without spaces and tabs at its ends.
std::string_view trimmed(std::string_view text);

/// `; did you mean 'NAME'?` for the nearest of `known` names, by edit distance, or an empty string
/// when none is near, or `name` is longer than any name.
std::string did_you_mean(std::string_view name, std::span<const std::string_view> known);

/// `text` fit for one line of a message: control characters (those of C1, too) and bytes that are no
/// UTF-8 escaped, cut at `max_length`.
std::string printable(std::string_view text, std::size_t max_length = 40);

/// An Error's message as the one line that people see, `taihu: ...`, without its line end: escaped
/// as printable() does it, at most kMostErrorBytes. Of a long one, first of its long words (paths)
/// and then of the whole, the middle gives way, so that the remedy at the end stays.
std::string error_line(std::string_view message);
inline constexpr std::size_t kMostErrorBytes = 298; ///< below 300 with its line end

} // namespace taihu
