#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "mesh_out/bounded_surface_detail.h"
#include "mesh_out/crossings_detail.h"

namespace taihu {

double BoundedSurface::error_of(std::size_t face) const {
    const FaceErrors::Rules rules{
        .face_m = bound_m, .rim_m = bound_m, .exact_corners = false, .may_pierce = true};
    const double known = errors.bound(corners(face), labels_of(face), rules);
    return known <= bound_m ? known : errors.searched(corners(face), bound_m, bound_m);
}

namespace {

constexpr int kRounds = 5;
constexpr double kShortest = 0.4;   ///< of a spacing: what is split no more
constexpr double kOnSurface = 1e-3; ///< of a spacing
constexpr double kLeastTurn = 0.2;  ///< cosine of how far a split may turn a face

class Repair {
public:
    explicit Repair(BoundedSurface& surface)
        : start_(surface), s_(surface), errors_(surface.face_errors), dirty_(surface.dirty),
          n_old_(surface.positions.size()) {}
    Repaired run(std::size_t most_crossings, Progress* progress);

private:
    void measure();
    std::size_t find_crossing(std::vector<std::uint8_t>& meets) const;
    bool move_back(std::size_t face);
    bool split(std::size_t face);
    bool place(std::uint32_t corner, std::size_t face, Vec3& at, std::uint32_t& label) const;
    bool split_is_shapely(std::uint32_t corner, const Vec3& at) const;
    std::uint32_t longest(std::size_t face) const;
    double error_there(std::size_t face, double enough_m) const;
    std::vector<UnresolvedPlace> places(const std::vector<std::uint8_t>& bad) const;

    BoundedSurface& start_;
    BoundedSurface s_;
    std::vector<double> errors_; ///< per face
    std::vector<std::uint8_t> dirty_;
    std::size_t n_old_;                   ///< vertices before any split
    std::vector<Vec3> middles_;           ///< of the edges that new vertices split
    std::vector<std::uint8_t> retreated_; ///< new vertices that went there
};

void Repair::measure() {
    errors_.resize(s_.table.n_triangles(), 0);
    dirty_.resize(errors_.size(), 1);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, errors_.size(), 64),
                      [&](const auto& range) {
                          for (std::size_t f = range.begin(); f < range.end(); ++f)
                              if (dirty_[f])
                                  errors_[f] = s_.error_of(f);
                      });
}

/// Marks faces that meet others, of pairs with one that changed since the last time. Faces without
/// an area meet nothing that could be told.
std::size_t Repair::find_crossing(std::vector<std::uint8_t>& meets) const {
    std::vector<Triangle> faces;
    std::vector<std::uint32_t> numbers;
    std::vector<std::uint8_t> picked;
    for (std::uint32_t f = 0; f < errors_.size(); ++f) {
        const Triangle t = s_.table.triangle(f);
        if (dirty_[f] && is_flat(s_.positions[t[0]], s_.positions[t[1]], s_.positions[t[2]]))
            continue;
        faces.push_back(t);
        numbers.push_back(f);
        picked.push_back(dirty_[f]);
    }
    meets.assign(errors_.size(), 0);
    const auto pairs = crossing_pairs(s_.positions, faces, picked);
    for (const auto& [f, g] : pairs)
        meets[numbers[f]] = meets[numbers[g]] = 1;
    return pairs.size();
}

/// To where they lay before they were balanced; when there they are, new ones into the edge that
/// they split, where nothing crossed.
bool Repair::move_back(std::size_t face) {
    bool moved = false;
    const Triangle vertices = s_.table.triangle(face);
    const bool balanced = std::any_of(vertices.begin(), vertices.end(), [&](std::uint32_t v) {
        return s_.positions[v] != s_.exact[v];
    });
    for (const std::uint32_t v : vertices) {
        if (!balanced && v >= n_old_ && !retreated_[v - n_old_]) {
            s_.exact[v] = middles_[v - n_old_];
            retreated_[v - n_old_] = 1;
        }
        if (s_.positions[v] == s_.exact[v])
            continue;
        moved = true;
        s_.positions[v] = s_.exact[v];
        std::uint32_t c = s_.table.corner(v);
        do {
            dirty_[c / 3] = 1;
            c = s_.table.swing(c);
        } while (c != s_.table.corner(v));
    }
    return moved;
}

