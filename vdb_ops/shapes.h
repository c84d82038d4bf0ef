#pragma once
#include <cstdint>
#include <memory>
#include <string_view>

#include "stats/core/tri_mesh.h"
#include "vdb_ops/field.h"
#include "vdb_ops/fractal_rock.h"
#include "vdb_ops/similarity.h"

namespace taihu {

enum class ShapeKind {
    sphere,
    ellipsoid,
    box,
    rounded_box,
    cylinder,
    capsule,
    torus,
    superquadric,
    icosphere,
    boulder,
    fractal_rock
};

/// The kind that `name` names, words joined by _ or -. \throws Error bad_argument with the nearest
/// known name.
ShapeKind shape_kind(std::string_view name);
std::string_view shape_name(ShapeKind kind);

/// A base shape, centred on the origin. A kind reads the settings that name it, and size_m.
struct ShapeSettings {
    ShapeKind kind = ShapeKind::boulder;
    Vec3 size_m{1, 1, 1}; ///< extents along X, Y, Z [m], each > 0
    double round_m = 0.2; ///< rounded_box: radius of its edges [m], > 0, <= half of each size
    double tube_m = 0.25; ///< torus: thickness of the ring [m], > 0, < half of the outer diameter
    double vertical = 1;  ///< superquadric: exponent of upright sections, 0.1 (box) .. 2 (double
                          ///< cone, octahedron); 1 is round
    double around = 1;    ///< superquadric: exponent of level sections, 0.1..2
    int subdivisions = 5; ///< round meshes: icosphere level, 20 * 4^n triangles, 0..8
    double relief = 0.35; ///< boulder: height of its lumps, as a share of the radius, 0..0.9
    double lumps = 1.7;   ///< boulder: lumps per radius, 0.1..16
    FractalSettings fractal = {}; ///< fractal_rock
    std::uint64_t seed = 0;       ///< boulder, fractal_rock
};

/// The shape as a closed, outward triangle mesh. Sphere and ellipsoid are icospheres; other round
/// kinds have 2 * 2^subdivisions sides (8 at least); the boulder is an icosphere whose radius is 1
/// + relief * noise(direction * lumps), five octaves of value noise, fitted into size_m; the
/// fractal rock is an icosahedron refined by FractalRefiner, fitted into size_m. The same
/// settings give the same bytes on every platform, but for the last bit of pow, cos and sin in
/// rounded_box, cylinder, capsule, torus and superquadric.
/// \throws Error bad_argument naming the setting and its range.
TriMesh shape_mesh(const ShapeSettings& settings);

/// Moved and stretched until its box has this size and the origin in its middle.
TriMesh fitted(TriMesh mesh, const Vec3& size_m);

/// The box of the shape; the height of a torus is its tube, whatever size_m.y says.
Box shape_box(const ShapeSettings& settings);

/// The shape as a field, in its place: exact distances, of the mesh for icosphere, boulder and
/// fractal rock, of a mesh fine enough for the lattice for superquadric (SuperquadricField).
std::unique_ptr<Field> shape_field(const ShapeSettings& settings, const Similarity& at = {});

} // namespace taihu
