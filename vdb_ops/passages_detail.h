#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "vdb_ops/dense_detail.h"

namespace taihu {

/// The ways through a solid. Its outline is what a large ball, rolled round it, does not reach.
class Passages {
public:
    /// \param distances  signed_distances() of the solid, at least `outline_radius` along the sides
    /// of the lattice; both must outlive this
    /// \param outline_radius  of the large ball [samples]
    Passages(const DenseLattice& lattice, std::span<const float> distances, float outline_radius,
             const Progress* progress);

    /// What a ball finds that comes from outside.
    struct Opened {
        double open_share = 0;   ///< volume of the outline that it sweeps / volume of the outline
        std::int64_t n_ways = 0; ///< different ways that its centre has through the solid: handles
                                 ///< of all that the centre does not reach
    };
    /// \param radius  of the ball [samples]; 0: whatever hangs together over faces of voxels
    Opened opened(float radius, const Progress* progress) const;

    struct Sealed {
        std::size_t n = 0; ///< voids that nothing reaches from outside
        double share = 0;  ///< their volume / that of the outline
    };
    Sealed sealed() const;

    /// Diameter of the largest ball that rolls, all of it inside the outline, from a mouth that it
    /// reaches in the upper quarter of the solid to one in the lower; 0 when none of two samples
    /// does [samples].
    double channel(const Progress* progress) const;

private:
    std::vector<std::uint8_t> centres(float radius) const;
    std::vector<float> beyond(const std::vector<std::uint8_t>& centres, float radius,
                              const Progress* progress) const;
    bool leads_through(std::span<const std::uint8_t> wide, float radius) const;

    const DenseLattice& lattice_;
    std::span<const float> distances_;
    std::vector<float> depth_;    // below the outline, negative outside
    double n_outline_ = 0;        // samples
    int y_low_ = 0, y_high_ = -1; // of the solid
};

} // namespace taihu
