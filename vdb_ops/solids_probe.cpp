#include <algorithm>
#include <array>
#include <cmath>

#include "vdb_ops/probe_detail.h"
#include "vdb_ops/solid_kernels_detail.h"
#include "vdb_ops/solids_field.h"

namespace taihu {
namespace {

using Kind = VoxelSolid::Kind;
using Value = FieldProbe::Value;

const Lattice kMetres{1, {}, 3};

Vec3 sign_of(const Vec3& v) {
    return {v.x < 0 ? -1.0 : 1.0, v.y < 0 ? -1.0 : 1.0, v.z < 0 ? -1.0 : 1.0};
}

/// A unit vector along one axis.
Vec3 along(int axis, double sign) {
    Vec3 v;
    v[axis] = sign;
    return v;
}

/// From the axis +Y, of length 1 but on it.
Vec3 outwards(const Vec3& q) {
    return normalized(Vec3{q.x, 0, q.z});
}

/// Distance from a box about the origin, or from one whose edges are rounded.
Value box_value(const Vec3& q, const Vec3& half, double round) {
    const Vec3 sign = sign_of(q);
    const Vec3 in{std::fabs(q.x) - half.x, std::fabs(q.y) - half.y, std::fabs(q.z) - half.z};
    const Vec3 out = max(in, Vec3{});
    if (const double d = length(out); d > 0)
        return {d - round, Vec3{sign.x * out.x, sign.y * out.y, sign.z * out.z} / d};
    const int axis = in.x >= in.y && in.x >= in.z ? 0 : in.y >= in.z ? 1 : 2;
    return {in[axis] - round, along(axis, sign[axis])};
}

/// Of the ellipsoid with these semi axes, and its exact distance from q.
Vec3 ellipsoid_normal(const Vec3& q, const Vec3& axes, double distance) {
    Vec3 n;
    Vec3 on = q; // the nearest point, by a few steps: they converge where |distance| is small
    for (int i = 0; i < 4; ++i) {
        n = normalized(
            Vec3{on.x / (axes.x * axes.x), on.y / (axes.y * axes.y), on.z / (axes.z * axes.z)});
        on = q - n * distance;
    }
    return n;
}

/// The slant of a cone, as an infinite cone.
Value slant_value(const Vec3& q, const double* size) {
    const double run = size[1] - size[0], rise = 2 * size[2], l = std::hypot(run, rise);
    const double rho = std::hypot(q.x, q.z);
    const Vec3 out = outwards(q) * (rise / l);
    return {((rho - size[1]) * rise - (q.y - size[2]) * run) / l, {out.x, -run / l, out.z}};
}

Value cap_value(const Vec3& q, double half, bool top) {
    return {top ? q.y - half : -half - q.y, along(1, top ? 1 : -1)};
}

/// One solid in metres, face by face.
class FacedSolid {
public:
    explicit FacedSolid(const AnalyticSolid& solid) : s_(solid, kMetres) {}

    static Primitive n_faces(const VoxelSolid& s) {
        const bool sharp = s.round == 0;
        return s.kind == Kind::box && sharp                                  ? 6
               : (s.kind == Kind::cylinder && sharp) || s.kind == Kind::cone ? 3
                                                                             : 1;
    }

    const VoxelSolid& solid() const { return s_; }
    double distance(const Vec3& p) const {
        const double point[3] = {p.x, p.y, p.z};
        return solid_distance(s_, point);
    }

    /// The face that decides at a point.
    Primitive face(const Vec3& p) const {
        const Primitive n = n_faces(s_);
        const Vec3 q = local(p);
        Primitive best = 0;
        double most = -1e300;
        for (Primitive f = 0; f < n && n > 1; ++f)
            if (const double d = face_value(f, q).value_m; d > most) {
                most = d;
                best = f;
            }
        return best;
    }

    Value of(Primitive face, const Vec3& p) const { return turned(face_value(face, local(p))); }
    /// The distance and its gradient, past edges, too.
    Value slope(const Vec3& p, double step_m) const {
        const double* a = s_.size;
        if (s_.kind == Kind::box)
            return turned(box_value(local(p), {a[0], a[1], a[2]}, s_.round));
        if (s_.kind == Kind::cylinder)
            return turned(round_cylinder_value(local(p)));
        if (s_.kind == Kind::cone) {
            const auto value = [this](const Vec3& q) { return distance(q); };
            return {value(p), gradient_of(value, p, step_m)};
        }
        return of(0, p);
    }

