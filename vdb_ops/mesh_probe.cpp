#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <numeric>

#include "vdb_ops/columns_detail.h"
#include "vdb_ops/mesh_field.h"
#include "vdb_ops/probe_detail.h"

namespace taihu {

/// Which smooth part each face belongs to, numbered in the order of their first faces.
struct MeshField::Patches {
    std::once_flag once;
    std::vector<std::uint32_t> of_face;
    std::uint32_t n = 1;
};

namespace {

using Corners = std::array<Vec3, 3>;

/// The faces of one shell in a binary tree of boxes: node i has the children 2i + 1 and 2i + 2,
/// each with half of its faces.
class FaceTree {
public:
    FaceTree(const ClosedMesh& mesh, std::vector<std::uint32_t> faces)
        : mesh_(mesh), faces_(std::move(faces)) {
        while (faces_.size() >> depth_ > kLeafFaces)
            ++depth_;
        boxes_.resize((std::size_t{2} << depth_) - 1);
        build(0, 0, faces_.size(), depth_);
    }

    bool empty() const { return faces_.empty(); }

    /// Calls visit(face) for the faces of leaves that are at most sqrt(bound()) from p, the nearer
    /// child first.
    template <class Bound, class Visit>
    void nearest(const Vec3& p, const Bound& bound, const Visit& visit) const {
        if (distance2(boxes_[0], p) <= bound())
            descend_near(0, 0, faces_.size(), depth_, p, bound, visit);
    }
    /// Calls visit(face) for those whose leaf meets the box.
    template <class Visit>
    void meeting(const Box& box, const Visit& visit) const {
        descend_box(0, 0, faces_.size(), depth_, box, visit);
    }

private:
    static constexpr std::size_t kLeafFaces = 4;

    Box box_of(std::uint32_t face) const {
        Box box;
        for (const std::uint32_t v : mesh_.triangles[face])
            box.include(mesh_.positions[v]);
        return box;
    }
    void build(std::size_t node, std::size_t begin, std::size_t end, unsigned depth) {
        Box middles;
        for (std::size_t i = begin; i < end; ++i) {
            const Box box = box_of(faces_[i]);
            boxes_[node].include(box.lo);
            boxes_[node].include(box.hi);
            middles.include(box.center());
        }
        if (depth == 0)
            return;
        const Vec3 size = middles.size();
        const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        const std::size_t half = begin + (end - begin) / 2;
        const auto at = [&](std::size_t i) {
            return faces_.begin() + static_cast<std::ptrdiff_t>(i);
        };
        std::nth_element(at(begin), at(half), at(end), [&](std::uint32_t a, std::uint32_t b) {
            const double ca = box_of(a).center()[axis], cb = box_of(b).center()[axis];
            return ca != cb ? ca < cb : a < b;
        });
        build(2 * node + 1, begin, half, depth - 1);
        build(2 * node + 2, half, end, depth - 1);
    }

    static double distance2(const Box& box, const Vec3& p) {
        return length_squared(max(max(box.lo - p, p - box.hi), Vec3{}));
    }
    template <class Bound, class Visit>
    void descend_near(std::size_t node, std::size_t begin, std::size_t end, unsigned depth,
                      const Vec3& p, const Bound& bound, const Visit& visit) const {
        if (depth == 0) {
            for (std::size_t i = begin; i < end; ++i)
                visit(faces_[i]);
            return;
        }
        const std::size_t half = begin + (end - begin) / 2, left = 2 * node + 1, right = left + 1;
        const double to_left = distance2(boxes_[left], p), to_right = distance2(boxes_[right], p);
        const auto go_left = [&] {
            if (to_left <= bound())
                descend_near(left, begin, half, depth - 1, p, bound, visit);
        };
        const auto go_right = [&] {
            if (to_right <= bound())
                descend_near(right, half, end, depth - 1, p, bound, visit);
        };
        if (to_left <= to_right) {
            go_left();
            go_right();
        } else {
            go_right();
            go_left();
        }
    }
    template <class Visit>
    void descend_box(std::size_t node, std::size_t begin, std::size_t end, unsigned depth,
                     const Box& box, const Visit& visit) const {
        const Box& own = boxes_[node];
        for (int axis = 0; axis < 3; ++axis)
            if (own.hi[axis] < box.lo[axis] || own.lo[axis] > box.hi[axis])
                return;
        if (depth == 0) {
            for (std::size_t i = begin; i < end; ++i)
                visit(faces_[i]);
            return;
        }
        const std::size_t half = begin + (end - begin) / 2;
        descend_box(2 * node + 1, begin, half, depth - 1, box, visit);
        descend_box(2 * node + 2, half, end, depth - 1, box, visit);
    }

