#pragma once
#include <optional>
#include <string>

#include "stats/core/box.h"
#include "vdb_ops/field.h"

namespace taihu {

/// How large a level set will be, and how long it takes to make.
struct SizeEstimate {
    double n_leaves = 0;
    double seconds = 0; ///< of rasterize(), on all processors of this machine
};

/// By sampling at full resolution: which blocks of 64^3 the surface comes near, of up to 2^14
/// spread over the box, and the leaves in up to 256 of those. Standard error below 15 % for
/// surfaces that come near 2 % of the blocks or more; exact where there are fewer blocks.
SizeEstimate estimate_size(const Field& field, const Lattice& lattice);

/// What is made of a level set.
struct MemoryUse {
    double base_leaves = 0; ///< of a level set that is held beside it
    double leaves = 0;      ///< of the level set, before it is cleaned
    bool cleaned = false, meshed = false;

    /// At the peak [bytes], within a factor of two from 100 MB on: 2.4 kB a leaf, as much again for
    /// what is written, 8 kB with cleaning, 70 kB with a mesh and its certificate.
    double bytes() const;
};

/// Memory that this process may still take [bytes]: the least of what the machine has left, of the
/// limit of its control group, of its own limit of address space, and of `asked`, or without that
/// of its own limit of data.
double memory_limit_bytes(std::optional<double> asked = std::nullopt);

/// Whether a solid in this box could need more than the limit at all: no need to estimate if not.
bool may_exceed(const Box& box, double voxel_m, const MemoryUse& use, double limit_bytes);

/// \throws Error unsupported, when it needs more than the limit: `refused: ...`, with what it
///   would need and the voxel size that fits.
void refuse_if_over(const MemoryUse& use, double voxel_m, double limit_bytes);

/// `1.4 GB`.
std::string human_bytes(double bytes);

} // namespace taihu
