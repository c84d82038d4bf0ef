#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "stats/core/vec3.h"

namespace taihu {

// Noise in space: a number at every point, a function of the point and the seed alone, whatever
// lattice asks for it. Integers and IEEE + - * / sqrt but for weights, which take a power.

/// The band of a fractal noise, and what pulls it long.
struct NoiseSettings {
    double largest_m = 0.25; ///< wavelength of the coarsest octave, 1e-9..1e6
    double smallest_m =
        0.02;            ///< of the finest, at least; at most `largest_m`, at least 2^-16 of it
    double hurst = 0.8;  ///< amplitudes go with wavelength^H, 0.05..2
    Vec3 along{0, 1, 0}; ///< a direction that it is stretched along
    double stretch = 1;  ///< by so much, 0.01..100
    std::uint64_t seed = 0;

    friend bool operator==(const NoiseSettings&, const NoiseSettings&) = default;
};

/// \throws Error bad_argument: the setting out of range, named after `where`.
void check_noise(const NoiseSettings& settings, const std::string& where);

/// Octaves of gradient noise, each of half the wavelength of the one before, on a cubic lattice
/// that is turned and shifted at random, so that no direction shows. Between its smallest and its
/// largest wavelength the variogram of a transect goes with lag^2H (second differences up to H
/// = 1.5 and above: it is smooth below the smallest). Source: gradient noise with the quintic of
/// Perlin 2002, Improving noise, from memory; gradients uniform in a cube, sums and weights are
/// ours.
class FractalNoise {
public:
    static constexpr double kMost = 4; ///< values are held to so many times the rms

    /// \param least_m  octaves of shorter waves are left out, and the rest stays what it is: for
    /// lattices that cannot show them.
    /// \throws Error bad_argument as check_noise().
    explicit FractalNoise(const NoiseSettings& settings, double least_m = 0);

    /// Mean 0 and rms 1 over space, in -4..4.
    double at(const Vec3& p) const { return at(p, hurst_); }
    /// The same octaves with amplitudes of another exponent: what varies with the place.
    double at(const Vec3& p, double hurst) const;
    /// 1 along winding sheets where the octaves pass through 0, falling to 0 away from them; mean
    /// about 0.2.
    double ridged(const Vec3& p) const;

private:
    struct Octave {
        std::array<Vec3, 3> row; ///< turned, stretched and divided by the wavelength
        Vec3 shift;
        std::uint32_t key = 0;
        bool shown = true;
        double value(const Vec3& p) const;
    };
    std::vector<Octave> octaves_;
    double hurst_;
};

/// Cells of random points, one in each cube of a lattice: facets and the cracks between them.
/// Source: Worley 1996, A cellular texture basis function, from memory.
class CellNoise {
public:
    struct Cell {
        double nearest = 0, second = 0; ///< distances to the two nearest points [cell sizes]
        double facet = 0; ///< a plane of its own in each cell, through its point: slopes up to 1,
                          ///< level within 0.5, in -2..2 [cell sizes]
    };
    /// \param settings  a cell is as large as `largest_m`; no octaves.
    /// \throws Error bad_argument as check_noise().
    explicit CellNoise(const NoiseSettings& settings);
    Cell at(const Vec3& p) const;

private:
    std::array<Vec3, 3> row_;
    Vec3 shift_;
    std::uint32_t key_;
};

/// A profile across beds, by height along a direction: level in each bed, a step to the next.
class BedNoise {
public:
    /// \param settings  a bed is `largest_m` thick on average, along `along`; no octaves.
    explicit BedNoise(const NoiseSettings& settings);
    /// -0.5..0.5 in the beds, up to 0.35 deeper in the joints between them.
    double at(const Vec3& p) const;

private:
    FractalNoise sway_;
    Vec3 along_;
    double thickness_m_;
    std::uint32_t key_;
};

} // namespace taihu
