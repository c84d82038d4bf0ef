#include "vdb_ops/winding_solid_detail.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>

#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include "stats/core/error.h"
#include "vdb_ops/closed_mesh.h"
#include "vdb_ops/columns_detail.h"
#include "vdb_ops/leaf_lists_detail.h"
#include "vdb_ops/mesh_cells_detail.h"
#include "vdb_ops/winding_tree_detail.h"

namespace taihu {
namespace {

using openvdb::Coord;
constexpr int kLeaf = 8;
constexpr double kSide = kLeaf - 1, kHalfDiagonal = 0.5 * kSide * std::numbers::sqrt3; // of leaves

Vec3 place(const Coord& c) {
    return {double(c.x()), double(c.y()), double(c.z())};
}

bool is_inside(double winding) {
    return std::fabs(winding) > 0.5;
}

class WindingSolid {
public:
    WindingSolid(const RepairedMesh& mesh, const Lattice& lattice)
        : lattice_(lattice), half_width_(lattice.half_width_vox) {
        points_.reserve(mesh.positions.size());
        for (const Vec3& p : mesh.positions)
            points_.push_back((p - lattice.origin) / lattice.voxel_m);
        for (const Vec3& p : points_)
            for (int axis = 0; axis < 3; ++axis)
                if (std::fabs(p[axis]) > kFarthestLeaf - 1024)
                    throw Error(Fault::bad_argument,
                                "voxelize: a mesh more than 2^20 voxels from the origin cannot be "
                                "closed by its winding number; use a larger voxel, or move it");
        faces_ = mesh.given();
        face_winding_ = std::make_unique<WindingTree>(points_, faces_);
        for (std::size_t f = mesh.n_given; f < mesh.triangles.size(); ++f) {
            const Triangle& t = mesh.triangles[f];
            split_cap({points_[t[0]], points_[t[1]], points_[t[2]]});
        }
        std::vector<Triangle> caps;
        for (std::uint32_t i = 0; i < cap_points_.size(); i += 3)
            caps.push_back({i, i + 1, i + 2});
        cap_winding_ = std::make_unique<WindingTree>(cap_points_, caps);
        count_columns(mesh);
    }

    openvdb::FloatGrid::Ptr run(Progress* progress) {
        find_surface_faces();
        check_cancelled(progress);
        const LeafLists faces(surface_, half_width_);
        faces_squared_.add(faces.keys(), [&](const Coord& leaf, LeafArray& squared) {
            squared.fill(half_width_ * half_width_);
            faces.nearer(surface_, leaf, half_width_, squared.data());
        });
        check_cancelled(progress);
        find_winding(faces.keys());
        check_cancelled(progress);
        find_crossings();
        check_cancelled(progress);
        const std::vector<LeafTriangle> level = level_triangles();
        const LeafLists lists(level, half_width_);
        check_cancelled(progress);
        return make_grid(level, lists);
    }

private:
    void count_columns(const RepairedMesh& mesh) {
        ClosedMesh closed;
        closed.triangles = mesh.triangles;
        closed.shell_of.assign(mesh.triangles.size(), 0);
        closed.shells.resize(1);
        Coord lo(kFarthestLeaf), hi(-kFarthestLeaf);
        for (const Triangle& t : mesh.triangles)
            for (const std::uint32_t v : t)
                for (int axis = 0; axis < 3; ++axis) {
                    lo[axis] = std::min(lo[axis], floor_int(points_[v][axis]) - 2);
                    hi[axis] = std::max(hi[axis], ceil_int(points_[v][axis]) + 2);
                }
        columns_ = std::make_unique<Columns>(closed, points_, openvdb::CoordBBox(lo, hi));
    }

    /// The parts of faces that lead from in to out, in pieces of at most 16 voxels.
    void find_surface_faces() {
        constexpr std::size_t kChunk = 64;
        std::vector<std::vector<LeafTriangle>> found((faces_.size() + kChunk - 1) / kChunk);
        tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t chunk) {
            for (std::size_t f = chunk * kChunk; f < std::min(faces_.size(), (chunk + 1) * kChunk);
                 ++f) {
                const Triangle& t = faces_[f];
                split_face({points_[t[0]], points_[t[1]], points_[t[2]]}, found[chunk]);
            }
        });
        for (const auto& part : found)
            surface_.insert(surface_.end(), part.begin(), part.end());
    }

