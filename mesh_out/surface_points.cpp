#include "mesh_out/surface_points_detail.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace taihu {
namespace {

// In voxels.
constexpr double kOnEdge = 1e-4, kOnSurface = 1e-3, kNearEnough = 0.05, kFarthest = 4;
constexpr double kBesideFace = 0.02, kBesideEdge = 0.01,
                 kMostStep = 0.05; // what a tangent is good for
// Normals of one primitive that differ by more than 40 degrees in a cell: it has edges of its own.
constexpr double kSmoothCosine = 0.77;

std::optional<Vec3> solve(const std::array<double, 6>& a, const Vec3& b) {
    const double c0 = a[3] * a[5] - a[4] * a[4], c1 = a[2] * a[4] - a[1] * a[5],
                 c2 = a[1] * a[4] - a[2] * a[3];
    const double det = a[0] * c0 + a[1] * c1 + a[2] * c2;
    if (!(det > 1e-12))
        return std::nullopt;
    const double c3 = a[0] * a[5] - a[2] * a[2], c4 = a[1] * a[2] - a[0] * a[4],
                 c5 = a[0] * a[3] - a[1] * a[1];
    return Vec3{c0 * b.x + c1 * b.y + c2 * b.z, c1 * b.x + c3 * b.y + c4 * b.z,
                c2 * b.x + c4 * b.y + c5 * b.z} /
           det;
}

/// The point nearest to all tangent planes, and a little to their mean.
std::optional<Vec3> nearest_to_planes(std::span<const Crossing> crossings, const Vec3& mean) {
    constexpr double kPull = 0.02;
    std::array<double, 6> a{}; // xx, xy, xz, yy, yz, zz
    Vec3 b;
    for (const Crossing& c : crossings) {
        const Vec3& n = c.normal;
        const double d = dot(n, c.point - mean);
        a[0] += n.x * n.x;
        a[1] += n.x * n.y;
        a[2] += n.x * n.z;
        a[3] += n.y * n.y;
        a[4] += n.y * n.z;
        a[5] += n.z * n.z;
        b += n * d;
    }
    for (const std::size_t i : {0u, 3u, 5u})
        a[i] += kPull * static_cast<double>(crossings.size());
    const auto step = solve(a, b);
    if (!step)
        return std::nullopt;
    return mean + *step;
}

} // namespace

bool is_smooth(std::span<const Crossing> crossings) {
    for (std::size_t i = 0; i < crossings.size(); ++i)
        for (std::size_t k = i + 1; k < crossings.size(); ++k)
            if (crossings[i].primitive == crossings[k].primitive &&
                dot(crossings[i].normal, crossings[k].normal) < kSmoothCosine)
                return false;
    return true;
}

Vec3 held(const Vec3& p, const Box& box) {
    return max(box.lo, min(box.hi, p));
}

Vec3 mean_of(std::span<const Crossing> crossings) {
    Vec3 sum;
    for (const Crossing& c : crossings)
        sum += c.point;
    return sum / static_cast<double>(crossings.size());
}

Crossing SurfacePoints::on_edge(const openvdb::Coord& at, int axis) const {
    // Off the ends of the edge: where the surface passes a voxel all edges there would have one
    // point, and so would cells that know nothing else.
    constexpr double kOff = 0.03;
    Crossing c = found_on_edge(at, axis);
    const double start = voxel(at)[axis], h = lattice_.voxel_m;
    c.point[axis] = std::clamp(c.point[axis], start + kOff * h, start + (1 - kOff) * h);
    return c;
}

