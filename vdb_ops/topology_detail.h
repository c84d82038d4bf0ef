#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "vdb_ops/dense_detail.h"

namespace taihu {

/// Which neighbours hang together: 6 over faces, 26 over edges and corners too.
enum class Adjacency { faces, corners };

/// The pieces in which the samples marked by 1 hang together, numbered as they are met.
class Pieces {
public:
    Pieces(const DenseLattice& lattice, std::span<const std::uint8_t> marked, Adjacency adjacency);

    struct Run {
        std::int32_t begin = 0, end = 0; ///< samples of a row along z
        std::uint32_t piece = 0;
    };

    std::size_t size() const { return n_samples_.size(); }
    std::uint64_t n_samples(std::uint32_t piece) const { return n_samples_[piece]; }
    /// Of row y of plane x.
    std::span<const Run> row(int x, int y) const {
        const std::size_t r = static_cast<std::size_t>(x) * ny_ + static_cast<std::size_t>(y);
        return {runs_.data() + first_[r], first_[r + 1] - first_[r]};
    }
    /// The piece of a marked sample.
    std::uint32_t at(int x, int y, int z) const;

private:
    std::uint32_t root(std::uint32_t run);
    void join_rows(std::size_t a, std::size_t b, int reach);

    std::size_t ny_ = 0;
    std::vector<std::size_t> first_; // run of each row
    std::vector<Run> runs_;
    std::vector<std::uint32_t> parent_;
    std::vector<std::uint64_t> n_samples_;
};

/// Euler characteristic of the marked samples.
struct EulerNumbers {
    std::int64_t faces = 0;   ///< as points that hang together over faces
    std::int64_t corners = 0; ///< as closed cubes: over corners too
};

/// Nothing may be marked on the sides of the lattice. Time O(samples).
EulerNumbers euler_numbers(const DenseLattice& lattice, std::span<const std::uint8_t> marked);

/// Handles of the marked samples, adjacent over corners, their complement over faces:
/// pieces + cavities - Euler characteristic.
std::int64_t n_handles(const DenseLattice& lattice, std::span<const std::uint8_t> marked);

} // namespace taihu