    using Corners = std::array<Vec3, 3>;

    LeafTriangle leaf_triangle_of(const Corners& c) const {
        LeafTriangle t = leaf_triangle({0, 1, 2}, {c[0], c[1], c[2]}, 0, half_width_);
        t.n_edges = 3; // no neighbour shares them for certain
        return t;
    }

    static constexpr double kLargest = 16, kSmallest = 0.25; ///< longest edges [voxels]

    static double longest_edge(const Corners& c) {
        return std::max({length(c[1] - c[0]), length(c[2] - c[1]), length(c[0] - c[2])});
    }

    /// By the middle of the longest edge, so that needles do not multiply.
    static std::array<Corners, 2> halves(const Corners& c) {
        std::size_t k = 0;
        for (std::size_t e = 1; e < 3; ++e)
            if (length_squared(c[(e + 1) % 3] - c[e]) > length_squared(c[(k + 1) % 3] - c[k]))
                k = e;
        const Vec3 &a = c[k], &b = c[(k + 1) % 3], &top = c[(k + 2) % 3], middle = (a + b) / 2;
        return {Corners{a, middle, top}, {middle, b, top}};
    }

    void split_cap(const Corners& c) {
        if (longest_edge(c) <= kLargest)
            cap_points_.insert(cap_points_.end(), c.begin(), c.end());
        else
            for (const Corners& half : halves(c))
                split_cap(half);
    }

    void split_face(const Corners& c, std::vector<LeafTriangle>& out) const {
        const double longest = longest_edge(c);
        const Vec3 middle = (c[0] + c[1] + c[2]) / 3;
        const Vec3 normal = normalized(cross(c[1] - c[0], c[2] - c[0]));
        bool whole = longest <= kLargest;
        if (whole) {
            const bool surface = leads_out(middle, normal);
            for (std::size_t k = 0; k < 3 && longest > kSmallest && whole; ++k)
                whole = leads_out(middle + (c[k] - middle) * 0.8, normal) == surface;
            if (whole && surface)
                out.push_back(leaf_triangle_of(c));
        }
        if (!whole)
            for (const Corners& half : halves(c))
                split_face(half, out);
    }

    bool leads_out(const Vec3& p, const Vec3& normal) const {
        constexpr double kBeside = 1e-3; // voxels
        return is_inside(face_winding_->at(p + normal * kBeside)) !=
               is_inside(face_winding_->at(p - normal * kBeside));
    }

    /// Winding numbers wherever they may not be those of the capped mesh, and near surfaces.
    void find_winding(const std::vector<LeafKey>& near_faces) {
        std::vector<LeafTriangle> caps;
        for (std::size_t i = 0; i < cap_points_.size(); i += 3)
            caps.push_back(
                leaf_triangle_of({cap_points_[i], cap_points_[i + 1], cap_points_[i + 2]}));
        std::vector<LeafKey> todo = both(near_faces, LeafLists(caps, half_width_).keys());
        while (!todo.empty()) {
            std::vector<char> spreads(todo.size(), 0);
            winding_.add(todo, [&](const Coord& leaf, LeafArray& out) {
                const auto i = static_cast<std::size_t>(
                    std::lower_bound(todo.begin(), todo.end(), leaf_key(leaf)) - todo.begin());
                spreads[i] = leaf_winding(leaf, out);
            });
            std::vector<LeafKey> next;
            for (std::size_t i = 0; i < todo.size(); ++i)
                for (int n = 0; n < 6 && spreads[i]; ++n) {
                    Coord leaf = leaf_of_key(todo[i]);
                    leaf[n / 2] += n % 2 ? kLeaf : -kLeaf;
                    if (!winding_.find(leaf))
                        next.push_back(leaf_key(leaf));
                }
            std::sort(next.begin(), next.end());
            next.erase(std::unique(next.begin(), next.end()), next.end());
            todo = std::move(next);
        }
    }