Crossing SurfacePoints::found_on_edge(const openvdb::Coord& at, int axis) const {
    openvdb::Coord next = at;
    ++next[axis];
    // Values of the grid to begin with: where a piece went or a bubble was filled the field never
    // gets to 0 between them.
    double f0 = static_cast<double>(accessor_.getValue(at)),
           f1 = static_cast<double>(accessor_.getValue(next));
    const Vec3 p0 = voxel(at);
    Vec3 way;
    way[axis] = lattice_.voxel_m;
    Crossing c;
    c.point = p0 + way * std::clamp(f0 / (f0 - f1), 0.0, 1.0);
    const bool starts_inside = f0 < 0;
    double t0 = 0, t1 = 1;
    for (int i = 0; i < 12; ++i) {
        const double t =
            i % 3 == 2 ? 0.5 * (t0 + t1) : t0 + (t1 - t0) * std::clamp(f0 / (f0 - f1), 0.02, 0.98);
        const Vec3 p = p0 + way * t;
        const FieldProbe::Nearest f = field_.at(p);
        if (std::fabs(f.value_m) <= kBesideEdge * lattice_.voxel_m) {
            // So near, its primitive alone says the rest.
            const FieldProbe::Value v = field_.of(f.primitive, p);
            const double slope = length(v.gradient), by = -v.value_m / v.gradient[axis];
            if (std::fabs(by) <= kMostStep * lattice_.voxel_m && t * lattice_.voxel_m + by >= 0 &&
                t * lattice_.voxel_m + by <= lattice_.voxel_m) {
                c.point[axis] = p[axis] + by;
                return {c.point, v.gradient / slope, f.primitive, true};
            }
            if (std::fabs(f.value_m) <= kOnEdge * lattice_.voxel_m)
                return {p, normalized(v.gradient), f.primitive, true};
        }
        if ((f.value_m < 0) == starts_inside) {
            t0 = t;
            f0 = f.value_m;
        } else {
            t1 = t;
            f1 = f.value_m;
        }
    }
    // Fields that are sampled by way of a mesh are off by a little: the nearer end will do.
    for (const Vec3& p : {p0 + way * t0, p0 + way * t1}) {
        const FieldProbe::Nearest f = field_.at(p);
        if (std::fabs(f.value_m) <= kNearEnough * lattice_.voxel_m)
            return {p, normalized(field_.of(f.primitive, p).gradient), f.primitive, true};
    }
    return c;
}

bool SurfacePoints::is_on(const Vec3& p) const {
    return std::fabs(field_.at(p).value_m) <= kOnSurface * lattice_.voxel_m;
}

LabelledPoint SurfacePoints::on_face(const Vec3& p, const Box& cell) const {
    const FieldProbe::Nearest at = field_.at(p);
    const auto on = onto(field_, PrimitiveSet(at.primitive), p, kFarthest * lattice_.voxel_m);
    const Vec3 inside = on ? held(*on, cell) : p;
    return {inside, label(inside)};
}

LabelledPoint SurfacePoints::place(std::span<const Crossing> crossings, const Box& cell,
                                   double slack_m) const {
    const Vec3 mean = mean_of(crossings);
    PrimitiveSet set;
    bool known = true, all_in = true;
    for (const Crossing& c : crossings) {
        known = known && c.known;
        all_in = set.add(c.primitive) && all_in;
    }
    if (!known)
        return {mean, {}};
    if (set.size() == 1 && !is_smooth(crossings)) {
        if (const auto p = nearest_to_planes(crossings, mean)) {
            const Vec3 in = held(*p, cell);
            if (std::fabs(field_.at(in).value_m) <= 0.1 * lattice_.voxel_m)
                return {in, set};
        }
    } else if (set.size() == 1) {
        if (const auto p = beside(crossings, mean); p && cell.dilated(slack_m).contains(*p))
            return {*p, set};
    }
    if (set.size() == 2 && all_in)
        if (const auto p = between_faces(set, crossings, cell))
            return {*p, set};
    if (all_in)
        if (const auto found = settle(set, mean, cell, slack_m))
            return *found;
    if (const auto found = on_rim(set, mean, cell))
        return *found;
    return on_face(mean, cell);
}

std::optional<Vec3> SurfacePoints::beside(std::span<const Crossing> crossings,
                                          const Vec3& mean) const {
    Vec3 normal;
    double off_m = 0;
    for (const Crossing& c : crossings) {
        normal += c.normal;
        off_m += dot(c.normal, mean - c.point);
    }
    normal = normalized(normal);
    // Of a quadric the mean is half as far off as it is off the tangents.
    const Vec3 near = mean - normal * (off_m / (2 * static_cast<double>(crossings.size())));
    const FieldProbe::Nearest there = field_.at(near);
    if (there.primitive != crossings[0].primitive ||
        !(std::fabs(there.value_m) <= kBesideFace * lattice_.voxel_m))
        return std::nullopt;
    return near - normal * there.value_m;
}

