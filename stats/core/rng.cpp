#include "stats/core/rng.h"

#include <Random123/philox.h>

namespace taihu {

std::array<std::uint32_t, 4> Rng::words(std::uint64_t item, std::uint32_t draw) const {
    const r123::Philox4x32::ctr_type counter = {
        {static_cast<std::uint32_t>(item), static_cast<std::uint32_t>(item >> 32), draw, stream}};
    const r123::Philox4x32::key_type key = {
        {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)}};
    const auto r = r123::Philox4x32{}(counter, key);
    return {r[0], r[1], r[2], r[3]};
}

double Rng::uniform(std::uint64_t item, std::uint32_t draw) const {
    const auto w = words(item, draw);
    const std::uint64_t bits = (std::uint64_t{w[0]} << 32 | w[1]) >> 12;
    return (static_cast<double>(bits) + 0.5) * 0x1p-52; // 52 bits, so that the half never rounds
}

} // namespace taihu
