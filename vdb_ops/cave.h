#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "stats/core/progress.h"
#include "vdb_ops/shapes.h"

namespace taihu {

/// A block with a cave in it.
struct CaveSettings {
    Vec3 size_m{1, 1, 1}; ///< of the block, about the origin [m], each > 0
    int n_rocks = 20;     ///< taken away, 1..200
    double room = 0.45;   ///< mean width of a rock / shortest side of the block, 0.05..0.9
    double wall = 0.05;   ///< least thickness of the block's walls / its shortest side, 0..0.4
    FractalSettings fractal{.iterations = 2}; ///< of the rocks
    std::uint64_t seed = 0;
};

/// A fractal rock with its middle at `at_m`.
struct CaveRock {
    ShapeSettings shape;
    Vec3 at_m;
};

/// Rocks at random, concatenated at random: the first half way out of the block's +Z side, which
/// makes the mouth, each later one with its middle well inside an earlier one, so that they hang
/// together. All but the first stay behind the walls. The same on every platform but for the last
/// bit of atan2, which decides nothing near its threshold. O(n_rocks * triangles).
/// Source: Deix, "Real-time rendering of fractal rocks", section 9; the placement is our own.
/// \throws Error bad_argument naming the setting and its range.
std::vector<CaveRock> cave_rocks(const CaveSettings& settings);

/// The block without the rocks, as a recipe node of boxes and fractal rocks; pieces of the block
/// that nothing holds are removed. \throws Error as cave_rocks().
std::string cave_node(const CaveSettings& settings);

/// What is void inside the block.
struct CaveReport {
    std::size_t n_voids = 0; ///< that hang together over faces of voxels; 1: one cave
    double void_share = 0;   ///< of the block's volume
    double mouth_m2 = 0;     ///< open area of the block's sides [m^2]
};

/// On the solid's voxels, on every second one and so on where those are more than 2^25.
/// \throws Error bad_argument: not a level set; bad_input: nothing is inside.
CaveReport measure_cave(const openvdb::FloatGrid& solid, const Vec3& size_m,
                        const Progress* progress = nullptr);

} // namespace taihu