    /// Whether caps alone may come to 1/2 somewhere in a leaf.
    bool caps_may_decide(const Coord& leaf) const {
        const Vec3 middle = place(leaf) + Vec3{kSide, kSide, kSide} / 2;
        if (cap_winding_->bound(middle, kHalfDiagonal) < 0.45)
            return false;
        if (cap_winding_->near(middle, kHalfDiagonal + 2 * kLeaf))
            return true;
        // Smooth over distances like that to the nearest cap: corners tell of what lies between.
        for (int corner = 0; corner < 8; ++corner)
            if (std::fabs(cap_winding_->at(place(leaf) + Vec3{kSide * (corner & 1),
                                                              kSide * (corner >> 1 & 1),
                                                              kSide * (corner >> 2)})) > 0.4)
                return true;
        return false;
    }

    /// True when caps alone come to 1/2 or more in it: its neighbours may be as it is. Harmonic
    /// functions have their extremes at their borders, so such places reach to a cap.
    bool leaf_winding(const Coord& leaf, LeafArray& out) const {
        const bool caps_matter = caps_may_decide(leaf);
        const bool smooth = caps_matter && smooth_winding(leaf, out);
        bool spreads = false;
        for (int x = 0; x < kLeaf; ++x)
            for (int y = 0; y < kLeaf; ++y) {
                std::int8_t row[kLeaf] = {};
                if (const Coord first = leaf.offsetBy(x, y, 0);
                    columns_->contains(first.x(), first.y()))
                    columns_->winding_row(first, 0, row);
                for (int z = 0; z < kLeaf; ++z) {
                    float& w = out[static_cast<std::size_t>(x * 64 + y * 8 + z)];
                    if (!smooth)
                        w = static_cast<float>(
                            caps_matter ? winding_by_caps(leaf.offsetBy(x, y, z), row[z]) : row[z]);
                    spreads = spreads || std::fabs(row[z] - w) > 0.45f;
                }
            }
        return spreads;
    }

    /// The count of the capped mesh at a voxel, less what its caps come to.
    double winding_by_caps(const Coord& voxel, int capped) const {
        bool on_cap = false;
        const double caps = cap_winding_->at(place(voxel), &on_cap);
        // On a cap its own side is a matter of rounding: without it there is none.
        return on_cap ? face_winding_->at(place(voxel)) : capped - caps;
    }

    /// Where no face is near, winding numbers are as smooth as it is far: a leaf's are linear
    /// between 2^3 places of it from 32 voxels, 3^3 from 16, within 0.02. False: faces are near.
    bool smooth_winding(const Coord& leaf, LeafArray& out) const {
        const Vec3 middle = place(leaf) + Vec3{kSide, kSide, kSide} / 2;
        if (face_winding_->near(middle, kHalfDiagonal + 16))
            return false;
        const std::size_t n = face_winding_->near(middle, kHalfDiagonal + 32) ? 3 : 2;
        const double step = kSide / double(n - 1);
        std::array<double, 27> w{};
        for (std::size_t i = 0; i < n * n * n; ++i)
            w[i] = face_winding_->at(
                place(leaf) + Vec3{double(i / (n * n)), double(i / n % n), double(i % n)} * step);
        for (std::size_t v = 0; v < 512; ++v) {
            std::array<std::size_t, 3> cell{v / 64, v / 8 % 8, v % 8};
            std::array<double, 3> u{};
            for (std::size_t axis = 0; axis < 3; ++axis) {
                u[axis] = double(cell[axis]) / step;
                cell[axis] = std::min(static_cast<std::size_t>(u[axis]), n - 2);
                u[axis] -= double(cell[axis]);
            }
            double sum = 0;
            for (std::size_t c = 0; c < 8; ++c) {
                const std::size_t i = c >> 2, j = c >> 1 & 1, k = c & 1;
                sum += (i ? u[0] : 1 - u[0]) * (j ? u[1] : 1 - u[1]) * (k ? u[2] : 1 - u[2]) *
                       w[((cell[0] + i) * n + cell[1] + j) * n + cell[2] + k];
            }
            out[v] = static_cast<float>(sum);
        }
        return true;
    }

    double winding_at(const Coord& voxel) const {
        const LeafArray* values = winding_.find(leaf_of(voxel));
        return values ? double((*values)[index_in_leaf(voxel)]) : columns_->winding(voxel, 0);
    }
    double faces_distance(const Coord& voxel) const {
        const LeafArray* squared = faces_squared_.find(leaf_of(voxel));
        return squared ? std::sqrt(double((*squared)[index_in_leaf(voxel)])) : double(half_width_);
    }

