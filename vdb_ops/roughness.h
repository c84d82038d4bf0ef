#pragma once
#include <optional>
#include <string>
#include <vector>

#include "stats/core/image.h"

namespace taihu {

/// A number with its 95 % interval.
struct Bracketed {
    double value = 0, lo = 0, hi = 0;
};

/// Roughness as a power law: how far a point departs from the mean of the two that are `lag` away
/// on either side, which is what Procedure 1 adds to a midpoint, is departure * (lag / pixel)^H in
/// the root mean square.
struct Roughness {
    Bracketed hurst;                       ///< H; not cut to 0..1
    Bracketed departure_m;                 ///< at a lag of one pixel, as the law says [m]
    int first_lag_px = 0, last_lag_px = 0; ///< what the law was fitted to
    double pixel_m = 0;

    /// Root mean square departure at a lag, by the law [m].
    double departure_at_m(double lag_px) const;
};

/// H and size of the roughness of a height tile: the slope of a straight line through the
/// logarithms of its departures, along rows and columns, at lags of 8, 16, ... pixels up to an
/// eighth of `scale_px`; smaller ones when that is below 256. Departures, unlike plain height
/// differences, do not see what is straight over the tile, and keep the law up to H = 1 and a
/// little above. Intervals by a jackknife over 4 x 4 blocks, and 0.02 for the law, which tiles
/// follow only so well; they know nothing of what is larger than the tile.
///
/// \param heights   1 channel [m], 32 x 32 or more; not looked at across its edges.
/// \param scale_px  the greatest size at which the law is expected, 32 or more [the shorter side];
///                  of a fractal of many patches, one of them.
/// \throws Error bad_argument: too small, another number of channels; numeric: it is flat.
/// Source: the second differences of Istas and Lang 1997, Quadratic variations and estimation of
/// the local Hoelder index, from memory; weights and lags are ours, by trial.
Roughness fit_roughness(const Image& heights, double pixel_m, std::optional<int> scale_px = {});

struct PhotoRoughnessSettings {
    double pixel_m = 1e-3;                  ///< side of a pixel on the stone, > 0
    double elevation_deg = 45;              ///< of the light above the stone's mean plane, 5..85
    std::optional<double> azimuth_deg = {}; ///< where it comes from, as DistantLight; or estimated
    double ambient_share = 0;               ///< of the mean brightness, not from that light, 0..0.9
};

/// What a photograph says of the roughness of a stone.
struct PhotoRoughness {
    Roughness roughness;
    double azimuth_deg = 0;   ///< as given; or estimated, 0..180: which of the two sides is unknown
    double one_sidedness = 0; ///< contrast along the light / across it: 3 or so; 1 without any
    double clipped_share = 0; ///< of the pixels, black or white
    std::vector<std::string> doubts; ///< which of the assumptions the picture speaks against
};

/// H and size of a stone's roughness from the light and shade of a photograph of it.
///
/// Assumes one kind of stone of even colour, matt (Lambert), seen from straight above, lit by one
/// distant light, its slopes small enough that brightness is linear in them and little lies in
/// shadow, the roughness the same in all directions. Brightness over its mean, less 1, then is the
/// slope towards the light over the tangent of its elevation; its sums along the light are heights,
/// to which the law is fitted as in fit_roughness(), blurred over two pixels as a camera does. An
/// even gradient of brightness is taken off first. The size, unlike H, is proportional to pixel_m
/// and to the tangent of the light's elevation. Intervals include 0.06 of H and 10 % of the size
/// for what blur and steep slopes do; not that an assumption fails.
///
/// \param photo  linear light, 1 to 4 channels (alpha is left out), 96 x 96 or more.
/// \throws Error bad_argument: a setting out of range, too small; numeric: it is even or partly
///         dark, or a fifth of it is black or white.
/// Source: the linear term of Lambert's law; own derivation.
PhotoRoughness photo_roughness(const Image& photo, const PhotoRoughnessSettings& settings = {});

/// The part of an image from x, y on. \throws Error bad_argument: not inside.
Image image_part(const Image& image, int x, int y, int width, int height);

} // namespace taihu