    std::optional<Sphere> ball() const {
        if (s_.kind != Kind::ball)
            return std::nullopt;
        return Sphere{center(), s_.size[0]};
    }

private:
    Vec3 center() const { return {s_.center[0], s_.center[1], s_.center[2]}; }
    Vec3 local(const Vec3& p) const {
        const Vec3 q = p - center();
        Vec3 out;
        for (int k = 0; k < 3; ++k)
            out[k] = s_.turn[k][0] * q.x + s_.turn[k][1] * q.y + s_.turn[k][2] * q.z;
        return out;
    }

    Value turned(Value v) const {
        Vec3 world;
        for (int k = 0; k < 3; ++k)
            world += Vec3{s_.turn[k][0], s_.turn[k][1], s_.turn[k][2]} * v.gradient[k];
        v.gradient = world;
        return v;
    }
    /// A rounded rectangle, turned about the axis.
    Value round_cylinder_value(const Vec3& q) const {
        const double rho = std::hypot(q.x, q.z);
        const Value v = box_value({rho, q.y, 0}, {s_.size[0], s_.size[1], 1}, s_.round);
        const Vec3 out = outwards(q) * v.gradient.x;
        return {v.value_m, {out.x, v.gradient.y, out.z}};
    }

    Value face_value(Primitive face, const Vec3& q) const {
        const double* a = s_.size;
        switch (s_.kind) {
        case Kind::ball:
            return {length(q) - a[0], normalized(q)};
        case Kind::ellipsoid: {
            const Vec3 axes = Vec3{a[0], a[1], a[2]} * a[3];
            const double d = unturned_distance(q);
            return {d, ellipsoid_normal(q, axes, d)};
        }
        case Kind::box: {
            if (s_.round > 0)
                return box_value(q, {a[0], a[1], a[2]}, s_.round);
            const int axis = static_cast<int>(face / 2);
            const double sign = face % 2 == 0 ? 1 : -1;
            return {sign * q[axis] - a[axis], along(axis, sign)};
        }
        case Kind::cylinder: {
            if (s_.round > 0)
                return round_cylinder_value(q);
            return face == 0 ? Value{std::hypot(q.x, q.z) - a[0], outwards(q)}
                             : cap_value(q, a[1], face == 1);
        }
        case Kind::cone:
            return face == 0 ? slant_value(q, a) : cap_value(q, a[2], face == 1);
        case Kind::capsule: {
            const Vec3 d{q.x, q.y - std::clamp(q.y, -a[1], a[1]), q.z};
            return {length(d) - a[0], normalized(d)};
        }
        case Kind::torus: {
            const Vec3 d = q - outwards(q) * a[0];
            return {length(d) - a[1], normalized(d)};
        }
        case Kind::half_space:
            break;
        }
        return {q.y, {0, 1, 0}};
    }

    double unturned_distance(const Vec3& q) const {
        Vec3 p = center();
        for (int k = 0; k < 3; ++k)
            p += Vec3{s_.turn[k][0], s_.turn[k][1], s_.turn[k][2]} * q[k];
        return distance(p);
    }

    VoxelSolid s_;
};

/// Which solids come near which cells.
class SolidCells {
public:
    SolidCells(const std::vector<FacedSolid>& solids, const Box& region, double reach_m)
        : cube_(region, 2 * reach_m, kMostDepth), reach_m_(reach_m), first_(cube_.size() + 1, 0),
          inside_(cube_.size(), 0) {
        std::vector<std::pair<std::uint32_t, std::uint32_t>> found; // (cell, solid)
        for (std::uint32_t i = 0; i < solids.size(); ++i)
            descend(solids[i], i, cube_.depth(), 0, 0, 0, found);
        for (const auto& [cell, i] : found)
            ++first_[cell + 1];
        for (std::size_t c = 0; c < cube_.size(); ++c)
            first_[c + 1] += first_[c];
        listed_.resize(found.size());
        std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
        for (const auto& [cell, i] : found)
            listed_[next[cell]++] = i;
    }

    bool inside(std::size_t cell) const { return inside_[cell] != 0; }
    std::size_t cell(const Vec3& p) const { return cube_.cell(p); }
    std::span<const std::uint32_t> near(std::size_t cell) const {
        return {listed_.data() + first_[cell], listed_.data() + first_[cell + 1]};
    }

private:
    static constexpr int kMostDepth = 6;