std::uint32_t Repair::longest(std::size_t face) const {
    const FaceErrors::Corners p = s_.corners(face);
    std::size_t best = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (length_squared(p[(k + 1) % 3] - p[(k + 2) % 3]) >
            length_squared(p[(best + 1) % 3] - p[(best + 2) % 3]))
            best = k;
    return static_cast<std::uint32_t>(3 * face + best);
}

/// A point of the solid's surface for the middle of the edge opposite to `corner`.
bool Repair::place(std::uint32_t corner, std::size_t face, Vec3& at, std::uint32_t& label) const {
    const std::uint32_t a = s_.table.vertex(CornerTable::next(corner)),
                        b = s_.table.vertex(CornerTable::previous(corner));
    const Vec3 middle = (s_.positions[a] + s_.positions[b]) * .5;
    const double edge = length(s_.positions[a] - s_.positions[b]);
    if (edge < kShortest * s_.spacing_m)
        return false;
    const auto lies_there = [&](std::uint32_t l, double reach) {
        const auto y = onto(s_.errors.field(), s_.errors.primitives(l), middle, reach);
        if (!y || std::abs(s_.errors.field().at(*y).value_m) > kOnSurface * s_.spacing_m)
            return false;
        at = *y;
        label = l;
        return true;
    };
    const PrimitiveSet shared = s_.errors.set(s_.labels[a]).common(s_.errors.set(s_.labels[b]));
    FaceErrors::Range range;
    const std::uint32_t own = s_.errors.own(s_.corners(face), s_.labels_of(face), false, range);
    if (own != FaceErrors::kNone)
        return lies_there(s_.errors.label_of(shared), 0.4 * edge) ||
               lies_there(s_.errors.label_of(PrimitiveSet(own)), 0.4 * edge);
    if (!shared.empty())
        return false;
    // An edge across a rim that has no vertex here.
    PrimitiveSet both;
    for (const std::uint32_t v : {a, b})
        for (const std::uint32_t shape : s_.errors.shapes(s_.labels[v]))
            if (!both.add(shape))
                return false;
    return lies_there(s_.errors.label_of(both), 0.7 * edge);
}

bool Repair::split_is_shapely(std::uint32_t corner, const Vec3& at) const {
    for (const std::uint32_t c : {corner, s_.table.opposite(corner)}) {
        const Vec3 &a = s_.positions[s_.table.vertex(c)],
                   &p = s_.positions[s_.table.vertex(CornerTable::next(c))],
                   &q = s_.positions[s_.table.vertex(CornerTable::previous(c))];
        const Vec3 before = cross(p - a, q - a);
        for (const Vec3& after : {cross(p - a, at - a), cross(at - a, q - a)})
            if (dot(before, after) <= kLeastTurn * length(before) * length(after))
                return false;
    }
    return true;
}

bool Repair::split(std::size_t face) {
    for (const std::uint32_t v : s_.table.triangle(face))
        if (v < n_old_ ? s_.kept[v] : retreated_[v - n_old_])
            return false;
    const std::uint32_t first = longest(face);
    for (const std::uint32_t corner :
         {first, CornerTable::next(first), CornerTable::previous(first)}) {
        Vec3 at;
        std::uint32_t label = 0;
        if (!place(corner, face, at, label) || !split_is_shapely(corner, at))
            continue;
        const std::size_t beyond = s_.table.opposite(corner) / 3;
        middles_.push_back((s_.positions[s_.table.vertex(CornerTable::next(corner))] +
                            s_.positions[s_.table.vertex(CornerTable::previous(corner))]) *
                           .5);
        retreated_.push_back(0);
        s_.table.split(corner);
        s_.exact.push_back(at);
        s_.positions.push_back(at);
        s_.labels.push_back(label);
        dirty_[face] = dirty_[beyond] = 1;
        dirty_.resize(s_.table.n_triangles(), 1);
        errors_.resize(s_.table.n_triangles(), 0);
        return true;
    }
    return false;
}

