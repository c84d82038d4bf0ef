#pragma once
#include <array>
#include <charconv>
#include <string>

namespace taihu {

/// The shortest decimal text that reads back as `value`; the same on every machine and locale.
inline std::string shortest(double value) {
    std::array<char, 32> text{}; // the longest double needs 24
    const auto written = std::to_chars(text.data(), text.data() + text.size(), value);
    return {text.data(), written.ptr};
}

/// `value` to so many significant digits (1..17), for people; the same on every machine and locale.
inline std::string rounded(double value, int digits = 3) {
    std::array<char, 32> text{};
    const auto written = std::to_chars(text.data(), text.data() + text.size(), value,
                                       std::chars_format::general, digits);
    return {text.data(), written.ptr};
}

} // namespace taihu
