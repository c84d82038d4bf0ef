#pragma once
#include <limits>

#include "stats/core/vec3.h"

namespace taihu {

/// An axis-aligned box; the default one is empty and grows by include().
struct Box {
    Vec3 lo{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
            std::numeric_limits<double>::infinity()};
    Vec3 hi{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
            -std::numeric_limits<double>::infinity()};

    friend constexpr bool operator==(const Box&, const Box&) = default;

    bool empty() const { return !(lo.x <= hi.x && lo.y <= hi.y && lo.z <= hi.z); }
    Vec3 size() const { return empty() ? Vec3{} : hi - lo; }
    Vec3 center() const { return (lo + hi) * 0.5; }
    double longest() const { return std::max({size().x, size().y, size().z}); }
    double volume() const { return size().x * size().y * size().z; }
    bool contains(const Vec3& p) const {
        return p.x >= lo.x && p.y >= lo.y && p.z >= lo.z && p.x <= hi.x && p.y <= hi.y &&
               p.z <= hi.z;
    }
    void include(const Vec3& p) {
        lo = min(lo, p);
        hi = max(hi, p);
    }
    /// The box grown by `margin` on every side.
    Box dilated(double margin) const {
        const Vec3 m{margin, margin, margin};
        return {lo - m, hi + m};
    }
};

} // namespace taihu
