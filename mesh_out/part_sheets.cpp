#include "mesh_out/part_sheets_detail.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "mesh_out/crossings_detail.h"
#include "stats/core/box.h"

namespace taihu {
namespace {

/// The faces of a vertex and those that they may meet.
class Surroundings {
public:
    Surroundings(const TriMesh& mesh, std::uint32_t vertex, double reach_m) : vertex_(vertex) {
        Box around;
        for (const Triangle& t : mesh.triangles)
            if (has(t))
                for (const std::uint32_t v : t)
                    around.include(mesh.positions[v]);
        around = around.dilated(reach_m);
        for (const Triangle& t : mesh.triangles) {
            Box box;
            for (const std::uint32_t v : t)
                box.include(mesh.positions[v]);
            if (meet(box, around)) {
                faces_.push_back(t);
                own_.push_back(has(t));
            }
        }
        renumber(mesh.positions);
        for (std::size_t f = 0; f < faces_.size(); ++f)
            boxes_.push_back(box_of(f));
    }
    /// Pairs that cross with the vertex at `p`; more than there can be where it must not be.
    std::size_t n_crossings(const Vec3& p) {
        positions_[vertex_] = p;
        std::size_t n = 0;
        for (std::size_t f = 0; f < faces_.size(); ++f) {
            const Triangle& t = faces_[f];
            const auto is_there = [&](std::uint32_t v) {
                return v != vertex_ && positions_[v] == p;
            };
            if (std::any_of(t.begin(), t.end(), is_there) ||
                (own_[f] && is_flat(positions_[t[0]], positions_[t[1]], positions_[t[2]])))
                n = faces_.size() * faces_.size();
        }
        for (std::size_t f = 0; n == 0 && f < faces_.size(); ++f)
            if (own_[f])
                boxes_[f] = box_of(f);
        if (n > 0)
            return n;
        for (std::size_t f = 0; f < faces_.size(); ++f)
            for (std::size_t g = 0; own_[f] && g < faces_.size(); ++g)
                n += g != f && !(own_[g] && g < f) && meet(boxes_[f], boxes_[g]) &&
                     faces_cross(positions_, faces_[f], faces_[g]);
        return n;
    }

private:
    bool has(const Triangle& t) const { return std::find(t.begin(), t.end(), vertex_) != t.end(); }

    /// Few vertices, so that a test costs what few faces do.
    void renumber(const std::vector<Vec3>& positions) {
        std::vector<std::uint32_t> used;
        for (const Triangle& t : faces_)
            used.insert(used.end(), t.begin(), t.end());
        std::sort(used.begin(), used.end());
        used.erase(std::unique(used.begin(), used.end()), used.end());
        const auto number = [&](std::uint32_t v) {
            return static_cast<std::uint32_t>(std::lower_bound(used.begin(), used.end(), v) -
                                              used.begin());
        };
        for (Triangle& t : faces_)
            for (std::uint32_t& v : t)
                v = number(v);
        vertex_ = number(vertex_);
        for (const std::uint32_t v : used)
            positions_.push_back(positions[v]);
    }

    Box box_of(std::size_t f) const {
        Box box;
        for (const std::uint32_t v : faces_[f])
            box.include(positions_[v]);
        return box;
    }
    static bool meet(const Box& a, const Box& b) {
        for (int axis = 0; axis < 3; ++axis)
            if (a.lo[axis] > b.hi[axis] || a.hi[axis] < b.lo[axis])
                return false;
        return true;
    }

    std::uint32_t vertex_;
    std::vector<Vec3> positions_;
    std::vector<Triangle> faces_;
    std::vector<std::uint8_t> own_;
    std::vector<Box> boxes_;
};

void move_apart(TriMesh& mesh, std::uint32_t vertex, const PositionGrid& grid, double most_m) {
    Surroundings around(mesh, vertex, most_m);
    const Vec3 from = mesh.positions[vertex];
    const double widest = std::exp2(grid.bits) - 1;
    std::size_t least = around.n_crossings(from);
    Vec3 best = from;
    for (double by = 1; least > 0 && by * grid.step_m <= most_m; by *= 4)
        for (int k = 0; least > 0 && k < 27; ++k) {
            const Vec3 to =
                from + Vec3{double(k / 9 - 1), double(k / 3 % 3 - 1), double(k % 3 - 1)} *
                           (by * grid.step_m);
            const Vec3 at = (to - grid.origin) / grid.step_m;
            if (std::min({at.x, at.y, at.z}) < 0 || std::max({at.x, at.y, at.z}) > widest)
                continue;
            if (const std::size_t n = around.n_crossings(to); n < least) {
                least = n;
                best = to;
            }
        }
    mesh.positions[vertex] = best;
}

} // namespace

void part_sheets(TriMesh& mesh, const PositionGrid& grid, double most_m) {
    constexpr int kPasses = 4;
    constexpr std::size_t kMostPairs = 2000; // more are no accident of rounding
    for (int pass = 0; pass < kPasses; ++pass) {
        const auto pairs = crossing_pairs(mesh.positions, mesh.triangles);
        if (pairs.empty() || pairs.size() > kMostPairs)
            return;
        std::vector<std::uint32_t> vertices;
        for (const auto& [f, g] : pairs)
            for (const std::uint32_t face : {f, g})
                vertices.insert(vertices.end(), mesh.triangles[face].begin(),
                                mesh.triangles[face].end());
        std::sort(vertices.begin(), vertices.end());
        vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
        for (const std::uint32_t v : vertices)
            move_apart(mesh, v, grid, most_m);
    }
}

} // namespace taihu
