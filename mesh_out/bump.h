#pragma once
#include "stats/core/image.h"

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
/// \throws as bump_offsets().
Image bump_heights(const Image& offsets, MapBorder border);

/// Unit normals in the frame of the texture, 3 channels (u, v, out): (-scale u, -scale v, 1),
/// normalised. \param scale  texels per unit of height.
/// \throws as bump_offsets(); a scale that is not finite.
Image bump_normals(const Image& offsets, double scale);

} // namespace taihu