    const ClosedMesh& mesh_;
    std::vector<std::uint32_t> faces_;
    std::vector<Box> boxes_;
    unsigned depth_ = 0;
};

/// The nearest point of a triangle, and whether it lies within its border (after Ericson 2005,
/// Real-Time Collision Detection, 5.1.5, from memory).
struct Foot {
    Vec3 point;
    bool inside = false;
};
Foot foot_on(const Corners& t, const Vec3& p) {
    const Vec3 ab = t[1] - t[0], ac = t[2] - t[0], ap = p - t[0];
    const double d1 = dot(ab, ap), d2 = dot(ac, ap);
    if (d1 <= 0 && d2 <= 0)
        return {t[0]};
    const Vec3 bp = p - t[1];
    const double d3 = dot(ab, bp), d4 = dot(ac, bp);
    if (d3 >= 0 && d4 <= d3)
        return {t[1]};
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0)
        return {t[0] + ab * (d1 / (d1 - d3))};
    const Vec3 cp = p - t[2];
    const double d5 = dot(ab, cp), d6 = dot(ac, cp);
    if (d6 >= 0 && d5 <= d6)
        return {t[2]};
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0)
        return {t[0] + ac * (d2 / (d2 - d6))};
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 >= d3 && d5 >= d6)
        return {t[1] + (t[2] - t[1]) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)))};
    const double all = va + vb + vc;
    return {t[0] + ab * (vb / all) + ac * (vc / all), true};
}

Vec3 face_normal(const ClosedMesh& mesh, std::size_t face) {
    const Triangle& t = mesh.triangles[face];
    return normalized(cross(mesh.positions[t[1]] - mesh.positions[t[0]],
                            mesh.positions[t[2]] - mesh.positions[t[0]]));
}

/// Joins faces over edges that are not sharp.
std::vector<std::uint32_t> smooth_parts(const ClosedMesh& mesh, std::uint32_t& n_parts) {
    constexpr double kSmoothCosine = 0.866;
    struct Side {
        std::uint64_t edge;
        std::uint32_t face;
    };
    const std::size_t n = mesh.triangles.size();
    std::vector<Side> sides;
    sides.reserve(3 * n);
    for (std::uint32_t f = 0; f < n; ++f)
        for (std::size_t k = 0; k < 3; ++k) {
            const auto [lo, hi] = std::minmax(mesh.triangles[f][k], mesh.triangles[f][(k + 1) % 3]);
            sides.push_back({std::uint64_t{lo} << 32 | hi, f});
        }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
        return a.edge != b.edge ? a.edge < b.edge : a.face < b.face;
    });
    std::vector<std::uint32_t> parent(n);
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&](std::uint32_t f) {
        while (parent[f] != f)
            f = parent[f] = parent[parent[f]];
        return f;
    };
    for (std::size_t i = 0, end = 0; i < sides.size(); i = end) {
        for (end = i; end < sides.size() && sides[end].edge == sides[i].edge;)
            ++end;
        const std::uint32_t f = sides[i].face, g = sides[end - 1].face;
        if (end - i == 2 && mesh.shell_of[f] == mesh.shell_of[g] &&
            dot(face_normal(mesh, f), face_normal(mesh, g)) > kSmoothCosine) {
            const std::uint32_t a = root(f), b = root(g);
            parent[std::max(a, b)] = std::min(a, b);
        }
    }
    std::vector<std::uint32_t> part(n);
    n_parts = 0;
    for (std::uint32_t f = 0; f < n; ++f)
        part[f] = root(f) == f ? n_parts++ : part[root(f)];
    return part;
}

