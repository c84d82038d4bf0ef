#include "vdb_ops/superquadric_field.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/mesh_field.h"
#include "vdb_ops/octant_mesh_detail.h"

namespace taihu {
namespace {

constexpr double kTolerance_vox = 0.02, kTolerance_rel = 1e-6;
constexpr int kLeastCells = 8, kMostCells = 512;

/// An upper bound of the distance from a point of the positive octant inside to the surface: the
/// shortest of the ways along the axes.
double depth(const Superquadric& s, const Vec3& p) {
    const Vec3& a = s.semi_axes_m;
    const auto power = [](double base, double e) { return std::pow(std::max(base, 0.0), e); };
    const double x = power(p.x / a.x, 2 / s.around), z = power(p.z / a.z, 2 / s.around);
    const double level = power(1 - power(p.y / a.y, 2 / s.vertical), s.vertical / s.around);
    const double up = a.y * power(1 - power(x + z, s.around / s.vertical), s.vertical / 2);
    return std::min({up - p.y, a.x * power(level - z, s.around / 2) - p.x,
                     a.z * power(level - x, s.around / 2) - p.z});
}

/// How deep the faces of a mesh of n x n cells cut into the solid.
double deepest_cut(const Superquadric& shape, int n) {
    const TriMesh mesh = superquadric_mesh(shape, n);
    double deepest = 0;
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]];
        const Vec3 middle = (a + b + c) / 3;
        if (middle.x < 0 || middle.y < 0 || middle.z < 0)
            continue; // the other octants are its mirror images
        for (const Vec3& p : {middle, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5})
            deepest = std::max(deepest, depth(shape, p));
    }
    return deepest;
}

/// A field made for one lattice, kept beside what it prepared.
class OwnedLatticeField final : public LatticeField {
public:
    OwnedLatticeField(ClosedMesh mesh, const Lattice& lattice, const openvdb::CoordBBox& region)
        : field_(std::move(mesh)), prepared_(field_.on(lattice, region)) {}
    openvdb::CoordBBox bounds() const override { return prepared_->bounds(); }
    std::unique_ptr<BlockSampler> open(const openvdb::Coord& block, Cover& cover) const override {
        return prepared_->open(block, cover);
    }

private:
    MeshField field_;
    std::unique_ptr<LatticeField> prepared_;
};

/// The formula itself: F(p) = 1, where F is of degree 1 in p and convex, so that
/// (F - 1) / |grad F| is the distance from the tangent plane where the ray to p leaves the solid:
/// 0 on the surface, and outside never more than the distance.
class SuperquadricProbe final : public FieldProbe {
public:
    SuperquadricProbe(const Superquadric& shape, const Similarity& at)
        : shape_(shape), at_(at), back_(at.inverse()) {}

    Nearest at(const Vec3& p) const override { return {of(0, p).value_m, 0}; }
    Value of(Primitive, const Vec3& p) const override {
        const Vec3 q = back_.point(p);
        const Vec3& a = shape_.semi_axes_m;
        const double level = 2 / shape_.around, up = 2 / shape_.vertical;
        // Relative to the largest, so that no power overflows.
        const Vec3 u{std::fabs(q.x) / a.x, std::fabs(q.y) / a.y, std::fabs(q.z) / a.z};
        const double m = std::max({u.x, u.y, u.z, 1e-9});
        const double px = std::pow(u.x / m, level), pz = std::pow(u.z / m, level);
        const double r = std::pow(px + pz, 1 / level), pr = std::pow(r, up),
                     py = std::pow(u.y / m, up);
        const double f = std::pow(pr + py, 1 / up);
        // dF/du_i, by the chain rule; powers of 0 are left out.
        const auto part = [&](double power, double base) { return base > 0 ? power / base : 0.0; };
        const double outer = std::pow(f, 1 - up),
                     ring = part(pr, r) * outer * std::pow(r, 1 - level);
        Vec3 g{ring * part(px, u.x / m) / a.x, outer * part(py, u.y / m) / a.y,
               ring * part(pz, u.z / m) / a.z};
        if (r == 0)
            g.x = g.z = 0;
        for (int axis = 0; axis < 3; ++axis)
            g[axis] = std::copysign(g[axis], q[axis]);
        const double slope = length(g);
        return {(f * m - 1) / slope * at_.scale(), at_.direction(g / slope)};
    }
    void near(const Vec3&, double, std::vector<Primitive>& out) const override { out.push_back(0); }
    std::optional<Sphere> ball(Primitive) const override { return std::nullopt; }

private:
    Superquadric shape_;
    Similarity at_, back_;
};

} // namespace

void check_superquadric(const Superquadric& s, const std::string& where) {
    const auto check = [&](const char* name, double value, double lo, double hi) {
        if (!(value >= lo && value <= hi))
            throw Error(Fault::bad_argument, where + "." + name + " is " + shortest(value) +
                                                 ", must be " + shortest(lo) + ".." + shortest(hi) +
                                                 "; choose a value in that range");
    };
    for (int axis = 0; axis < 3; ++axis)
        check("semi_axes_m", s.semi_axes_m[axis], 1e-12, 1e12);
    check("vertical", s.vertical, 0.1, 2);
    check("around", s.around, 0.1, 2);
}

TriMesh superquadric_mesh(const Superquadric& s, int n) {
    const Quarter up(n, s.vertical), across(n, s.around);
    return octant_mesh(n, [&](const Vec3& sign, int lat, int lon) {
        const auto i = static_cast<std::size_t>(lat), j = static_cast<std::size_t>(lon);
        return Vec3{sign.x * s.semi_axes_m.x * up.cos[i] * across.cos[j],
                    sign.y * s.semi_axes_m.y * up.sin[i],
                    sign.z * s.semi_axes_m.z * up.cos[i] * across.sin[j]};
    });
}

SuperquadricField::SuperquadricField(const Superquadric& shape, const Similarity& at)
    : shape_(shape), at_(at) {
    check_superquadric(shape, "superquadric");
}

std::unique_ptr<LatticeField> SuperquadricField::on(const Lattice& lattice,
                                                    const openvdb::CoordBBox& region) const {
    const Vec3& a = shape_.semi_axes_m;
    const double allowed = std::max(kTolerance_vox * lattice.voxel_m / at_.scale(),
                                    kTolerance_rel * std::max({a.x, a.y, a.z}));
    int n = kLeastCells;
    while (n < kMostCells && deepest_cut(shape_, n) > allowed)
        n *= 2;
    ClosedMesh mesh =
        close_mesh(placed(superquadric_mesh(shape_, n), at_), "superquadric", CloseRule::none);
    return std::make_unique<OwnedLatticeField>(std::move(mesh), lattice, region);
}

std::unique_ptr<FieldProbe> SuperquadricField::probe(const Box&, double) const {
    return std::make_unique<SuperquadricProbe>(shape_, at_);
}

} // namespace taihu
