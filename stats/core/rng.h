#pragma once
#include <array>
#include <cstdint>

namespace taihu {

/// Random numbers addressed by (seed, stream, item, draw): no state, so any thread may ask for any
/// of them in any order. Philox4x32-10 of Random123; the same bytes on every platform.
struct Rng {
    std::uint64_t seed = 0;
    std::uint32_t stream = 0; ///< one per purpose, named where it is used

    /// Four independent 32-bit words.
    std::array<std::uint32_t, 4> words(std::uint64_t item, std::uint32_t draw = 0) const;

    /// Uniform on the open interval (0, 1), 52 bits: never 0, never 1.
    double uniform(std::uint64_t item, std::uint32_t draw = 0) const;
};

} // namespace taihu
