#pragma once
#include <string>
#include <variant>

#include "stats/core/box.h"
#include "vdb_ops/similarity.h"

namespace taihu {

// Solids whose signed distance is known exactly everywhere, centred on the origin, axis +Y.
// Lengths [m], > 0 unless said otherwise. `round_m` rounds the edges within the given size: at
// least 0, at most the smallest half extent.

struct BallSolid {
    double radius_m = 0.5;
};
struct EllipsoidSolid {
    Vec3 semi_axes_m{0.5, 0.5, 0.5};
};
struct BoxSolid {
    Vec3 half_size_m{0.5, 0.5, 0.5};
    double round_m = 0;
};
struct CylinderSolid {
    double radius_m = 0.5, half_height_m = 0.5;
    double round_m = 0;
};
/// A frustum; a radius may be 0, not both.
struct ConeSolid {
    double bottom_radius_m = 0.5, top_radius_m = 0;
    double half_height_m = 0.5;
};
/// All points within the radius of a segment; `half_length_m` >= 0 is that of the segment.
struct CapsuleSolid {
    double radius_m = 0.25, half_length_m = 0.25;
};
/// A ring about the Y axis: a tube of radius `tube_m` round a circle of radius `ring_m` > tube_m.
struct TorusSolid {
    double ring_m = 0.375, tube_m = 0.125;
};
/// Everything below y = 0. It has no bounds: only its intersection with something bounded, or a
/// difference from that, can be rasterized.
struct HalfSpaceSolid {};

using PrimitiveSolid = std::variant<BallSolid, EllipsoidSolid, BoxSolid, CylinderSolid, ConeSolid,
                                    CapsuleSolid, TorusSolid, HalfSpaceSolid>;

struct AnalyticSolid {
    PrimitiveSolid shape;
    Similarity at;
};

/// \throws Error bad_argument: a length out of range, named after `where`.
void check_solid(const AnalyticSolid& solid, const std::string& where);

/// The tight box of the placed solid; of a half space, infinite in all directions.
Box bounds(const AnalyticSolid& solid);

/// Signed distance at a point [m]: exact, but for rounding and 1e-9 of an ellipsoid's size.
double distance_m(const AnalyticSolid& solid, const Vec3& p);

} // namespace taihu
