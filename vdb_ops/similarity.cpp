#include "vdb_ops/similarity.h"

#include <cmath>
#include <string>

#include "stats/core/error.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

constexpr double kLeastScale = 1e-9, kMostScale = 1e9;

[[noreturn]] void refuse(const std::string& what) {
    throw Error(Fault::bad_argument, "transform: " + what);
}

Quaternion product(const Quaternion& a, const Quaternion& b) {
    return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
            a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
            a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

/// What rounding left of 0 and 1: quarter turns stay exact.
double cleaned(double v) {
    constexpr double kTiny = 1e-15;
    if (std::fabs(v) < kTiny)
        return 0;
    return std::fabs(std::fabs(v) - 1) < kTiny ? std::copysign(1.0, v) : v;
}

std::array<Vec3, 3> axes_of(const Quaternion& q) {
    std::array<Vec3, 3> axes = {{{1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y + q.w * q.z),
                                  2 * (q.x * q.z - q.w * q.y)},
                                 {2 * (q.x * q.y - q.w * q.z), 1 - 2 * (q.x * q.x + q.z * q.z),
                                  2 * (q.y * q.z + q.w * q.x)},
                                 {2 * (q.x * q.z + q.w * q.y), 2 * (q.y * q.z - q.w * q.x),
                                  1 - 2 * (q.x * q.x + q.y * q.y)}}};
    for (Vec3& axis : axes)
        axis = {cleaned(axis.x), cleaned(axis.y), cleaned(axis.z)};
    return axes;
}

} // namespace

Similarity::Similarity(const Quaternion& turn, double scale, const Vec3& shift_m)
    : turn_(turn), scale_(scale), shift_m_(shift_m), axes_(axes_of(turn)) {
    if (!(scale > 0) || !std::isfinite(scale) || !is_finite(shift_m))
        refuse("scales and shifts together leave the numbers there are; use moderate ones");
}

Similarity Similarity::translation(const Vec3& by_m) {
    if (!is_finite(by_m))
        refuse("the shift is not finite; give three finite lengths");
    return {{}, 1, by_m};
}

Similarity Similarity::scaling(double factor) {
    if (!(factor >= kLeastScale && factor <= kMostScale))
        refuse("scale is " + shortest(factor) +
               ", must be 1e-9..1e9; choose a scale in that range");
    return {{}, factor, {}};
}

Similarity Similarity::rotation(const Vec3& axis, double angle_rad) {
    const double size = length(axis);
    if (!(size > 0) || !std::isfinite(size))
        refuse("the axis of the rotation has no finite length; give a vector along it");
    if (!std::isfinite(angle_rad))
        refuse("the angle is " + shortest(angle_rad) + ", must be finite; give it in radians");
    const double s = std::sin(angle_rad / 2);
    const Vec3 v = axis / size * s;
    return rotation(Quaternion{std::cos(angle_rad / 2), v.x, v.y, v.z});
}

Similarity Similarity::rotation(const Quaternion& q) {
    const double size = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    if (!(size > 0) || !std::isfinite(size))
        refuse("the quaternion of the rotation has no finite length; give w, x, y, z not all 0");
    return {{q.w / size, q.x / size, q.y / size, q.z / size}, 1, {}};
}

Vec3 Similarity::direction(const Vec3& v) const {
    return axes_[0] * v.x + axes_[1] * v.y + axes_[2] * v.z;
}

Vec3 Similarity::point(const Vec3& p) const {
    return is_identity() ? p : direction(p) * scale_ + shift_m_; // 0 * y + ... would lose -0
}

Similarity Similarity::inverse() const {
    if (is_identity())
        return *this;
    Similarity back(Quaternion{turn_.w, -turn_.x, -turn_.y, -turn_.z}, 1 / scale_, {});
    back.shift_m_ = -(back.direction(shift_m_) * back.scale_);
    return back;
}

Similarity operator*(const Similarity& then, const Similarity& first) {
    if (then.is_identity())
        return first;
    if (first.is_identity())
        return then;
    const Quaternion turn =
        Similarity::rotation(product(then.turn_, first.turn_)).turn_; // length 1 again
    return {turn, then.scale_ * first.scale_, then.point(first.shift_m_)};
}

Box placed(const Box& box, const Similarity& at) {
    if (box.empty() || at.is_identity())
        return box;
    const Vec3 half = box.size() * (0.5 * at.scale()), center = at.point(box.center());
    Vec3 reach;
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k)
            reach[i] += std::fabs(at.axis(k)[i]) * half[k];
    return {center - reach, center + reach};
}

Sphere placed(const Sphere& sphere, const Similarity& at) {
    return {at.point(sphere.center), sphere.radius_m * at.scale()};
}

TriMesh placed(TriMesh mesh, const Similarity& at) {
    for (Vec3& p : mesh.positions)
        p = at.point(p);
    if (!at.is_identity())
        for (Vec3& n : mesh.normals)
            n = at.direction(n);
    return mesh;
}

} // namespace taihu
