#pragma once
#include <cstdint>
#include <set>
#include <string>

namespace taihu {

/// A recipe at random with operators of every kind, those without a formula for their distance,
/// too. Never empty: a ball is part of it.
struct RandomSolid {
    std::string text;
    std::set<std::string> kinds; ///< of the nodes in it
    bool awkward = false; ///< surfaces that touch, coincide, or are finer than a voxel: one in five
};

/// Recipe number `seed`, a small one: `voxel_m` is a good part of its 2 m.
RandomSolid random_solid(std::uint64_t seed, double voxel_m);

} // namespace taihu
