#pragma once
#include <cstdint>
#include <vector>

#include "stats/core/box.h"
#include "stats/core/image.h"
#include "stats/core/progress.h"
#include "stats/core/tri_mesh.h"

namespace taihu {

/// What lies beyond the border of a map.
enum class MapBorder {
    open, ///< nothing: the last differences are 0
    wrap  ///< the map again
};

/// The two ways to write a bump map, from one to the other. Heights: 1 channel, in any unit.
/// Offsets: 2 channels, by which a normal leans along u (to the right) and v (upwards; the first
/// row of an image is its top) [heights per texel].
///
/// Offsets of a height field are its differences to the next texel to the right and above.
/// \throws Error bad_argument: another channel count, no pixel, a value that is not finite.
/// Source: Deix, "Real-time rendering of fractal rocks", section 6, after Moeller and Haines.
Image bump_offsets(const Image& heights, MapBorder border);

/// The height field with the offsets, its mean 0: exactly that, but for rounding, where they came
/// from one; else the one whose offsets differ least in the mean square. Sums along rows and
/// columns, then conjugate gradients: O(pixels) in the first case, O(pixels * side) in the other.
/// \throws as bump_offsets(); cancelled.
Image bump_heights(const Image& offsets, MapBorder border, Progress* progress = nullptr);

/// Unit normals in the frame of the texture, 3 channels (u, v, out): (-scale u, -scale v, 1),
/// normalised. \param scale  texels per unit of height.
/// \throws as bump_offsets(); a scale that is not finite.
Image bump_normals(const Image& offsets, double scale);

/// Heights of a static bump map, 1 channel of side x side texels, that looks like rock on any model
/// and repeats without a seam: value noise of 8 cells to a side and of octaves of half the size
/// down to two texels, each 2^-hurst of the one before; within -1..1. The same on every platform.
/// \param side  16..8192. \param hurst  0.05..2.
/// \throws Error bad_argument: one out of range.
/// Source: Deix, "Real-time rendering of fractal rocks", section 7, way (1); the noise is ours.
Image static_bump_map(int side, double hurst, std::uint64_t seed);

/// The mesh's normals as a bump map has them, laid around the frame `of` by longitude and latitude
/// (TextureMap::spherical) `repeats` times: n - scale (u-offset along the parallel, v-offset along
/// the meridian), normalised. Positions stay. A vertex on the axis keeps its normal.
/// \param scale  texels per unit of height, as in bump_normals(). \param repeats  >= 1.
/// \throws as bump_offsets() and texture_coordinates(); bad_argument: a mesh without normals.
std::vector<Vec3> bumped_normals(const TriMesh& mesh, const Image& offsets, const Box& of,
                                 double scale, int repeats);

} // namespace taihu
