#include "mesh_out/extract_parts_detail.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <unordered_set>
#include <utility>

#include <tbb/parallel_for.h>

#include "mesh_out/crossings_detail.h"

namespace taihu {
namespace {

// In voxels.
constexpr double kOnSurface = 1e-3, kLeastApart = 0.02, kFarthest = 4;
/// Edges between neighbouring voxel cells are shorter: sqrt(6).
constexpr double kLong = 2.5;

/// A vertex for the edge between two others, or for the triangle of that number.
struct Part {
    std::uint32_t from, to; ///< from < to; of triangles kTriangle and the number
    Vec3 point;
    PrimitiveSet labels;
    bool dropped = false;

    friend bool operator<(const Part& a, const Part& b) {
        return std::pair(a.from, a.to) < std::pair(b.from, b.to);
    }
};
constexpr std::uint32_t kTriangle = 0xffffffff;

class Parts {
public:
    /// \param from  only edges of vertices from this one on.
    Parts(LabelledMesh& mesh, const FieldProbe& field, const Lattice& lattice, double bound_vox,
          std::size_t from)
        : mesh_(mesh), field_(field), lattice_(lattice), voxel_m_(lattice.voxel_m),
          bound_m_(bound_vox * lattice.voxel_m), from_(from), n_before_(mesh.positions.size()) {}

    /// \param parents  of triangles that are added. \return whether there were any.
    bool run(std::vector<std::uint32_t>& parents, Certainty& certainty, Progress* progress) {
        find();
        if (parts_.empty())
            return false;
        list_triangles();
        tell(certainty);
        do { // each time there is a part less
            check_cancelled(progress);
            split();
        } while (drop());
        for (std::size_t k = 0; k < parted_.size(); ++k) {
            mesh_.triangles[parted_[k]] = new_[first_[k]];
            mesh_.triangles.insert(mesh_.triangles.end(), new_.begin() + first_[k] + 1,
                                   new_.begin() + first_[k + 1]);
            parents.resize(parents.size() + std::size_t(first_[k + 1] - first_[k] - 1), parted_[k]);
        }
        return true;
    }

private:
    using Middles = std::array<std::optional<std::uint32_t>, 3>;

    void find() {
        constexpr std::size_t kChunk = 8192;
        std::vector<std::vector<Part>> found(mesh_.triangles.size() / kChunk + 1);
        tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t chunk) {
            const std::size_t end = std::min(mesh_.triangles.size(), (chunk + 1) * kChunk);
            for (std::size_t t = chunk * kChunk; t < end; ++t) {
                for (std::size_t k = 0; k < 3; ++k) {
                    const std::uint32_t a = mesh_.triangles[t][k],
                                        b = mesh_.triangles[t][(k + 1) % 3];
                    if (a < b && b >= from_) // and once the other way
                        if (const auto part = of_edge(a, b))
                            found[chunk].push_back(*part);
                }
                if (const auto part =
                        from_ > 0 ? std::nullopt : of_triangle(static_cast<std::uint32_t>(t)))
                    found[chunk].push_back(*part);
            }
        });
        for (const auto& f : found)
            parts_.insert(parts_.end(), f.begin(), f.end());
        std::sort(parts_.begin(), parts_.end());
    }

    std::optional<Vec3> on_all(const PrimitiveSet& labels, const Vec3& from) const {
        const auto p = onto(field_, labels, from, kFarthest * voxel_m_);
        return p && std::fabs(field_.at(*p).value_m) <= kOnSurface * voxel_m_ ? p : std::nullopt;
    }

    bool is_off(const PrimitiveSet& labels, const Vec3& p) const {
        const auto all = labels.all();
        return std::any_of(all.begin(), all.end(), [&](Primitive i) {
            return std::fabs(field_.of(i, p).value_m) >= bound_m_;
        });
    }

    /// On the rim between the faces of its ends, or on what both lie on.
    std::optional<Part> of_edge(std::uint32_t a, std::uint32_t b) const {
        const PrimitiveSet &l = mesh_.labels[a], &m = mesh_.labels[b];
        if (l.size() == 1 && l == m)
            return std::nullopt;
        const Vec3 from = mesh_.positions[a], way = mesh_.positions[b] - from;
        PrimitiveSet both = l.common(m);
        double least_m = bound_m_, share = 0.5;
        if (both.empty() && l.size() == 1 && m.size() == 1) {
            both = l;
            both.add(m[0]);
            least_m = kLeastApart * voxel_m_;
            // As far from the rim as the other face is from there.
            const double u = std::fabs(field_.of(m[0], from).value_m),
                         v = std::fabs(field_.of(l[0], from + way).value_m);
            share = u / std::max(u + v, 1e-300);
        } else if (both.empty() || length_squared(way) < kLong * kLong * voxel_m_ * voxel_m_ ||
                   !is_off(both, from + way * share)) {
            return std::nullopt;
        }
        const auto p = on_all(both, from + way * share);
        if (!p)
            return std::nullopt;
        const double at = std::clamp(dot(*p - from, way) / length_squared(way), 0.0, 1.0);
        if (length(*p - from - way * at) < least_m)
            return std::nullopt;
        return Part{a, b, *p, both};
    }

