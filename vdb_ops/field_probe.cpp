#include "vdb_ops/field_probe.h"

#include <algorithm>
#include <cmath>

#include "vdb_ops/probe_detail.h"

namespace taihu {

FieldProbe::Value FieldProbe::slope(const Vec3& p, double step_m) const {
    const auto value = [this](const Vec3& q) { return at(q).value_m; };
    return {value(p), gradient_of(value, p, step_m)};
}

bool PrimitiveSet::has(Primitive p) const {
    return std::find(ids_.begin(), ids_.begin() + static_cast<std::ptrdiff_t>(size_), p) !=
           ids_.begin() + static_cast<std::ptrdiff_t>(size_);
}

bool PrimitiveSet::add(Primitive p) {
    if (has(p))
        return true;
    if (size_ == kMost)
        return false;
    std::size_t at = size_++;
    for (; at > 0 && ids_[at - 1] > p; --at)
        ids_[at] = ids_[at - 1];
    ids_[at] = p;
    return true;
}

bool PrimitiveSet::within(const PrimitiveSet& other) const {
    const auto mine = all();
    return std::all_of(mine.begin(), mine.end(), [&](Primitive p) { return other.has(p); });
}

PrimitiveSet PrimitiveSet::common(const PrimitiveSet& other) const {
    PrimitiveSet both;
    for (const Primitive p : all())
        if (other.has(p))
            both.add(p);
    return both;
}

namespace {

// Surfaces whose normals are within 2 degrees of each other meet nowhere in particular.
constexpr double kLeastSine2 = 1e-3, kLeastVolume = 0.03;

struct Sampled {
    std::array<FieldProbe::Value, PrimitiveSet::kMost> of;
    double most = 0; ///< the greatest |value|
};

Sampled sample(const FieldProbe& field, const PrimitiveSet& set, const Vec3& p) {
    Sampled s;
    for (std::size_t i = 0; i < set.size(); ++i) {
        s.of[i] = field.of(set[i], p);
        s.most = std::max(s.most, std::fabs(s.of[i].value_m));
        // As distances: then steps and angles mean something.
        const double slope = length(s.of[i].gradient);
        if (slope > 0) {
            s.of[i].gradient = s.of[i].gradient / slope;
            s.of[i].value_m /= slope;
        }
    }
    return s;
}

/// The shortest step onto the tangent planes.
std::optional<Vec3> step(const Sampled& s, std::size_t n) {
    const auto& a = s.of[0];
    const auto& b = s.of[1];
    const auto& c = s.of[2];
    if (n == 1)
        return a.gradient * -a.value_m;
    if (n == 2) {
        const double cosine = dot(a.gradient, b.gradient), sine2 = 1 - cosine * cosine;
        if (sine2 < kLeastSine2)
            return std::nullopt;
        return (a.gradient * (a.value_m - cosine * b.value_m) +
                b.gradient * (b.value_m - cosine * a.value_m)) *
               (-1 / sine2);
    }
    const Vec3 u = cross(b.gradient, c.gradient), v = cross(c.gradient, a.gradient),
               w = cross(a.gradient, b.gradient);
    const double volume = dot(a.gradient, u);
    if (std::fabs(volume) < kLeastVolume)
        return std::nullopt;
    return (u * a.value_m + v * b.value_m + w * c.value_m) * (-1 / volume);
}

} // namespace

std::optional<Vec3> onto(const FieldProbe& field, const PrimitiveSet& set, const Vec3& p,
                         double farthest_m) {
    constexpr int kSteps = 12;
    const double enough = 1e-6 * farthest_m;
    Vec3 x = p;
    for (int i = 0; i < kSteps; ++i) {
        const Sampled s = sample(field, set, x);
        if (s.most <= enough)
            return x;
        const auto by = step(s, set.size());
        if (!by)
            return std::nullopt;
        x = x + *by;
        if (!(length(x - p) <= farthest_m))
            return std::nullopt;
    }
    return std::nullopt;
}

} // namespace taihu
