#pragma once
#include <algorithm>
#include <cmath>

#include "stats/core/image.h"
#include "stats/core/vec3.h"

namespace taihu {

/// How a surface answers light: R = diffuse I_d + specular I_s + C_a. With both weights 1 it is the
/// equation of the text; a weight of 0 leaves a term out, as its unglazed china and castings do.
struct Reflection {
    double ambient = 0.2; ///< C_a, >= 0
    double diffuse = 1;   ///< weight of I_d, >= 0
    double specular = 1;  ///< weight of I_s, >= 0
    double exponent = 20; ///< n of I_s, 0.. : the higher, the smaller the highlight
};

// Unit vectors: N the surface's normal, L towards the light, V towards the viewer.
// Source: Tsuruoka et al., Rugged Texture Generation by Stochastic Models, Eq. 1 to 4.

/// Eq. 2, Lambert's cosine law: N L, but 0 below the horizon.
inline double diffuse_intensity(const Vec3& normal, const Vec3& light) {
    return std::max(0.0, dot(normal, light));
}

/// Eq. 3: (H N)^n, but 0 for H N < 0; H is the unit vector half-way between L and V.
inline double specular_intensity(const Vec3& normal, const Vec3& light, const Vec3& viewer,
                                 double exponent) {
    const double cosine = dot(normalized(light + viewer), normal);
    return cosine < 0 ? 0 : std::pow(cosine, exponent);
}

/// Eq. 1 with Eq. 4: the intensity of a point.
inline double intensity(const Reflection& r, const Vec3& normal, const Vec3& light,
                        const Vec3& viewer) {
    return r.diffuse * diffuse_intensity(normal, light) +
           r.specular * specular_intensity(normal, light, viewer, r.exponent) + r.ambient;
}

/// A light far away.
struct DistantLight {
    double azimuth_deg = 135; ///< where it comes from, from +x (right) towards the top of the image
    double elevation_deg = 40; ///< above the plane, > 0..90

    /// Towards the light; x to the right, y to the top of the image, z to the viewer.
    Vec3 direction() const;
};

/// The normal of a height tile in the same axes, by central differences; at the edges one-sided, or
/// across them when it is tileable. Slopes are [m] over pixel_m. \pre 1 channel, 2 x 2 or more.
Vec3 height_normal(const Image& heights, double pixel_m, bool tileable, int x, int y);

/// A height tile seen from straight above: Eq. 1 in every point, 1 channel, linear, not cut at 1.
Image shaded_heights(const Image& heights, double pixel_m, bool tileable,
                     const Reflection& reflection = {}, const DistantLight& light = {});

} // namespace taihu
