#pragma once
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string>

namespace taihu {

/// The shortest decimal text that reads back as `value`; the same on every machine and locale.
inline std::string shortest(double value) {
    std::array<char, 32> text{}; // the longest double needs 24
    const auto written = std::to_chars(text.data(), text.data() + text.size(), value);
    return {text.data(), written.ptr};
}

/// `value` to so many significant digits (1..17), for people: 0.0123, 2480, 1.5e-07; the same on
/// every machine and locale.
inline std::string rounded(double value, int digits = 3) {
    std::array<char, 64> text{};
    const double size = std::abs(value);
    const bool plain = size >= 1e-4 && size < 1e9;
    auto written = std::to_chars(text.data(), text.data() + text.size(), value,
                                 std::chars_format::scientific, digits - 1);
    if (!plain && size > 0)
        return {text.data(), written.ptr};
    double exact = 0; // rounded by its decimal digits, so that 999.6 becomes 1000
    std::from_chars(text.data(), written.ptr, exact);
    const int before = size > 0 ? static_cast<int>(std::floor(std::log10(std::abs(exact)))) : 0;
    written = std::to_chars(text.data(), text.data() + text.size(), exact, std::chars_format::fixed,
                            std::max(0, digits - 1 - before));
    std::string out(text.data(), written.ptr);
    if (out.find('.') != std::string::npos)
        out.erase(out.find_last_not_of('0') + 1);
    if (out.back() == '.')
        out.pop_back();
    return out;
}

} // namespace taihu
