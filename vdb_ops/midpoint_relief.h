#pragma once
#include <cstdint>
#include <vector>

#include "stats/core/image.h"
#include "stats/core/progress.h"

namespace taihu {

/// How the height of a midpoint leaves the mean of its neighbours.
enum class MidpointLaw {
    free,   ///< f_M = (f_R + f_L) / 2 + g S(n): broken rock, unglazed china
    between ///< f_M = (f_R + f_L) / 2 + |f_R - f_L| g S(n): never above or below both; castings
};

/// What g is drawn from; both have mean 0 and variance 1/12.
enum class MidpointDraws {
    uniform, ///< on -0.5..0.5: rougher to the eye, the choice of the text
    gaussian ///< as mountains are made; not for MidpointLaw::between
};

struct MidpointSettings {
    MidpointLaw law = MidpointLaw::free;
    MidpointDraws draws = MidpointDraws::uniform;
    double hurst = 0.5;     ///< the self-similarity parameter h of S(n) = 2^(-n h), 0..2
    double amplitude_m = 1; ///< S(0) [m], 0..1e6; the corners of a casting differ by up to it
    int patches = 1;        ///< along each side, 1..4096
    int levels = 9;         ///< stages of halving, 0..13; patches * 2^levels is at most 8192
    bool tileable = false;  ///< the right edge continues at the left, the bottom at the top
    std::uint64_t seed = 0;
    /// Heights of the corners of the patches [m], row by row: (patches + 1)^2 numbers, or patches^2
    /// when tileable; empty: uniform within amplitude_m / 2 of 0.
    std::vector<double> corners_m = {};
};

/// Heights [m] of a square lattice by repeated halving of its patches: 1 channel, patches *
/// 2^levels + 1 points a side, one less when tileable (the next would repeat the first).
///
/// In stage n = 0, 1, ... the midpoint of every edge of a square leaves the mean of the two ends
/// by g S(n), and the centre leaves the mean of the four corners of the square by another; each
/// square then is four. g belongs to a stage and a place in it: neighbours share the midpoints of
/// their edges, and more levels do not change the points there were. For MidpointLaw::between, the
/// centre may leave the mean m of its corners by 2 min(m - lowest, highest - m) g S(n), with S(0) =
/// 1, which is the law of edges when there are two corners.
///
/// The same bytes on every machine and any number of threads. Memory 12 bytes a point.
/// \throws Error bad_argument: a setting out of range, another number of corners, Gaussian draws
///         between neighbours; cancelled: within a stage.
/// Source: Tsuruoka et al., Rugged Texture Generation by Stochastic Models, Procedure 1, Eq. 5 to
/// 7, Fig. 3 and 5; the centre of a casting, which they do not give, is ours.
Image midpoint_heights(const MidpointSettings& settings, Progress* progress = nullptr);

} // namespace taihu
