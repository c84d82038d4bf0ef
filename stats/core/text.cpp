#include "stats/core/text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <vector>

namespace taihu {

std::optional<double> parse_number(std::string_view text) {
    if (text.starts_with('+') && !text.starts_with("+-"))
        text.remove_prefix(1);
    double value = 0;
    const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (fault != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
        return std::nullopt;
    return value;
}

std::optional<std::int64_t> parse_integer(std::string_view text) {
    std::int64_t value = 0;
    const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (fault != std::errc() || end != text.data() + text.size())
        return std::nullopt;
    return value;
}

std::string_view trimmed(std::string_view text) {
    const auto first = text.find_first_not_of(" \t\r");
    if (first == std::string_view::npos)
        return {};
    return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::string did_you_mean(std::string_view name, std::span<const std::string_view> known) {
    constexpr std::size_t kLongestName = 256; // a key of a foreign file may have megabytes
    if (name.size() > kLongestName)
        return {};
    std::string_view nearest;
    std::size_t best = std::max<std::size_t>(2, name.size() / 3) + 1; // farther is no likely typo
    for (const std::string_view candidate : known) {
        std::vector<std::size_t> row(candidate.size() + 1);
        std::iota(row.begin(), row.end(), std::size_t{0});
        for (std::size_t i = 0; i < name.size(); ++i) {
            std::size_t diagonal = row[0];
            row[0] = i + 1;
            for (std::size_t j = 0; j < candidate.size(); ++j) {
                const std::size_t substituted = diagonal + (name[i] == candidate[j] ? 0 : 1);
                diagonal = row[j + 1];
                row[j + 1] = std::min({substituted, row[j] + 1, row[j + 1] + 1});
            }
        }
        if (row.back() < best) {
            best = row.back();
            nearest = candidate;
        }
    }
    return nearest.empty() ? std::string() : "; did you mean '" + std::string(nearest) + "'?";
}

namespace {

/// Length of the UTF-8 sequence that starts at `at`, or 0 when there is none.
std::size_t utf8_length(std::string_view text, std::size_t at) {
    const auto byte = [&](std::size_t i) {
        return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
    };
    const unsigned first = byte(at);
    const bool overlong = first == 0xc0 || first == 0xc1,
               control = first == 0xc2 && byte(at + 1) < 0xa0;
    const std::size_t n = first < 0x80          ? 1
                          : overlong || control ? 0
                          : first >> 5 == 6     ? 2
                          : first >> 4 == 14    ? 3
                          : first >> 3 == 30    ? 4
                                                : 0;
    for (std::size_t k = 1; k < n; ++k)
        if (byte(at + k) >> 6 != 2)
            return 0;
    return n;
}

/// `text` with its middle replaced by dots: at most `head` bytes before them, `tail` behind.
std::string without_middle(std::string_view text, std::size_t head, std::size_t tail) {
    const auto continues = [&](std::size_t at) {
        return (static_cast<unsigned char>(text[at]) & 0xc0) == 0x80;
    };
    std::size_t behind = text.size() - tail;
    while (head > 0 && continues(head))
        --head;
    while (behind < text.size() && continues(behind))
        ++behind;
    return std::string(text.substr(0, head)) + "..." + std::string(text.substr(behind));
}

} // namespace

std::string printable(std::string_view text, std::size_t max_length) {
    static constexpr char kHex[] = "0123456789abcdef";
    std::string out;
    std::size_t whole = 0; // up to here bytes belong to a good sequence
    for (std::size_t i = 0; i < std::min(text.size(), max_length); ++i) {
        const char c = text[i];
        const auto u = static_cast<unsigned char>(c);
        if (i >= whole)
            whole = i + utf8_length(text, i);
        if (u < 0x20 || u == 0x7f || i >= whole) {
            out += "\\x";
            out += kHex[u >> 4];
            out += kHex[u & 15];
        } else {
            out += c;
        }
    }
    if (text.size() > max_length)
        out += "...";
    return out;
}

std::string error_line(std::string_view message) {
    constexpr std::size_t kLongestWord = 72, kHead = 170;
    const std::string whole = printable(message, message.size());
    std::string line = "taihu: ";
    const bool too_long = line.size() + whole.size() > kMostErrorBytes;
    for (std::size_t at = 0; at < whole.size();) {
        const std::size_t end = std::min(whole.find(' ', at), whole.size() - 1) + 1;
        const std::string_view word = std::string_view(whole).substr(at, end - at);
        line += too_long && word.size() > kLongestWord ? without_middle(word, 20, kLongestWord - 23)
                                                       : std::string(word);
        at = end;
    }
    if (line.size() > kMostErrorBytes)
        line = without_middle(line, kHead, kMostErrorBytes - kHead - 3);
    return line;
}

} // namespace taihu