    /// The corner of three primitives none of which is that of all three vertices.
    std::optional<Part> of_triangle(std::uint32_t t) const {
        const Triangle& corners = mesh_.triangles[t];
        PrimitiveSet all = mesh_.labels[corners[0]], common = all;
        for (const std::uint32_t v : corners)
            if (mesh_.labels[v] != common)
                common = common.common(mesh_.labels[v]);
        if (!common.empty())
            return std::nullopt;
        Vec3 middle;
        for (const std::uint32_t v : corners) {
            middle += mesh_.positions[v] / 3;
            for (const Primitive p : mesh_.labels[v].all())
                if (!all.add(p))
                    return std::nullopt;
        }
        if (all.size() < PrimitiveSet::kMost)
            return std::nullopt;
        const auto p = on_all(all, middle);
        return p ? std::optional(Part{kTriangle, t, *p, all}) : std::nullopt;
    }

    std::optional<std::uint32_t> vertex(std::uint32_t from, std::uint32_t to) const {
        Part key;
        key.from = from;
        key.to = to;
        const auto at = std::lower_bound(parts_.begin(), parts_.end(), key);
        if (at == parts_.end() || key < *at)
            return std::nullopt;
        return static_cast<std::uint32_t>(n_before_ + std::size_t(at - parts_.begin()));
    }

