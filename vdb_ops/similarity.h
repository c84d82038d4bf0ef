#pragma once
#include <array>

#include "stats/core/box.h"
#include "stats/core/sphere.h"
#include "stats/core/tri_mesh.h"

namespace taihu {

/// w + xi + yj + zk; of length 1 where it stands for a rotation.
struct Quaternion {
    double w = 1, x = 0, y = 0, z = 0;
    friend constexpr bool operator==(const Quaternion&, const Quaternion&) = default;
};

/// A change of place that keeps shapes: p -> shift + scale * turn(p). Distances are multiplied by
/// scale(), so a solid that is moved needs no sampling again. The default one changes nothing, not
/// even a bit; quarter turns about the axes are exact.
class Similarity {
public:
    Similarity() = default;
    /// \throws Error bad_argument: not finite.
    static Similarity translation(const Vec3& by_m);
    /// About the origin. \throws Error bad_argument: not in 1e-9..1e9.
    static Similarity scaling(double factor);
    /// About an axis through the origin, right-handed. \throws Error bad_argument: an angle that is
    /// not finite, an axis without length.
    static Similarity rotation(const Vec3& axis, double angle_rad);
    /// \param turn  is scaled to length 1. \throws Error bad_argument: no length, or not finite.
    static Similarity rotation(const Quaternion& turn);

    bool is_identity() const { return *this == Similarity(); }
    const Quaternion& turn() const { return turn_; }
    double scale() const { return scale_; }
    const Vec3& shift_m() const { return shift_m_; }
    /// Where the unit vector along X, Y or Z points once turned.
    const Vec3& axis(int i) const { return axes_[static_cast<std::size_t>(i)]; }

    Vec3 direction(const Vec3& v) const; ///< turned only
    Vec3 point(const Vec3& p) const;
    Similarity inverse() const;
    /// First `first`, then `then`. \throws Error bad_argument: scale or shift overflow.
    friend Similarity operator*(const Similarity& then, const Similarity& first);
    friend bool operator==(const Similarity&, const Similarity&) = default;

private:
    Similarity(const Quaternion& turn, double scale, const Vec3& shift_m);

    Quaternion turn_;
    double scale_ = 1;
    Vec3 shift_m_;
    std::array<Vec3, 3> axes_{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
};

/// What a similarity makes of plain values. A box becomes the box of its turned self.
Box placed(const Box& box, const Similarity& at);
Sphere placed(const Sphere& sphere, const Similarity& at);
TriMesh placed(TriMesh mesh, const Similarity& at);

} // namespace taihu
