#pragma once
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "vdb_ops/dense_detail.h"

namespace taihu {

/// What a share of a volume has: a diameter in samples, and the number of samples that have it.
using SizeCounts = std::vector<std::pair<float, std::uint64_t>>;

/// Radius of the largest ball round a place within a sample of `i`, and where: along 13 directions,
/// the distances on both sides of a ridge are drawn on as straight lines until they meet.
struct RidgeBall {
    float x = 0, y = 0, z = 0, radius = 0; ///< [samples]
};
RidgeBall ridge_ball(const DenseLattice& lattice, std::span<const float> distances, int x, int y,
                     int z);

/// Local thickness: for each sample where `distances` are negative, the diameter of the greatest
/// ball in that region which contains it. By rising diameter.
/// Along a slab exact but for the distances' own error; on the axis of a rod and at the middle of a
/// ball low by up to 0.5 samples. The same on any number of threads. Time O(samples + sum of
/// squared radii over the medial surface), 32 bytes for each sample of that surface. \param
/// distances  signed_distances(); two samples along each side of the lattice are positive Source:
/// the definition is Hildebrand & Ruegsegger 1997 (from memory); painting balls by falling radius,
/// rows of samples that are left in a linked list: own.
SizeCounts local_thickness(const DenseLattice& lattice, std::span<const float> distances,
                           Progress* progress);

} // namespace taihu