    Middles middles(const Triangle& t) const {
        Middles middle;
        for (std::size_t k = 0; k < 3; ++k)
            middle[k] = vertex(std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3]));
        return middle;
    }

    /// Those to part, and those that may reach their parts: these are small against 16 voxels.
    void list_triangles() {
        std::vector<std::uint8_t> is_end(n_before_), has_corner(mesh_.triangles.size());
        std::unordered_set<openvdb::Coord> close;
        for (const Part& p : parts_) {
            if (p.from == kTriangle)
                has_corner[p.to] = 1;
            else
                is_end[p.from] = is_end[p.to] = 1;
            for (int k = 0; k < 27; ++k)
                close.insert(coarse(p.point).offsetBy(k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1));
        }
        for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
            const Triangle& corners = mesh_.triangles[t];
            if (has_corner[t] ||
                (is_end[corners[0]] + is_end[corners[1]] + is_end[corners[2]] > 1 &&
                 middles(corners) != Middles()))
                parted_.push_back(t);
            else if (close.contains(coarse(mesh_.positions[corners[0]])))
                near_.push_back(corners);
        }
    }
    /// Parts of a triangle are kept or not together, and with those of triangles that they may
    /// cross.
    void tell(Certainty& certainty) const {
        if (certainty.is_of_all())
            return;
        std::vector<Box> boxes;
        for (const std::uint32_t t : parted_) {
            Box box;
            for (const std::uint32_t v : mesh_.triangles[t])
                box.include(mesh_.positions[v]);
            const Middles middle = middles(mesh_.triangles[t]);
            for (const auto& m : {middle[0], middle[1], middle[2], vertex(kTriangle, t)})
                if (m)
                    box.include(parts_[*m - n_before_].point);
            boxes.push_back(box.dilated(kLeastApart * voxel_m_));
        }
        certainty.decided(boxes);
    }
    openvdb::Coord coarse(const Vec3& p) const {
        const Vec3 at = (p - lattice_.origin) / (16 * lattice_.voxel_m);
        return {int(std::floor(at.x)), int(std::floor(at.y)), int(std::floor(at.z))};
    }

    /// Makes new_ and the new vertices from the parts that are left.
    void split() {
        mesh_.positions.resize(n_before_);
        mesh_.labels.resize(n_before_);
        for (const Part& p : parts_) {
            mesh_.positions.push_back(p.point);
            mesh_.labels.push_back(p.labels);
        }
        new_.clear();
        first_.clear();
        for (const std::uint32_t t : parted_) {
            first_.push_back(static_cast<std::ptrdiff_t>(new_.size()));
            const Triangle& corners = mesh_.triangles[t];
            const Middles middle = middles(corners);
            if (const auto corner = vertex(kTriangle, t))
                add_fan(corners, middle, *corner);
            else if (middle != Middles())
                add_parts(corners, middle);
            else
                new_.push_back(corners);
        }
        first_.push_back(static_cast<std::ptrdiff_t>(new_.size()));
    }
    void add_fan(const Triangle& t, const Middles& middle, std::uint32_t c) {
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t next = t[(k + 1) % 3];
            new_.push_back({t[k], middle[k].value_or(next), c});
            if (middle[k])
                new_.push_back({*middle[k], next, c});
        }
    }
    void add_parts(const Triangle& t, const Middles& middle) {
        if (middle[0] && middle[1] && middle[2]) {
            for (std::size_t k = 0; k < 3; ++k)
                new_.push_back({t[k], *middle[k], *middle[(k + 2) % 3]});
            new_.push_back({*middle[0], *middle[1], *middle[2]});
            return;
        }
        // Turned so that the first edge is parted and the last is not.
        std::size_t k = 0;
        while (!middle[k] || middle[(k + 2) % 3])
            ++k;
        const std::uint32_t a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3], m = *middle[k];
        if (const auto& second = middle[(k + 1) % 3]) {
            const std::uint32_t l = *second;
            const auto& p = mesh_.positions;
            const bool from_a = length_squared(p[l] - p[a]) <= length_squared(p[c] - p[m]);
            new_.push_back({m, b, l});
            new_.push_back(from_a ? Triangle{a, m, l} : Triangle{a, m, c});
            new_.push_back(from_a ? Triangle{a, l, c} : Triangle{m, l, c});
        } else {
            new_.push_back({a, m, c});
            new_.push_back({m, b, c});
        }
    }

    /// Takes back the parts whose triangles cross others, have no area, or come next to others.
    bool drop() {
        std::vector<Triangle> faces = new_;
        faces.insert(faces.end(), near_.begin(), near_.end());
        std::vector<std::uint8_t> picked(faces.size());
        std::fill_n(picked.begin(), new_.size(), 1);
        const auto drop_at = [&](const Triangle& t) {
            for (const std::uint32_t v : t)
                if (v >= n_before_)
                    parts_[v - n_before_].dropped = true;
        };
        for (const Triangle& t : new_)
            if (is_needle(t))
                drop_at(t);
        for (const auto& [f, g] : crossing_pairs(mesh_.positions, faces, picked)) {
            drop_at(faces[f]);
            drop_at(faces[g]);
        }
        drop_close();
        const auto end =
            std::remove_if(parts_.begin(), parts_.end(), [](const Part& p) { return p.dropped; });
        const bool any = end != parts_.end();
        parts_.erase(end, parts_.end());
        return any;
    }
    bool is_needle(const Triangle& t) const {
        constexpr double kThin = 1e-3; // height over length
        const Vec3 ab = mesh_.positions[t[1]] - mesh_.positions[t[0]],
                   ac = mesh_.positions[t[2]] - mesh_.positions[t[0]], bc = ac - ab;
        return length(cross(ab, ac)) <=
               kThin * std::max({length_squared(ab), length_squared(ac), length_squared(bc)});
    }
    void drop_close() {
        const double least_m = kLeastApart * voxel_m_;
        std::vector<std::uint32_t> order(parts_.size());
        std::iota(order.begin(), order.end(), 0u);
        std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
            return std::pair(parts_[a].point.x, a) < std::pair(parts_[b].point.x, b);
        });
        for (std::size_t v = 0; v < mesh_.positions.size(); ++v) {
            const Vec3& p = mesh_.positions[v];
            auto at =
                std::lower_bound(order.begin(), order.end(), p.x - least_m,
                                 [&](std::uint32_t a, double x) { return parts_[a].point.x < x; });
            for (; at != order.end() && parts_[*at].point.x <= p.x + least_m; ++at)
                if (n_before_ + *at > v &&
                    length_squared(parts_[*at].point - p) < least_m * least_m)
                    parts_[*at].dropped = true;
        }
    }

    LabelledMesh& mesh_;
    const FieldProbe& field_;
    const Lattice& lattice_;
    double voxel_m_, bound_m_;
    std::size_t from_, n_before_;
    std::vector<Part> parts_;           ///< ascending
    std::vector<std::uint32_t> parted_; ///< triangles
    std::vector<Triangle> new_;         ///< what they become
    std::vector<std::ptrdiff_t> first_; ///< of new_, for each parted
    std::vector<Triangle> near_;
};

} // namespace

std::vector<std::uint32_t> part_long_triangles(LabelledMesh& mesh, const FieldProbe& field,
                                               const Lattice& lattice, double bound_vox,
                                               Certainty& certainty, Progress* progress) {
    constexpr int kRounds = 3; // edges to corners are long again
    std::vector<std::uint32_t> parents;
    std::size_t from = 0;
    for (int i = 0; i < kRounds; ++i) {
        const std::size_t next = mesh.positions.size();
        if (!Parts(mesh, field, lattice, bound_vox, from).run(parents, certainty, progress))
            break;
        from = next;
    }
    return parents;
}

} // namespace taihu