    /// Where the surface passes an edge of the lattice, from a voxel of a leaf along an axis.
    struct Crossing {
        int edge = 0;      ///< 3 * voxel + axis
        double t = 0;      ///< from the voxel [voxels]
        bool face = false; ///< through a face, which is there already
    };

    /// Those of leaf `i`. Outside of the leaves of winding_ there is none: surfaces that are faces
    /// lie well within, the level in openings spreads.
    std::vector<Crossing> leaf_crossings(std::size_t i) const {
        const Coord leaf = leaf_of_key(winding_.keys()[i]);
        const LeafArray& w = winding_[i];
        std::vector<Crossing> out;
        for (int v = 0; v < 512; ++v)
            for (int axis = 0; axis < 3; ++axis) {
                const Coord a = leaf.offsetBy(v / 64, v / 8 % 8, v % 8);
                Coord b = a;
                ++b[axis];
                const bool within = (b[axis] & 7) != 0;
                const double wa = double(w[static_cast<std::size_t>(v)]);
                const double wb = within ? double(w[index_in_leaf(b)]) : winding_at(b);
                if (is_inside(wa) == is_inside(wb))
                    continue;
                const double da = faces_distance(a), db = faces_distance(b);
                Crossing c;
                c.edge = 3 * v + axis;
                // Over a face winding numbers jump by 1.
                c.face = da + db <= 1 + 1e-3 && std::fabs(wa - wb) > 0.5;
                c.t = c.face ? (da + db > 0 ? da / (da + db) : 0.5)
                             : level_between(place(a), axis, wa, wb);
                out.push_back(c);
            }
        return out;
    }

    void find_crossings() {
        crossings_.resize(winding_.keys().size());
        tbb::parallel_for(std::size_t{0}, crossings_.size(),
                          [this](std::size_t i) { crossings_[i] = leaf_crossings(i); });
    }

    std::optional<Vec3> crossing(const Coord& a, int axis) const {
        const std::size_t i = winding_.number(leaf_of(a));
        if (i == crossings_.size())
            return std::nullopt;
        const int edge = 3 * static_cast<int>(index_in_leaf(a)) + axis;
        const auto& here = crossings_[i];
        const auto at = std::lower_bound(here.begin(), here.end(), edge,
                                         [](const Crossing& c, int e) { return c.edge < e; });
        if (at == here.end() || at->edge != edge)
            return std::nullopt;
        return along(a, axis, at->t);
    }

    static Vec3 along(const Coord& a, int axis, double t) {
        Vec3 p = place(a);
        p[axis] += t;
        return p;
    }

    /// Regula falsi for |w| = 1/2 on an edge, by the Illinois rule.
    double level_between(const Vec3& a, int axis, double wa, double wb) const {
        double lo = 0, hi = 1, f_lo = std::fabs(wa) - 0.5, f_hi = std::fabs(wb) - 0.5, t = 0.5;
        for (int i = 0; i < 4; ++i) {
            t = std::clamp(lo + (hi - lo) * f_lo / (f_lo - f_hi), lo + 0.01 * (hi - lo),
                           hi - 0.01 * (hi - lo));
            Vec3 p = a;
            p[axis] += t;
            const double f = std::fabs(face_winding_->at(p)) - 0.5;
            if ((f > 0) == (f_lo > 0)) {
                lo = t, f_lo = f;
                f_hi /= 2;
            } else {
                hi = t, f_hi = f;
                f_lo /= 2;
            }
        }
        return t;
    }

    /// The mean of a cell's crossings.
    Vec3 cell_vertex(const Coord& cell) const {
        Vec3 sum;
        int n = 0;
        for (int axis = 0; axis < 3; ++axis)
            for (int corner = 0; corner < 4; ++corner) {
                Coord a = cell;
                a[(axis + 1) % 3] += corner & 1;
                a[(axis + 2) % 3] += corner >> 1;
                if (const auto c = crossing(a, axis)) {
                    sum += *c;
                    ++n;
                }
            }
        return sum / n;
    }

