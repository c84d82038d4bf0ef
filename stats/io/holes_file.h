#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "stats/core/sphere.h"

namespace taihu {

/// Centres and radii of holes are within this: farther off, a unit is wrong.
inline constexpr double kMostHole_m = 1e9;

/// Balls to remove, from a table with the header `x_m,y_m,z_m,radius_m`; `diameter_m` may stand in
/// place of `radius_m`, and the columns in any order. Lines that begin with `#` are comments.
/// \throws Error io: as read_file; bad_input: an unknown, missing or repeated column, a cell that
///         is no finite number, a radius that is not > 0, either beyond kMostHole_m, each with its
///         line; more than 1 GiB.
std::vector<Sphere> read_holes(const std::filesystem::path& path);

/// The same as text: each number the shortest that reads back exactly.
/// \param comments  lines to stand above the header, without the `#`; one with a line break in it
///                  becomes several.
/// \throws Error bad_argument: holes[i] is none that read_holes() would take.
std::string format_holes(std::span<const Sphere> holes, std::span<const std::string> comments = {});

} // namespace taihu
