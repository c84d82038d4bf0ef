#pragma once
#include <functional>
#include <set>
#include <string>

#include "stats/core/rng.h"
#include "stats/core/vec3.h"

namespace taihu {

/// A recipe at random, and the distance that its tree of formulas has at a point: evaluated in
/// double, point by point, with no grid, no pruning and no code of the fields but the primitives'.
struct RandomRecipe {
    std::string text;                              ///< a recipe, about 2 m across
    std::function<double(const Vec3&)> distance_m; ///< of its solid
    std::set<std::string> kinds;                   ///< of the nodes in it
    bool awkward = false; ///< surfaces that touch, coincide, or are finer than a voxel
};

/// Recipe number `seed`: up to four operators deep. One in five is awkward.
/// \param voxel_m  what awkward recipes refer to.
RandomRecipe random_recipe(std::uint64_t seed, double voxel_m);

} // namespace taihu
