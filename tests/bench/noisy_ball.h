#pragma once
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "stats/core/rng.h"
#include "vdb_ops/analytic_field.h"

namespace taihu {

/// A ball with eight smooth waves on it, about 256 across times `size / 256`; distances of first
/// order, gradients in closed form.
class NoisyBall final : public Field {
public:
    explicit NoisyBall(double size) : r_(0.44 * size), sampled_(box(size), distances()) {
        constexpr std::array<double, 8> kHeight = {.07, .06, .04, .03, .02, .015, .01, .008},
                                        kWaves = {1.5, 2, 3, 3.5, 5, 6, 8, 9};
        for (std::size_t i = 0; i < 8; ++i) {
            const auto u = [i](std::uint32_t draw) { return Rng{7, 1}.uniform(i, draw); };
            const double c = 2 * u(0) - 1, s = std::sqrt(1 - c * c),
                         t = 2 * std::numbers::pi * u(1);
            k_[i] = Vec3{s * std::cos(t), s * std::sin(t), c} * (kWaves[i] / r_);
            phase_[i] = 2 * std::numbers::pi * u(2);
            height_[i] = kHeight[i] * r_;
        }
    }
    std::unique_ptr<LatticeField> on(const Lattice& l,
                                     const openvdb::CoordBBox& region) const override {
        return sampled_.on(l, region);
    }
    Primitive n_primitives() const override { return 1; }
    std::unique_ptr<FieldProbe> probe(const Box&, double) const override {
        return std::make_unique<Probe>(*this);
    }

private:
    struct Probe final : FieldProbe {
        const NoisyBall& of_;
        explicit Probe(const NoisyBall& of) : of_(of) {}
        Nearest at(const Vec3& p) const override { return {of_.value(p).value_m, 0}; }
        Value of(Primitive, const Vec3& p) const override { return of_.value(p); }
        void near(const Vec3&, double, std::vector<Primitive>& out) const override {
            out.push_back(0);
        }
        std::optional<Sphere> ball(Primitive) const override { return std::nullopt; }
    };

    static Box box(double size) {
        const double h = 0.62 * size;
        return {{-h, -h, -h}, {h, h, h}};
    }
    AnalyticField::Distances distances() {
        return [this](std::span<const Vec3> points, double* out) {
            for (std::size_t i = 0; i < points.size(); ++i)
                out[i] = cautious(value(points[i]).value_m);
        };
    }
    /// First order distances may be twice the true ones, which would hide the surface from cells.
    static double cautious(double d) {
        return std::fabs(d) < 4 ? d : std::copysign(4 + (std::fabs(d) - 4) / 4, d);
    }
    FieldProbe::Value value(const Vec3& p) const {
        const double l = std::max(length(p), 1e-9);
        double f = l - r_;
        Vec3 g = p / l;
        for (std::size_t i = 0; i < 8; ++i) {
            const double a = dot(k_[i], p) + phase_[i];
            f -= height_[i] * std::sin(a);
            g -= k_[i] * (height_[i] * std::cos(a));
        }
        const double slope = length(g);
        return {f / slope, g / slope};
    }

    double r_;
    std::array<Vec3, 8> k_;
    std::array<double, 8> phase_, height_;
    AnalyticField sampled_;
};

/// Holes of a Boolean model at this porosity in a cube about the origin, diameters exponential;
/// those of a radius below `least` are left out.
inline std::vector<Sphere> exponential_holes(double size, std::uint64_t n, double porosity,
                                             double least) {
    const double mean = std::cbrt(-std::log(1 - porosity) * size * size * size /
                                  (std::numbers::pi * static_cast<double>(n)));
    std::vector<Sphere> holes;
    for (std::uint64_t i = 0; i < n; ++i) {
        const auto u = [i](std::uint32_t draw) { return Rng{1, 2}.uniform(i, draw); };
        const double r = -0.5 * mean * std::log(u(3));
        if (r >= least)
            holes.push_back({Vec3{u(0) - 0.5, u(1) - 0.5, u(2) - 0.5} * size, r});
    }
    return holes;
}

} // namespace taihu