std::optional<LabelledPoint> SurfacePoints::on_rim(const PrimitiveSet& set, const Vec3& from,
                                                   const Box& cell) const {
    std::optional<LabelledPoint> best;
    for (std::size_t i = 0; i < set.size() && set.size() == 3; ++i) {
        PrimitiveSet two;
        for (std::size_t k = 0; k < 3; ++k)
            if (k != i)
                two.add(set[k]);
        const auto p = meeting(two, from, cell, 0);
        if (p && is_on(*p) && (!best || length(*p - from) < length(best->point - from)))
            best = LabelledPoint{*p, two};
    }
    return best;
}

std::optional<Vec3> SurfacePoints::between_faces(const PrimitiveSet& set,
                                                 std::span<const Crossing> crossings,
                                                 const Box& cell) const {
    std::array<Vec3, 2> ends;
    std::size_t n = 0;
    for (std::size_t i = 0; i < crossings.size(); ++i)
        for (std::size_t k = i + 1; k < crossings.size(); ++k) {
            const Crossing &a = crossings[i], &b = crossings[k];
            if (a.primitive == b.primitive)
                continue;
            for (int axis = 0; axis < 3; ++axis) {
                const double at = a.point[axis];
                if (at != b.point[axis] || (at != cell.lo[axis] && at != cell.hi[axis]))
                    continue;
                const auto p = on_cell_face(a, b, axis, cell);
                if (!p)
                    continue;
                if (n < 2)
                    ends[n++] = *p;
                else if (length(*p - ends[0]) > length(ends[1] - ends[0]))
                    ends[1] = *p;
            }
        }
    if (n < 2)
        return std::nullopt;
    const auto p = onto(field_, set, (ends[0] + ends[1]) * 0.5, kFarthest * lattice_.voxel_m);
    return p && cell.contains(*p) && is_on(*p) ? p : std::nullopt;
}

std::optional<Vec3> SurfacePoints::on_cell_face(const Crossing& a, const Crossing& b, int axis,
                                                const Box& cell) const {
    constexpr double kLeastArea = 0.02; // sine of the angle between the two curves
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    Vec3 p = (a.point + b.point) * 0.5;
    p[axis] = a.point[axis];
    for (int i = 0; i < 8; ++i) {
        const FieldProbe::Value f = field_.of(a.primitive, p), g = field_.of(b.primitive, p);
        if (std::max(std::fabs(f.value_m), std::fabs(g.value_m)) <= kOnEdge * lattice_.voxel_m)
            return cell.contains(p) ? std::optional(p) : std::nullopt;
        const double area = f.gradient[u] * g.gradient[v] - f.gradient[v] * g.gradient[u];
        if (!(std::fabs(area) > kLeastArea * length(f.gradient) * length(g.gradient)))
            return std::nullopt;
        p[u] -= (f.value_m * g.gradient[v] - g.value_m * f.gradient[v]) / area;
        p[v] -= (g.value_m * f.gradient[u] - f.value_m * g.gradient[u]) / area;
        if (!cell.dilated(2 * lattice_.voxel_m).contains(p))
            return std::nullopt;
    }
    return std::nullopt;
}

std::optional<LabelledPoint> SurfacePoints::aside(const LabelledPoint& p,
                                                  std::span<const Crossing> crossings,
                                                  std::size_t rank, double share) const {
    struct Face {
        Primitive primitive;
        Vec3 sum;
        double n = 0;
    };
    std::array<Face, PrimitiveSet::kMost> faces;
    if (rank >= p.labels.size() || p.labels.size() < 2)
        return std::nullopt;
    for (std::size_t i = 0; i < p.labels.size(); ++i) {
        faces[i].primitive = p.labels[i];
        for (const Crossing& c : crossings)
            if (c.primitive == p.labels[i]) {
                faces[i].sum += c.point;
                ++faces[i].n;
            }
    }
    std::stable_sort(faces.begin(), faces.begin() + std::ptrdiff_t(p.labels.size()),
                     [](const Face& a, const Face& b) { return a.n > b.n; });
    const Face& own = faces[rank];
    if (own.n == 0)
        return std::nullopt;
    const auto on = onto(field_, PrimitiveSet(own.primitive),
                         p.point + (own.sum / own.n - p.point) * share, lattice_.voxel_m);
    if (!on || !is_on(*on))
        return std::nullopt;
    return LabelledPoint{*on, PrimitiveSet(own.primitive)};
}

