#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace taihu {

/// What may happen to a file on its way.
enum class Damage {
    flip,   ///< some bits turned over
    bytes,  ///< some bytes replaced
    cut,    ///< the end is missing
    remove, ///< a part is missing
    insert, ///< bytes too many
    repeat, ///< a part is there more than once
    count,  ///< a field of 1, 2, 4 or 8 bytes, either way round, holds a telling number
    offset, ///< such a field is a little more or less than it was
    number, ///< a number in text is another, or none
    swap,   ///< two parts have changed places
    line,   ///< a line of text is doubled, gone, or at another place
    splice  ///< the beginning of one file, the end of another
};
inline constexpr int kDamages = 12;

struct Mutant {
    std::string bytes;
    std::vector<Damage> damages; ///< in the order in which they happened, one to eight
};

/// A file damaged at random: number `item` of the stream of `seed`. A function of its arguments
/// alone. Half of all have one damage. At most 64 KiB longer than twice the longest base.
/// \param bases  valid files of one format, one or more, none of them empty.
Mutant mutate(std::span<const std::string> bases, std::uint64_t seed, std::uint64_t item);

} // namespace taihu