/// Exact distances of a mesh at single points. Which side a point is on is counted along the way to
/// the middle of its cell, whose winding number is known, where the nearest face does not tell.
class MeshProbe final : public FieldProbe {
public:
    MeshProbe(const ClosedMesh& mesh, const std::vector<std::uint32_t>& part, const Box& region,
              double reach_m)
        : mesh_(mesh), part_(part), reach_m_(reach_m),
          cube_(region, std::min(4 * reach_m, region.longest() / 64), kMostDepth),
          columns_(mesh, in_cells(), cells()) {
        std::vector<std::vector<std::uint32_t>> faces(mesh.shells.size());
        // Ways to middles of cells reach beyond the region by a cell.
        Box wide;
        wide.include(cube_.origin());
        wide.include(cube_.origin() + Vec3{1, 1, 1} * (cube_.cell_m() * (1 << cube_.depth())));
        wide = wide.dilated(reach_m);
        for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
            Box box;
            for (const std::uint32_t v : mesh.triangles[f])
                box.include(mesh.positions[v]);
            bool meets = mesh.shells[mesh.shell_of[f]].role != Shell::Role::sheet;
            for (int axis = 0; axis < 3; ++axis)
                meets = meets && box.lo[axis] <= wide.hi[axis] && box.hi[axis] >= wide.lo[axis];
            if (meets)
                faces[mesh.shell_of[f]].push_back(f);
        }
        for (auto& f : faces)
            trees_.emplace_back(mesh, std::move(f));
    }

    Nearest at(const Vec3& p) const override {
        Nearest at{reach_m_, 0};
        for (std::uint32_t s = 0; s < trees_.size(); ++s) {
            const Shell::Role role = mesh_.shells[s].role;
            if (role == Shell::Role::sheet)
                continue;
            Nearest shell = shell_at(s, p);
            if (mesh_.rule == ShellRule::parity) { // in one of both: the nearer one decides
                const bool in = (shell.value_m < 0) != (at.value_m < 0);
                if (std::fabs(shell.value_m) < std::fabs(at.value_m))
                    at = shell;
                at.value_m = std::copysign(at.value_m, in ? -1.0 : 1.0);
                continue;
            }
            if (role == Shell::Role::cavity)
                shell.value_m = -shell.value_m;
            if (role == Shell::Role::cavity ? shell.value_m > at.value_m
                                            : shell.value_m < at.value_m)
                at = shell;
        }
        return at;
    }
    /// The distance from the plane of the part's nearest face.
    Value of(Primitive part, const Vec3& p) const override {
        double least2 = std::numeric_limits<double>::infinity();
        std::uint32_t nearest = 0;
        Foot best{p};
        for (const FaceTree& tree : trees_) {
            if (tree.empty())
                continue;
            tree.nearest(
                p, [&] { return least2; },
                [&](std::uint32_t f) {
                    if (part_[f] != part)
                        return;
                    const Foot foot = foot_on(corners(f), p);
                    const double d2 = length_squared(p - foot.point);
                    if (d2 > least2 || (d2 == least2 && !foot.inside))
                        return;
                    least2 = d2;
                    nearest = f;
                    best = foot;
                });
        }
        if (least2 == std::numeric_limits<double>::infinity())
            return {reach_m_, {}}; // not in the region
        const std::uint32_t s = mesh_.shell_of[nearest];
        const bool turned = (mesh_.shells[s].volume_m3 < 0) != bounds_void(s, best.point);
        const Vec3 normal = face_normal(mesh_, nearest) * (turned ? -1.0 : 1.0);
        return {dot(normal, p - best.point), normal};
    }
    void near(const Vec3& p, double reach_m, std::vector<Primitive>& out) const override {
        const auto begin = static_cast<std::ptrdiff_t>(out.size());
        const double reach2 = reach_m * reach_m;
        for (const FaceTree& tree : trees_)
            if (!tree.empty())
                tree.nearest(
                    p, [&] { return reach2; },
                    [&](std::uint32_t f) {
                        if (length_squared(p - foot_on(corners(f), p).point) <= reach2)
                            out.push_back(part_[f]);
                    });
        std::sort(out.begin() + begin, out.end());
        out.erase(std::unique(out.begin() + begin, out.end()), out.end());
    }
    std::optional<Sphere> ball(Primitive) const override { return std::nullopt; }

