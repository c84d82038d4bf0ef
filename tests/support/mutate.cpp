#include "tests/support/mutate.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

#include "stats/core/rng.h"

namespace taihu {
namespace {

constexpr std::uint32_t kStream = 0x6d757461;
constexpr std::size_t kMostGrowth = 64 << 10;

/// Whole numbers below a bound, one after the other.
class Draws {
public:
    Draws(std::uint64_t seed, std::uint64_t item) : rng_{seed, kStream}, item_(item) {}

    std::uint64_t word() {
        const auto w = rng_.words(item_, draw_++);
        return std::uint64_t{w[0]} << 32 | w[1];
    }
    /// 0 .. n - 1; the bias of the remainder is of no matter here.
    std::size_t below(std::size_t n) { return n == 0 ? 0 : static_cast<std::size_t>(word() % n); }
    bool one_in(std::size_t n) { return below(n) == 0; }
    /// Mostly small, at most `n`.
    std::size_t length(std::size_t n) {
        return std::min(n, 1 + below(std::size_t{1} << below(12)));
    }

private:
    Rng rng_;
    std::uint64_t item_;
    std::uint32_t draw_ = 0;
};

struct Span {
    std::size_t at, size;
};

Span some_part(Draws& draws, const std::string& bytes) {
    const std::size_t at = draws.below(bytes.size());
    return {at, draws.length(bytes.size() - at)};
}

void flip(Draws& draws, std::string& bytes) {
    for (std::size_t n = 1 + draws.below(8); n > 0 && !bytes.empty(); --n) {
        char& c = bytes[draws.below(bytes.size())];
        c = static_cast<char>(c ^ (1 << draws.below(8)));
    }
}

void replace_bytes(Draws& draws, std::string& bytes) {
    static constexpr char kTelling[] =
        "0123456789 \n\t\r-+./#e\\\"[]{}(),:;nai<>&%\0\x7f\x80\xff\xef"
        "\xbb\xbf";
    for (std::size_t n = draws.length(16); n > 0 && !bytes.empty(); --n)
        bytes[draws.below(bytes.size())] = draws.one_in(2)
                                               ? static_cast<char>(draws.word())
                                               : kTelling[draws.below(sizeof kTelling - 1)];
}

void insert(Draws& draws, std::string& bytes) {
    std::string more(draws.length(4096), '\0');
    const char fill = static_cast<char>(draws.word());
    const bool random = draws.one_in(2);
    for (char& c : more)
        c = random ? static_cast<char>(draws.word()) : fill;
    bytes.insert(draws.below(bytes.size() + 1), more);
}

void repeat(Draws& draws, std::string& bytes) {
    if (bytes.empty())
        return;
    const Span part = some_part(draws, bytes);
    const std::string one = bytes.substr(part.at, part.size);
    std::string more;
    for (std::size_t n = draws.one_in(4) ? 1 + draws.below(1000) : 1; n > 0; --n)
        if (more.size() + one.size() <= kMostGrowth / 8)
            more += one;
    bytes.insert(part.at, more);
}

std::uint64_t telling_number(Draws& draws, std::size_t file_size) {
    const std::array<std::uint64_t, 22> kNumbers = {
        0,
        1,
        2,
        0x7f,
        0x80,
        0xff,
        0x7fff,
        0x8000,
        0xffff,
        0x7fffffff,
        0x80000000,
        0xffffffff,
        0x100000000,
        0x7fffffffffffffff,
        0x8000000000000000,
        0xffffffffffffffff,
        file_size,
        file_size + 1,
        std::bit_cast<std::uint32_t>(std::numeric_limits<float>::quiet_NaN()),
        std::bit_cast<std::uint32_t>(std::numeric_limits<float>::infinity()),
        std::bit_cast<std::uint64_t>(std::numeric_limits<double>::quiet_NaN()),
        std::bit_cast<std::uint64_t>(-std::numeric_limits<double>::infinity())};
    return kNumbers[draws.below(kNumbers.size())];
}

/// \param change  gives a field's new value from the old one.
template <class Change>
void change_field(Draws& draws, std::string& bytes, const Change& change) {
    const std::size_t size = std::size_t{1} << draws.below(4);
    if (bytes.size() < size)
        return;
    std::size_t at = draws.below(bytes.size() - size + 1);
    if (draws.one_in(2)) // most formats align their fields
        at -= at % size;
    if (draws.one_in(4)) // and have them at the beginning
        at = std::min(at % 256, bytes.size() - size);
    const bool big = draws.one_in(4);
    const auto place = [&](std::size_t k) { return at + (big ? size - 1 - k : k); };
    std::uint64_t value = 0;
    for (std::size_t k = size; k-- > 0;)
        value = value << 8 | static_cast<unsigned char>(bytes[place(k)]);
    value = change(value);
    for (std::size_t k = 0; k < size; ++k)
        bytes[place(k)] = static_cast<char>(value >> (8 * k));
}

std::uint64_t moved(Draws& draws, std::uint64_t value) {
    switch (draws.below(4)) {
    case 0:
        return value + 1 + draws.below(16);
    case 1:
        return value - 1 - draws.below(16);
    case 2:
        return value << (1 + draws.below(8));
    default:
        return ~value;
    }
}

bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

void change_number(Draws& draws, std::string& bytes) {
    static constexpr std::string_view kTexts[] = {"nan",
                                                  "inf",
                                                  "-inf",
                                                  "NaN",
                                                  "0",
                                                  "-0",
                                                  "-1",
                                                  "1e-30",
                                                  "1e-320",
                                                  "1e308",
                                                  "1e400",
                                                  "1e30",
                                                  "2",
                                                  "3",
                                                  "255",
                                                  "256",
                                                  "65536",
                                                  "2147483647",
                                                  "2147483648",
                                                  "-2147483649",
                                                  "4294967295",
                                                  "4294967296",
                                                  "9007199254740993",
                                                  "18446744073709551615",
                                                  "99999999999999999999999",
                                                  "",
                                                  "0x10",
                                                  "1,5",
                                                  "1.5",
                                                  "word",
                                                  "null",
                                                  "true",
                                                  "\"3\"",
                                                  "[]",
                                                  "{}",
                                                  "+1"};
    if (bytes.empty())
        return;
    std::size_t at = draws.below(bytes.size());
    while (at < bytes.size() && !is_digit(bytes[at]))
        ++at;
    if (at == bytes.size())
        at = std::min(bytes.size(), bytes.find_first_of("0123456789"));
    while (at > 0 && (is_digit(bytes[at - 1]) || bytes[at - 1] == '.' || bytes[at - 1] == '-'))
        --at;
    std::size_t end = at;
    while (end < bytes.size() && (is_digit(bytes[end]) ||
                                  std::string_view("+-.eE").find(bytes[end]) != std::string::npos))
        ++end;
    bytes.replace(at, end - at, kTexts[draws.below(std::size(kTexts))]);
}

void swap_parts(Draws& draws, std::string& bytes) {
    if (bytes.size() < 2)
        return;
    Span a = some_part(draws, bytes), b = some_part(draws, bytes);
    if (a.at > b.at)
        std::swap(a, b);
    a.size = std::min(a.size, b.at - a.at);
    const std::string first = bytes.substr(a.at, a.size), second = bytes.substr(b.at, b.size);
    bytes.replace(b.at, b.size, first);
    bytes.replace(a.at, a.size, second);
}

void change_line(Draws& draws, std::string& bytes) {
    const std::size_t middle = draws.below(bytes.size() + 1);
    const std::size_t before = bytes.rfind('\n', middle == 0 ? 0 : middle - 1);
    const std::size_t at = before == std::string::npos || middle == 0 ? 0 : before + 1;
    const std::size_t end = std::min(bytes.find('\n', at), bytes.size() - 1) + 1;
    const std::string line = bytes.substr(at, end - at);
    if (!draws.one_in(3))
        bytes.erase(at, line.size());
    if (!draws.one_in(2)) {
        const std::size_t other = bytes.find('\n', draws.below(bytes.size() + 1));
        bytes.insert(other == std::string::npos ? 0 : other + 1, line);
    }
}

void splice(Draws& draws, std::string& bytes, const std::string& other) {
    const std::size_t head = draws.below(bytes.size() + 1), tail = draws.below(other.size() + 1);
    bytes = bytes.substr(0, head) + other.substr(tail);
}

void damage(Draws& draws, Damage how, std::span<const std::string> bases, std::string& bytes) {
    switch (how) {
    case Damage::flip:
        return flip(draws, bytes);
    case Damage::bytes:
        return replace_bytes(draws, bytes);
    case Damage::cut:
        return bytes.resize(draws.below(bytes.size() + 1));
    case Damage::remove:
        if (!bytes.empty()) {
            const Span part = some_part(draws, bytes);
            bytes.erase(part.at, part.size);
        }
        return;
    case Damage::insert:
        return insert(draws, bytes);
    case Damage::repeat:
        return repeat(draws, bytes);
    case Damage::count: {
        const std::uint64_t value = telling_number(draws, bytes.size());
        return change_field(draws, bytes, [&](std::uint64_t) { return value; });
    }
    case Damage::offset:
        return change_field(draws, bytes, [&](std::uint64_t was) { return moved(draws, was); });
    case Damage::number:
        return change_number(draws, bytes);
    case Damage::swap:
        return swap_parts(draws, bytes);
    case Damage::line:
        if (!bytes.empty())
            change_line(draws, bytes);
        return;
    case Damage::splice:
        return splice(draws, bytes, bases[draws.below(bases.size())]);
    }
}

} // namespace

Mutant mutate(std::span<const std::string> bases, std::uint64_t seed, std::uint64_t item) {
    Draws draws(seed, item);
    Mutant mutant{bases[draws.below(bases.size())], {}};
    std::size_t n = 1;
    while (n < 8 && draws.one_in(2))
        ++n;
    while (mutant.damages.size() < n) {
        mutant.damages.push_back(static_cast<Damage>(draws.below(kDamages)));
        damage(draws, mutant.damages.back(), bases, mutant.bytes);
    }
    // Some damages double what they find.
    std::size_t longest = 0;
    for (const std::string& base : bases)
        longest = std::max(longest, base.size());
    mutant.bytes.resize(std::min(mutant.bytes.size(), 2 * longest + kMostGrowth));
    return mutant;
}

} // namespace taihu