    void descend(const FacedSolid& solid, std::uint32_t i, int level, int x, int y, int z,
                 std::vector<std::pair<std::uint32_t, std::uint32_t>>& found) {
        const int n = 1 << level;
        const double size = cube_.cell_m() * n;
        const Vec3 middle =
            cube_.origin() +
            Vec3{x * n + 0.5 * n, y * n + 0.5 * n, z * n + 0.5 * n} * cube_.cell_m();
        const double d = solid.distance(middle);
        const double reach = reach_m_ + size * std::sqrt(0.75);
        if (d > reach)
            return;
        if (d < -reach) {
            for (int a = x * n; a < (x + 1) * n; ++a)
                for (int b = y * n; b < (y + 1) * n; ++b)
                    std::fill_n(inside_.begin() +
                                    static_cast<std::ptrdiff_t>(cube_.index(a, b, z * n)),
                                n, 1);
        } else if (level == 0) {
            found.emplace_back(static_cast<std::uint32_t>(cube_.index(x, y, z)), i);
        } else {
            for (int k = 0; k < 8; ++k)
                descend(solid, i, level - 1, 2 * x + (k >> 2), 2 * y + (k >> 1 & 1),
                        2 * z + (k & 1), found);
        }
    }

    CellCube cube_;
    double reach_m_;
    std::vector<std::uint32_t> first_, listed_; // solids of cell c: listed_[first_[c]..first_[c+1])
    std::vector<char> inside_;
};

std::vector<FacedSolid> faced(const std::vector<AnalyticSolid>& solids) {
    std::vector<FacedSolid> out;
    out.reserve(solids.size());
    for (const AnalyticSolid& s : solids)
        out.emplace_back(s);
    return out;
}

class SolidsProbe final : public FieldProbe {
public:
    SolidsProbe(const std::vector<AnalyticSolid>& solids, const std::vector<Primitive>& first,
                const Box& region, double reach_m)
        : first_(first), reach_m_(reach_m), solids_(faced(solids)),
          cells_(solids_, region, reach_m) {}

    Nearest at(const Vec3& p) const override {
        const auto [least, best] = nearest(p);
        return {least, best ? first_[*best] + solids_[*best].face(p) : 0};
    }
    Value slope(const Vec3& p, double step_m) const override {
        const auto [least, best] = nearest(p);
        return best ? solids_[*best].slope(p, step_m) : Value{least, {}};
    }
    Value of(Primitive primitive, const Vec3& p) const override {
        const std::size_t i = owner(primitive);
        return solids_[i].of(primitive - first_[i], p);
    }
    void near(const Vec3& p, double reach_m, std::vector<Primitive>& out) const override {
        for (const std::uint32_t i : cells_.near(cells_.cell(p)))
            if (std::fabs(solids_[i].distance(p)) <= reach_m)
                for (Primitive k = first_[i]; k < first_[i + 1]; ++k)
                    if (std::fabs(solids_[i].of(k - first_[i], p).value_m) <= reach_m)
                        out.push_back(k);
    }
    std::optional<Sphere> ball(Primitive primitive) const override {
        return solids_[owner(primitive)].ball();
    }

private:
    /// The distance, as far as the probe reaches, and the solid it is of.
    std::pair<double, const std::uint32_t*> nearest(const Vec3& p) const {
        const std::size_t cell = cells_.cell(p);
        if (cells_.inside(cell))
            return {-reach_m_, nullptr};
        std::pair<double, const std::uint32_t*> best{reach_m_, nullptr};
        for (const std::uint32_t& i : cells_.near(cell))
            if (const double d = solids_[i].distance(p); d < best.first)
                best = {d, &i};
        return best;
    }
    std::size_t owner(Primitive primitive) const {
        return static_cast<std::size_t>(std::upper_bound(first_.begin(), first_.end(), primitive) -
                                        first_.begin() - 1);
    }

    const std::vector<Primitive>& first_;
    double reach_m_;
    std::vector<FacedSolid> solids_;
    SolidCells cells_;
};

} // namespace

SolidsField::SolidsField(std::vector<AnalyticSolid> solids) : solids_(std::move(solids)) {
    first_.push_back(0);
    for (std::size_t i = 0; i < solids_.size(); ++i) {
        check_solid(solids_[i], "solids[" + std::to_string(i) + "]");
        first_.push_back(first_.back() + FacedSolid::n_faces(VoxelSolid(solids_[i], kMetres)));
    }
}

std::unique_ptr<FieldProbe> SolidsField::probe(const Box& region_m, double reach_m) const {
    return std::make_unique<SolidsProbe>(solids_, first_, region_m, reach_m);
}

} // namespace taihu