private:
    static constexpr int kMostDepth = 7;

    /// Cells have whole coordinates in their middles.
    std::vector<Vec3> in_cells() const {
        std::vector<Vec3> points(mesh_.positions.size());
        for (std::size_t i = 0; i < points.size(); ++i)
            points[i] =
                (mesh_.positions[i] - cube_.origin()) / cube_.cell_m() - Vec3{0.5, 0.5, 0.5};
        return points;
    }
    openvdb::CoordBBox cells() const {
        return {openvdb::Coord(0), openvdb::Coord((1 << cube_.depth()) - 1)};
    }
    Corners corners(std::uint32_t face) const {
        const Triangle& t = mesh_.triangles[face];
        return {mesh_.positions[t[0]], mesh_.positions[t[1]], mesh_.positions[t[2]]};
    }

    /// Whether what a shell holds is void where its face is at `p`.
    bool bounds_void(std::uint32_t s, const Vec3& p) const {
        if (mesh_.rule != ShellRule::parity)
            return mesh_.shells[s].role == Shell::Role::cavity;
        bool in = false;
        for (std::uint32_t other = 0; other < mesh_.shells.size(); ++other)
            if (other != s && mesh_.shells[other].role != Shell::Role::sheet)
                in ^= winding_at(other, p) != 0;
        return in;
    }

    Nearest shell_at(std::uint32_t s, const Vec3& p) const {
        const bool overlaps = columns_.overlaps_itself(s);
        const int winding = overlaps ? winding_at(s, p) : 0;
        double least2 = reach_m_ * reach_m_;
        Foot best{p};
        Vec3 normal;
        std::uint32_t nearest = 0;
        const auto look = [&](std::uint32_t f) {
            const Corners t = corners(f);
            const Foot foot = foot_on(t, p);
            const double d2 = length_squared(p - foot.point);
            if (d2 > least2 || (d2 == least2 && !foot.inside))
                return;
            const Vec3 n = cross(t[1] - t[0], t[2] - t[0]);
            if (std::abs(winding) > 1 || winding * dot(n, p - t[0]) > 0)
                return; // inside of what overlaps: not the surface
            least2 = d2;
            best = foot;
            normal = n;
            nearest = f;
        };
        if (!trees_[s].empty())
            trees_[s].nearest(
                p, [&] { return least2; }, look);
        const bool found = normal != Vec3{};
        normal *= mesh_.shells[s].volume_m3 < 0 ? -1 : 1; // of a cavity faces turn inwards
        const bool in = overlaps               ? winding != 0
                        : found && best.inside ? dot(normal, p - best.point) < 0
                                               : winding_at(s, p) != 0;
        const double d = found ? std::sqrt(least2) : reach_m_;
        return {in ? -d : d, found ? part_[nearest] : 0};
    }

    int winding_at(std::uint32_t s, const Vec3& p) const {
        openvdb::Coord c;
        Vec3 middle;
        for (int axis = 0; axis < 3; ++axis) {
            const double most = (1 << cube_.depth()) - 1;
            c[axis] = static_cast<int>(
                std::clamp((p[axis] - cube_.origin()[axis]) / cube_.cell_m(), 0.0, most));
            middle[axis] = cube_.origin()[axis] + (c[axis] + 0.5) * cube_.cell_m();
        }
        int winding = columns_.winding(c, s);
        if (trees_[s].empty())
            return winding;
        Box way;
        way.include(p);
        way.include(middle);
        trees_[s].meeting(way, [&](std::uint32_t f) { winding -= passes(f, p, middle); });
        return winding;
    }
    /// +1 where the way enters through the face, -1 where it leaves. What an edge is passed on is
    /// computed the same way for both its faces.
    int passes(std::uint32_t face, const Vec3& from, const Vec3& to) const {
        const Triangle& id = mesh_.triangles[face];
        const Corners t = corners(face);
        const Vec3 n = cross(t[1] - t[0], t[2] - t[0]);
        const bool front = dot(n, from - t[0]) >= 0;
        if (front == (dot(n, to - t[0]) >= 0))
            return 0;
        const Vec3 way = to - from;
        std::array<bool, 3> left;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t next = (k + 1) % 3;
            const bool turned = id[k] > id[next];
            const Vec3 a = t[turned ? next : k] - from, b = t[turned ? k : next] - from;
            left[k] = (dot(way, cross(a, b)) >= 0) != turned;
        }
        if (left[0] != left[1] || left[1] != left[2])
            return 0;
        return front ? 1 : -1;
    }

    const ClosedMesh& mesh_;
    const std::vector<std::uint32_t>& part_;
    double reach_m_;
    CellCube cube_;
    Columns columns_;
    std::vector<FaceTree> trees_;
};

} // namespace

MeshField::MeshField(ClosedMesh mesh)
    : mesh_(std::move(mesh)), patches_(std::make_shared<Patches>()) {}

const MeshField::Patches& MeshField::patches() const {
    std::call_once(patches_->once, [this] {
        constexpr std::size_t kMany = 64, kFacesEach = 16;
        patches_->of_face = smooth_parts(mesh_, patches_->n);
        if (patches_->n > std::max(kMany, mesh_.triangles.size() / kFacesEach)) {
            std::fill(patches_->of_face.begin(), patches_->of_face.end(), 0u);
            patches_->n = 1;
        }
    });
    return *patches_;
}

Primitive MeshField::n_primitives() const {
    return patches().n;
}

std::unique_ptr<FieldProbe> MeshField::probe(const Box& region_m, double reach_m) const {
    return std::make_unique<MeshProbe>(mesh_, patches().of_face, region_m, reach_m);
}

} // namespace taihu