Repaired Repair::run(std::size_t most_crossings, Progress* progress) {
    Repaired repaired;
    BoundedMesh& out = repaired.result;
    out.bound_m = s_.bound_m;
    std::vector<std::uint8_t> meets, bad;
    for (int round = 0;; ++round) {
        check_cancelled(progress);
        measure();
        out.n_crossings = find_crossing(meets);
        bad.assign(errors_.size(), 0);
        for (std::size_t f = 0; f < bad.size(); ++f)
            bad[f] = meets[f] || !(errors_[f] <= s_.bound_m);
        // What crosses stays in question until it does no more.
        dirty_ = meets;
        if (round == 0) {
            start_.face_errors = errors_;
            start_.dirty = dirty_;
        }
        bool changed = false;
        for (std::size_t f = 0; round < kRounds && f < bad.size(); ++f)
            if (bad[f])
                changed = (meets[f] && move_back(f)) || split(f) || changed;
        if (!changed)
            break;
    }
    for (std::size_t f = 0; f < errors_.size(); ++f) {
        if (!meets[f])
            continue;
        const FaceErrors::Corners p = s_.corners(f);
        const Vec3 middle = (p[0] + p[1] + p[2]) / 3;
        repaired.crossings.push_back(
            {middle,
             std::max({length(p[0] - middle), length(p[1] - middle), length(p[2] - middle)})});
    }
    if (repaired.crossings.size() > most_crossings)
        return repaired;
    for (std::size_t f = 0; f < errors_.size(); ++f) {
        out.mesh.triangles.push_back(s_.table.triangle(f));
        if (!bad[f])
            out.error_m = std::max(out.error_m, errors_[f]);
    }
    out.unresolved = places(bad);
    out.mesh.positions = s_.positions;
    for (const std::uint32_t l : s_.labels)
        out.mesh.labels.push_back(s_.errors.primitives(l));
    return repaired;
}

/// An upper bound of the distance of a bad face; of its parts none below `enough_m` is told.
double Repair::error_there(std::size_t face, double enough_m) const {
    const FaceErrors::Corners corners = s_.corners(face);
    double error = s_.errors.searched(corners, enough_m);
    for (const std::uint32_t v : s_.table.triangle(face)) {
        // At worst the surface is no farther than a vertex that lies on it.
        const Vec3& y = s_.exact[v];
        if (error < FaceErrors::kFar ||
            std::abs(s_.errors.field().at(y).value_m) > kOnSurface * s_.spacing_m)
            continue;
        error = std::max({length(corners[0] - y), length(corners[1] - y), length(corners[2] - y)});
    }
    return error;
}

/// Bad faces that hang together are one place.
std::vector<UnresolvedPlace> Repair::places(const std::vector<std::uint8_t>& bad) const {
    std::vector<UnresolvedPlace> out;
    std::vector<std::uint8_t> seen(bad.size(), 0);
    std::vector<std::size_t> open;
    for (std::size_t first = 0; first < bad.size(); ++first) {
        if (!bad[first] || seen[first])
            continue;
        Box box;
        double error = 0;
        open.assign(1, first);
        seen[first] = 1;
        while (!open.empty()) {
            const std::size_t f = open.back();
            open.pop_back();
            error = std::max(error, error_there(f, std::max(error, 1.5 * s_.bound_m)));
            for (const std::uint32_t v : s_.table.triangle(f)) {
                box.include(s_.positions[v]);
                std::uint32_t c = s_.table.corner(v);
                do {
                    if (bad[c / 3] && !seen[c / 3]) {
                        seen[c / 3] = 1;
                        open.push_back(c / 3);
                    }
                    c = s_.table.swing(c);
                } while (c != s_.table.corner(v));
            }
        }
        out.push_back({box.center(), length(box.size()) / 2, error});
    }
    return out;
}

} // namespace

bool keep(BoundedSurface& s, const std::vector<std::uint8_t>& more) {
    bool any = false;
    for (std::uint32_t v = 0; v < more.size(); ++v) {
        if (!more[v] || s.kept[v])
            continue;
        any = true;
        s.kept[v] = 1;
        s.positions[v] = s.exact[v];
        std::uint32_t c = s.table.corner(v);
        do {
            s.dirty[c / 3] = 1;
            c = s.table.swing(c);
        } while (c != s.table.corner(v));
    }
    return any;
}

Repaired repair(BoundedSurface& surface, std::size_t most_crossings, Progress* progress) {
    return Repair(surface).run(most_crossings, progress);
}

} // namespace taihu
