#include "vdb_ops/shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "stats/core/error.h"
#include "stats/core/rng.h"
#include "stats/core/sphere.h"
#include "stats/core/text.h"
#include "stats/number_detail.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/icosphere.h"
#include "vdb_ops/mesh_field.h"
#include "vdb_ops/octant_mesh_detail.h"
#include "vdb_ops/solids_field.h"
#include "vdb_ops/superquadric_field.h"

namespace taihu {
namespace {

constexpr std::array<std::string_view, 11> kNames = {
    "sphere", "ellipsoid",    "box",       "rounded_box", "cylinder",    "capsule",
    "torus",  "superquadric", "icosphere", "boulder",     "fractal_rock"};
constexpr std::uint32_t kNoiseStream = 0x626c6472;

void check_range(const char* name, double value, double lo, double hi) {
    if (!(value >= lo && value <= hi))
        throw Error(Fault::bad_argument, std::string("shape: ") + name + " is " + shortest(value) +
                                             ", must be " + shortest(lo) + ".." + shortest(hi) +
                                             "; choose a value in that range");
}

Superquadric superquadric(const ShapeSettings& s) {
    return {s.size_m * 0.5, s.vertical, s.around};
}

void check_settings(const ShapeSettings& s) {
    check_range("size_m.x", s.size_m.x, 1e-9, 1e9);
    check_range("size_m.y", s.size_m.y, 1e-9, 1e9);
    check_range("size_m.z", s.size_m.z, 1e-9, 1e9);
    check_range("subdivisions", s.subdivisions, 0, 8);
    check_range("relief", s.relief, 0, 0.9);
    check_range("lumps", s.lumps, 0.1, 16);
    const bool round =
        s.kind == ShapeKind::cylinder || s.kind == ShapeKind::torus || s.kind == ShapeKind::capsule;
    if ((round || s.kind == ShapeKind::sphere) && s.size_m.x != s.size_m.z)
        throw Error(Fault::bad_argument, std::string("shape: a ") +
                                             std::string(shape_name(s.kind)) +
                                             " is as wide as it is deep; give equal X and Z sizes");
    if (s.kind == ShapeKind::sphere && s.size_m.x != s.size_m.y)
        throw Error(Fault::bad_argument,
                    "shape: a sphere has one size; give one number, or use ellipsoid");
    if (s.kind == ShapeKind::torus)
        check_range("tube_m", s.tube_m, 1e-9, 0.4999 * s.size_m.x);
    if (s.kind == ShapeKind::capsule && s.size_m.y < s.size_m.x)
        throw Error(Fault::bad_argument, "shape: a capsule is at least as high as it is wide; give "
                                         "a larger Y size, or use ellipsoid");
    if (s.kind == ShapeKind::rounded_box)
        check_range("round_m", s.round_m, 1e-9,
                    0.5 * std::min({s.size_m.x, s.size_m.y, s.size_m.z}));
    if (s.kind == ShapeKind::fractal_rock)
        check_fractal(s.fractal);
    if (s.kind == ShapeKind::superquadric)
        check_superquadric(superquadric(s), "shape");
}

/// Smooth noise in [-1, 1]: uniform values on the unit lattice, blended by 3t^2 - 2t^3.
double value_noise(const Rng& rng, const Vec3& p) {
    const Vec3 cell{std::floor(p.x), std::floor(p.y), std::floor(p.z)};
    const auto at = [&](int dx, int dy, int dz) {
        const auto part = [](double v) {
            return static_cast<std::uint64_t>(static_cast<std::int64_t>(v)) & 0x1fffff;
        };
        return 2 * rng.uniform(part(cell.x + dx) << 42 | part(cell.y + dy) << 21 |
                               part(cell.z + dz)) -
               1;
    };
    const auto ease = [](double t) { return t * t * (3 - 2 * t); };
    const auto mix = [](double a, double b, double t) { return a + (b - a) * t; };
    const double u = ease(p.x - cell.x), v = ease(p.y - cell.y), w = ease(p.z - cell.z);
    return mix(mix(mix(at(0, 0, 0), at(1, 0, 0), u), mix(at(0, 1, 0), at(1, 1, 0), u), v),
               mix(mix(at(0, 0, 1), at(1, 0, 1), u), mix(at(0, 1, 1), at(1, 1, 1), u), v), w);
}

TriMesh boulder(const ShapeSettings& s) {
    TriMesh mesh = icosphere(s.subdivisions);
    for (Vec3& p : mesh.positions) {
        double noise = 0, amplitude = 0.5, frequency = s.lumps;
        for (std::uint32_t octave = 0; octave < 5; ++octave) {
            noise += amplitude * value_noise({s.seed, kNoiseStream + octave}, p * frequency);
            amplitude *= 0.5;
            frequency *= 2.03; // not 2: lattice planes of the octaves must not coincide
        }
        p *= 1 + s.relief * noise;
    }
    return fitted(std::move(mesh), s.size_m);
}

TriMesh box_mesh(const Vec3& half) {
    TriMesh mesh;
    for (int i = 0; i < 8; ++i)
        mesh.positions.push_back(
            {i & 1 ? half.x : -half.x, i & 2 ? half.y : -half.y, i & 4 ? half.z : -half.z});
    mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return mesh;
}

/// Points on the unit circle of the XZ plane. Rotation by repeated exact operations would drift;
/// cos and sin of the platform are good to the last bit but one, which is stated.
Vec3 on_circle(int i, int n) {
    const double angle = 2 * std::numbers::pi * i / n;
    return {std::cos(angle), 0, std::sin(angle)};
}

TriMesh cylinder_mesh(double radius, double half_height, int sides) {
    TriMesh mesh;
    mesh.positions = {{0, -half_height, 0}, {0, half_height, 0}};
    for (int i = 0; i < sides; ++i)
        for (const double y : {-half_height, half_height})
            mesh.positions.push_back(on_circle(i, sides) * radius + Vec3{0, y, 0});
    const auto at = [sides](int i, int top) {
        return static_cast<std::uint32_t>(2 + 2 * (i % sides) + top);
    };
    for (int i = 0; i < sides; ++i) {
        mesh.triangles.push_back({0, at(i, 0), at(i + 1, 0)});
        mesh.triangles.push_back({1, at(i + 1, 1), at(i, 1)});
        mesh.triangles.push_back({at(i, 0), at(i, 1), at(i + 1, 1)});
        mesh.triangles.push_back({at(i, 0), at(i + 1, 1), at(i + 1, 0)});
    }
    return mesh;
}

TriMesh torus_mesh(double ring, double tube, int sides) {
    TriMesh mesh;
    const int around = std::max(8, sides / 2);
    for (int i = 0; i < sides; ++i)
        for (int j = 0; j < around; ++j) {
            const Vec3 out = on_circle(i, sides), c = on_circle(j, around);
            mesh.positions.push_back(out * (ring + tube * c.x) + Vec3{0, tube * c.z, 0});
        }
    const auto at = [=](int i, int j) {
        return static_cast<std::uint32_t>((i % sides) * around + j % around);
    };
    for (int i = 0; i < sides; ++i)
        for (int j = 0; j < around; ++j) {
            mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
            mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
        }
    return mesh;
}

/// All points within `round` of a box of half sizes `core`, which may be flat or a segment.
TriMesh rounded_mesh(const Vec3& core, double round, int n) {
    const Quarter quarter(n, 1);
    return octant_mesh(n, [&](const Vec3& sign, int lat, int lon) {
        const auto i = static_cast<std::size_t>(lat), j = static_cast<std::size_t>(lon);
        const Vec3 out{quarter.cos[i] * quarter.cos[j], quarter.sin[i],
                       quarter.cos[i] * quarter.sin[j]};
        const Vec3 p = core + out * round;
        return Vec3{sign.x * p.x, sign.y * p.y, sign.z * p.z};
    });
}

} // namespace

ShapeKind shape_kind(std::string_view name) {
    std::string joined(name);
    std::replace(joined.begin(), joined.end(), '-', '_');
    for (std::size_t i = 0; i < kNames.size(); ++i)
        if (kNames[i] == joined)
            return static_cast<ShapeKind>(i);
    std::string known;
    for (const std::string_view k : kNames)
        known += (known.empty() ? "" : ", ") + std::string(k);
    throw Error(Fault::bad_argument, "shape: unknown kind '" + printable(name) + "'" +
                                         did_you_mean(name, kNames) + "; known are " + known);
}

std::string_view shape_name(ShapeKind kind) {
    return kNames[static_cast<std::size_t>(kind)];
}

TriMesh fitted(TriMesh mesh, const Vec3& size_m) {
    const Box box = bounds(mesh);
    const Vec3 center = box.center(), size = box.size();
    for (Vec3& p : mesh.positions)
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = (p[axis] - center[axis]) * (size_m[axis] / size[axis]);
    return mesh;
}

Box shape_box(const ShapeSettings& s) {
    Vec3 half = s.size_m * 0.5;
    if (s.kind == ShapeKind::torus)
        half.y = s.tube_m / 2;
    return {-half, half};
}

TriMesh shape_mesh(const ShapeSettings& s) {
    check_settings(s);
    const Vec3 half = s.size_m * 0.5;
    const int sides = std::max(8, 2 << s.subdivisions);
    switch (s.kind) {
    case ShapeKind::box:
        return box_mesh(half);
    case ShapeKind::rounded_box:
        return rounded_mesh(half - Vec3{s.round_m, s.round_m, s.round_m}, s.round_m, sides / 4);
    case ShapeKind::cylinder:
        return cylinder_mesh(half.x, half.y, sides);
    case ShapeKind::capsule:
        return rounded_mesh({0, half.y - half.x, 0}, half.x, sides / 4);
    case ShapeKind::torus:
        return torus_mesh(half.x - s.tube_m / 2, s.tube_m / 2, sides);
    case ShapeKind::superquadric:
        return superquadric_mesh(superquadric(s), sides / 4);
    case ShapeKind::boulder:
        return boulder(s);
    case ShapeKind::fractal_rock:
        return fitted(fractal_rock(s.fractal, s.seed), s.size_m);
    case ShapeKind::sphere:
    case ShapeKind::ellipsoid:
    case ShapeKind::icosphere:
        break;
    }
    TriMesh mesh = icosphere(s.subdivisions);
    for (Vec3& p : mesh.positions)
        p = {p.x * half.x, p.y * half.y, p.z * half.z};
    return mesh;
}

std::unique_ptr<Field> shape_field(const ShapeSettings& s, const Similarity& at) {
    check_settings(s);
    const Vec3 half = s.size_m * 0.5;
    const auto exact = [&at](const PrimitiveSolid& shape) {
        return std::make_unique<SolidsField>(std::vector<AnalyticSolid>{{shape, at}});
    };
    switch (s.kind) {
    case ShapeKind::sphere:
        return std::make_unique<BallsField>(std::array<Sphere, 1>{placed(Sphere{{}, half.x}, at)});
    case ShapeKind::ellipsoid:
        return exact(EllipsoidSolid{half});
    case ShapeKind::box:
        return exact(BoxSolid{half});
    case ShapeKind::rounded_box:
        return exact(BoxSolid{half, s.round_m});
    case ShapeKind::cylinder:
        return exact(CylinderSolid{half.x, half.y});
    case ShapeKind::capsule:
        return exact(CapsuleSolid{half.x, half.y - half.x});
    case ShapeKind::torus:
        return exact(TorusSolid{half.x - s.tube_m / 2, s.tube_m / 2});
    case ShapeKind::superquadric:
        return std::make_unique<SuperquadricField>(superquadric(s), at);
    case ShapeKind::icosphere:
    case ShapeKind::boulder:
    case ShapeKind::fractal_rock:
        break;
    }
    return std::make_unique<MeshField>(
        close_mesh(placed(shape_mesh(s), at), std::string(shape_name(s.kind)), {CloseRule::none}));
}

} // namespace taihu