LabelledPoint SurfacePoints::back_in(const LabelledPoint& p, const Box& cell) const {
    const Vec3 in = held(p.point, cell);
    if (const auto rim = on_rim(p.labels, in, cell))
        return *rim;
    return on_face(in, cell);
}

std::optional<LabelledPoint> SurfacePoints::settle(PrimitiveSet set, const Vec3& from,
                                                   const Box& cell, double slack_m) const {
    for (int i = 0; i < 3; ++i) {
        const auto p = meeting(set, from, cell, slack_m);
        if (!p)
            return std::nullopt;
        const FieldProbe::Nearest there = field_.at(*p);
        if (std::fabs(there.value_m) <= kOnSurface * lattice_.voxel_m)
            return LabelledPoint{*p, set};
        const std::size_t before = set.size(); // another primitive cuts it off there
        if (!set.add(there.primitive) || set.size() == before)
            return std::nullopt;
    }
    return std::nullopt;
}

Vec3 SurfacePoints::along_rim(const PrimitiveSet& set, const Vec3& p, const Box& cell) const {
    const double farthest = kFarthest * lattice_.voxel_m;
    const Vec3 way =
        normalized(cross(field_.of(set[0], p).gradient, field_.of(set[1], p).gradient));
    double first = -farthest, last = farthest;
    for (int axis = 0; axis < 3; ++axis) {
        if (std::fabs(way[axis]) < 1e-9)
            continue;
        const double a = (cell.lo[axis] - p[axis]) / way[axis],
                     b = (cell.hi[axis] - p[axis]) / way[axis];
        first = std::max(first, std::min(a, b));
        last = std::min(last, std::max(a, b));
    }
    return p + way * (0.5 * (first + last));
}

std::optional<Vec3> SurfacePoints::meeting(const PrimitiveSet& set, const Vec3& from,
                                           const Box& cell, double slack_m) const {
    const double farthest = kFarthest * lattice_.voxel_m;
    const auto nearest = onto(field_, set, from, farthest);
    auto p = nearest;
    // A rim that passes crossings of both its faces passes the cell: follow it there.
    for (int i = 0; i < 3 && p && set.size() == 2 && !cell.contains(*p); ++i) {
        const auto next = onto(field_, set, along_rim(set, *p, cell), farthest);
        if (!next)
            break;
        p = next;
    }
    if (p && cell.contains(*p))
        return p;
    return nearest && cell.dilated(slack_m).contains(*nearest) ? nearest : std::nullopt;
}

bool SurfacePoints::joins(const std::array<openvdb::Coord, 4>& corners) const {
    std::array<double, 4> v;
    for (std::size_t k = 0; k < 4; ++k)
        v[k] = static_cast<double>(accessor_.getValue(corners[k]));
    const bool first_inside = v[0] < 0;
    const std::size_t in = first_inside ? 0 : 1, out = 1 - in;
    const auto all_along = [&](std::size_t k, bool inside) {
        constexpr int kSteps = 8;
        const Vec3 from = voxel(corners[k]), way = voxel(corners[k + 2]) - from;
        for (int i = 0; i <= kSteps; ++i)
            if ((field_.at(from + way * (double(i) / kSteps)).value_m < 0) != inside)
                return false;
        return true;
    };
    if (all_along(in, true))
        return true;
    if (all_along(out, false))
        return false;
    return first_inside ? v[0] * v[2] > v[1] * v[3] : v[1] * v[3] > v[0] * v[2];
}

} // namespace taihu
