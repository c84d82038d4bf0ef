#pragma once
#include <vector>

#include "stats/core/box.h"
#include "stats/core/image.h"
#include "stats/core/tri_mesh.h"

namespace taihu {

/// How a height tile is laid around an object.
enum class ReliefMap {
    planar,   ///< from the front, along -Z, through to the back
    sphere,   ///< by longitude about +Y and latitude, as seen from the frame's middle
    cube,     ///< along the axis that the surface faces most
    cylinder, ///< by longitude about the frame's upright axis, and height
    triplanar ///< along all three axes, weighted by how much the surface faces them: no seams
};

/// A height tile around an object: microscopic texture on a macroscopic shape. The tile keeps its
/// size in metres, but for sphere and cylinder, where it is stretched so that a whole number of
/// tiles goes round; it repeats where it is tileable and is mirrored where not, so that it never
/// jumps. Heights are bilinear between points. Thread-safe.
class ReliefAround {
public:
    /// \param heights  1 channel [m], 2 x 2 or more, finite; the first row is the top.
    /// \param pixel_m  between points, > 0. \param frame  what it is laid around: bounds of a mesh.
    /// \param sharpness  of triplanar: layers weigh as this power of how much the surface faces
    /// them, 1..64.
    /// \throws Error bad_argument: another number of channels, too small, not finite; a frame
    /// without extent or of more than 1e12 pixels; a sharpness out of range.
    ReliefAround(Image heights, double pixel_m, bool tileable, ReliefMap map, const Box& frame,
                 double sharpness = 4);

    /// Where a point of the surface lies in one of the (at most three) layers that cover it.
    struct Place {
        double u_m = 0, v_m = 0; ///< to the right and upwards on the tile, not yet wrapped
        Vec3 along_u, along_v;   ///< gradients of u_m and v_m in space
        double weight = 1;
    };
    std::vector<Place> places(const Vec3& p, const Vec3& normal) const;

    /// [m]. \param normal  unit, of the object at p.
    double height_m(const Vec3& p, const Vec3& normal) const;
    /// The object's normal with the tile's slopes added to it; the point stays where it is.
    /// Source: Blinn's composition, as Tsuruoka et al., Rugged Texture Generation by Stochastic
    /// Models, use it: N minus the gradient of the height in the tangent plane, normalised.
    Vec3 bumped(const Vec3& p, const Vec3& normal) const;
    /// Vertices moved along their normals (or the means of their faces') by the height, and normals
    /// bumped: the silhouette changes, too. Where slopes are steep or the surface bends more than
    /// that, faces may cross.
    TriMesh displaced(const TriMesh& mesh) const;

private:
    struct Sample {
        double height_m = 0, slope_u = 0, slope_v = 0;
    };
    Sample sample(const Place& place) const;
    Vec3 gradient(const Vec3& p, const Vec3& normal) const;
    double at(long column, long row) const;

    Image heights_;
    double pixel_m_;
    bool tileable_;
    ReliefMap map_;
    Vec3 middle_;
    double radius_m_;              ///< of the sphere or the cylinder
    double stretch_u_, stretch_v_; ///< tile metres per metre
    double sharpness_;
};

/// Heights without waves shorter than `least_m`, on the same points: for surfaces that cannot show
/// them. Tents of twice the width each time, until the next would be wider than half of that.
Image without_short_waves(const Image& heights, double pixel_m, bool tileable, double least_m);

} // namespace taihu
