#include "vdb_ops/solids.h"

#include <cmath>
#include <limits>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/solid_kernels_detail.h"

namespace taihu {
namespace {

using Kind = VoxelSolid::Kind;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMost_m = 1e12;

template <class... Fns>
struct Overloaded : Fns... {
    using Fns::operator()...;
};
template <class... Fns> // clang 14 does not deduce it by itself
Overloaded(Fns...) -> Overloaded<Fns...>;

/// Checks the lengths of one solid.
struct Checker {
    const std::string& where;

    void range(const char* name, double value, double lo, double hi) const {
        if (!(value >= lo && value <= hi))
            throw Error(Fault::bad_argument, where + "." + name + " is " + shortest(value) +
                                                 ", must be " + shortest(lo) + ".." + shortest(hi) +
                                                 "; choose a length in that range");
    }
    void positive(const char* name, double value) const {
        if (!(value > 0 && value <= kMost_m))
            throw Error(Fault::bad_argument, where + "." + name + " is " + shortest(value) +
                                                 ", must be > 0 and at most 1e12; fix the length");
    }
    void positive(const char* name, const Vec3& v) const {
        for (int axis = 0; axis < 3; ++axis)
            positive(name, v[axis]);
    }

    void operator()(const BallSolid& s) const { positive("radius_m", s.radius_m); }
    void operator()(const EllipsoidSolid& s) const { positive("semi_axes_m", s.semi_axes_m); }
    void operator()(const BoxSolid& s) const {
        positive("half_size_m", s.half_size_m);
        const Vec3& h = s.half_size_m;
        range("round_m", s.round_m, 0, std::min({h.x, h.y, h.z}));
    }
    void operator()(const CylinderSolid& s) const {
        positive("radius_m", s.radius_m);
        positive("half_height_m", s.half_height_m);
        range("round_m", s.round_m, 0, std::min(s.radius_m, s.half_height_m));
    }
    void operator()(const ConeSolid& s) const {
        range("bottom_radius_m", s.bottom_radius_m, 0, kMost_m);
        range("top_radius_m", s.top_radius_m, 0, kMost_m);
        positive("bottom_radius_m and top_radius_m", s.bottom_radius_m + s.top_radius_m);
        positive("half_height_m", s.half_height_m);
    }
    void operator()(const CapsuleSolid& s) const {
        positive("radius_m", s.radius_m);
        range("half_length_m", s.half_length_m, 0, kMost_m);
    }
    void operator()(const TorusSolid& s) const {
        positive("ring_m", s.ring_m);
        range("tube_m", s.tube_m, std::numeric_limits<double>::min(), s.ring_m);
    }
    void operator()(const HalfSpaceSolid&) const {}
};

/// Support function: how far a solid about the origin reaches along the unit vector `n`.
double reach(const PrimitiveSolid& shape, const Vec3& n) {
    const double around = std::hypot(n.x, n.z), up = std::fabs(n.y);
    return std::visit(
        Overloaded{[](const BallSolid& s) { return s.radius_m; },
                   [&](const EllipsoidSolid& s) {
                       const Vec3& a = s.semi_axes_m;
                       return length(Vec3{a.x * n.x, a.y * n.y, a.z * n.z});
                   },
                   [&](const BoxSolid& s) {
                       const Vec3 core = s.half_size_m - Vec3{s.round_m, s.round_m, s.round_m};
                       return core.x * std::fabs(n.x) + core.y * up + core.z * std::fabs(n.z) +
                              s.round_m;
                   },
                   [&](const CylinderSolid& s) {
                       return (s.radius_m - s.round_m) * around +
                              (s.half_height_m - s.round_m) * up + s.round_m;
                   },
                   [&](const ConeSolid& s) {
                       return std::max(s.top_radius_m * around + s.half_height_m * n.y,
                                       s.bottom_radius_m * around - s.half_height_m * n.y);
                   },
                   [&](const CapsuleSolid& s) { return s.half_length_m * up + s.radius_m; },
                   [&](const TorusSolid& s) { return s.ring_m * around + s.tube_m; },
                   [](const HalfSpaceSolid&) { return kInfinity; }},
        shape);
}

} // namespace

void check_solid(const AnalyticSolid& solid, const std::string& where) {
    std::visit(Checker{where}, solid.shape);
}

Box bounds(const AnalyticSolid& solid) {
    const Similarity back = solid.at.inverse();
    const Vec3 center = solid.at.shift_m();
    Box box;
    for (int axis = 0; axis < 3; ++axis) {
        Vec3 n;
        n[axis] = 1;
        n = back.direction(n);
        box.lo[axis] = center[axis] - reach(solid.shape, -n) * solid.at.scale();
        box.hi[axis] = center[axis] + reach(solid.shape, n) * solid.at.scale();
    }
    return box;
}

double distance_m(const AnalyticSolid& solid, const Vec3& p) {
    const double point[3] = {p.x, p.y, p.z};
    return solid_distance(VoxelSolid(solid, {1, {}, 3}), point);
}

VoxelSolid::VoxelSolid(const AnalyticSolid& solid, const Lattice& lattice) {
    const double unit = solid.at.scale() / lattice.voxel_m;
    const Vec3 middle = (solid.at.shift_m() - lattice.origin) / lattice.voxel_m;
    const Box box = bounds(solid);
    for (int k = 0; k < 3; ++k) {
        center[k] = middle[k];
        lo[k] = (box.lo[k] - lattice.origin[k]) / lattice.voxel_m;
        hi[k] = (box.hi[k] - lattice.origin[k]) / lattice.voxel_m;
        for (int c = 0; c < 3; ++c)
            turn[k][c] = solid.at.axis(k)[c];
    }
    const auto set = [&](Kind k, double a, double b = 0, double c = 0) {
        kind = k;
        size[0] = a * unit;
        size[1] = b * unit;
        size[2] = c * unit;
    };
    const auto ellipsoid = [&](const Vec3& a) {
        const double least = std::min({a.x, a.y, a.z});
        if (least == std::max({a.x, a.y, a.z}))
            return set(Kind::ball, least);
        kind = Kind::ellipsoid;
        for (int k = 0; k < 3; ++k)
            size[k] = a[k] / least;
        size[3] = least * unit;
    };
    std::visit(
        Overloaded{[&](const BallSolid& s) { set(Kind::ball, s.radius_m); },
                   [&](const EllipsoidSolid& s) { ellipsoid(s.semi_axes_m); },
                   [&](const BoxSolid& s) {
                       const Vec3 h = s.half_size_m - Vec3{s.round_m, s.round_m, s.round_m};
                       set(Kind::box, h.x, h.y, h.z);
                       round = s.round_m * unit;
                   },
                   [&](const CylinderSolid& s) {
                       set(Kind::cylinder, s.radius_m - s.round_m, s.half_height_m - s.round_m);
                       round = s.round_m * unit;
                   },
                   [&](const ConeSolid& s) {
                       set(Kind::cone, s.bottom_radius_m, s.top_radius_m, s.half_height_m);
                   },
                   [&](const CapsuleSolid& s) { set(Kind::capsule, s.radius_m, s.half_length_m); },
                   [&](const TorusSolid& s) { set(Kind::torus, s.ring_m, s.tube_m); },
                   [&](const HalfSpaceSolid&) { set(Kind::half_space, 0); }},
        solid.shape);
}

} // namespace taihu
