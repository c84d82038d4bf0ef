#pragma once
#include <optional>
#include <string>
#include <string_view>

namespace taihu {

/// Whether `text` is well-formed UTF-8: no overlong forms, no surrogates, nothing above U+10FFFF.
bool is_utf8(std::string_view text);

/// UTF-16 without its byte order mark, as UTF-8; nothing for an odd number of bytes or a surrogate
/// without its pair.
std::optional<std::string> utf8_from_utf16(std::string_view bytes, bool big_endian);

} // namespace taihu