    /// The level in openings: round each crossing, triangles to the vertices of its four cells.
    std::vector<LeafTriangle> level_triangles() const {
        std::vector<std::vector<LeafTriangle>> found(crossings_.size());
        tbb::parallel_for(std::size_t{0}, crossings_.size(), [&](std::size_t i) {
            const Coord leaf = leaf_of_key(winding_.keys()[i]);
            for (const Crossing& c : crossings_[i])
                if (const int v = c.edge / 3; !c.face)
                    round_crossing(leaf.offsetBy(v / 64, v / 8 % 8, v % 8), c.edge % 3, c.t,
                                   found[i]);
        });
        std::vector<LeafTriangle> all;
        for (const auto& part : found)
            all.insert(all.end(), part.begin(), part.end());
        return all;
    }

    void round_crossing(const Coord& a, int axis, double t, std::vector<LeafTriangle>& out) const {
        static constexpr std::array<std::pair<int, int>, 4> kRound = {
            {{0, 0}, {-1, 0}, {-1, -1}, {0, -1}}};
        std::array<Vec3, 4> vertex;
        for (std::size_t k = 0; k < 4; ++k) {
            Coord cell = a;
            cell[(axis + 1) % 3] += kRound[k].first;
            cell[(axis + 2) % 3] += kRound[k].second;
            vertex[k] = cell_vertex(cell);
        }
        for (std::size_t k = 0; k < 4; ++k)
            out.push_back(leaf_triangle_of({along(a, axis, t), vertex[k], vertex[(k + 1) % 4]}));
    }

    openvdb::FloatGrid::Ptr make_grid(const std::vector<LeafTriangle>& level,
                                      const LeafLists& lists) const {
        using Leaf = openvdb::FloatTree::LeafNodeType;
        const std::vector<LeafKey> keys = both(faces_squared_.keys(), lists.keys());
        std::vector<std::unique_ptr<Leaf>> leaves(keys.size());
        const float background = half_width_ * static_cast<float>(lattice_.voxel_m);
        tbb::parallel_for(std::size_t{0}, keys.size(), [&](std::size_t i) {
            const Coord origin = leaf_of_key(keys[i]);
            alignas(64) float squared[512];
            const LeafArray *near = faces_squared_.find(origin), *winding = winding_.find(origin);
            for (std::size_t v = 0; v < 512; ++v)
                squared[v] = near ? (*near)[v] : half_width_ * half_width_;
            lists.nearer(level, origin, half_width_, squared);
            auto leaf = std::make_unique<Leaf>(origin, background, false);
            bool any = false;
            for (openvdb::Index v = 0; v < 512; ++v) {
                const bool in =
                    is_inside(winding ? double((*winding)[v])
                                      : columns_->winding(origin + Leaf::offsetToLocalCoord(v), 0));
                const float d = std::min(
                    std::sqrt(squared[v]) * static_cast<float>(lattice_.voxel_m), background);
                any = any || d < background;
                leaf->setValueOnly(v, in ? -d : d);
                leaf->setActiveState(v, d < background);
            }
            if (any)
                leaves[i] = std::move(leaf);
        });
        auto grid = openvdb::FloatGrid::create(background);
        grid->setTransform(openvdb::math::Transform::createLinearTransform(lattice_.voxel_m));
        grid->transform().postTranslate({lattice_.origin.x, lattice_.origin.y, lattice_.origin.z});
        grid->setGridClass(openvdb::GRID_LEVEL_SET);
        grid->setName("solid");
        for (auto& leaf : leaves)
            if (leaf)
                grid->tree().addLeaf(leaf.release());
        openvdb::tools::signedFloodFill(grid->tree());
        return grid;
    }

    const Lattice lattice_;
    const float half_width_;
    std::vector<Vec3> points_;     // in voxels
    std::vector<Vec3> cap_points_; // in voxels: three for each part of a cap
    std::vector<Triangle> faces_;
    std::unique_ptr<WindingTree> face_winding_, cap_winding_;
    std::unique_ptr<Columns> columns_;  // of faces and caps
    std::vector<LeafTriangle> surface_; // parts of faces
    LeafValues faces_squared_, winding_;
    std::vector<std::vector<Crossing>> crossings_; ///< one list per leaf of winding_, by edge
};

} // namespace

openvdb::FloatGrid::Ptr winding_level_set(const RepairedMesh& mesh, const Lattice& lattice,
                                          Progress* progress) {
    return WindingSolid(mesh, lattice).run(progress);
}

} // namespace taihu
