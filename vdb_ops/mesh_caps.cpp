#include "vdb_ops/mesh_caps_detail.h"

#include <algorithm>
#include <cmath>
#include <compare>
#include <limits>
#include <optional>

#include "stats/core/box.h"
#include "stats/core/polygon.h"

namespace taihu {
namespace {

using Index = std::uint32_t;

/// A directed edge that the faces of a shell leave unbalanced.
struct Arc {
    Index shell, from, to;
    auto operator<=>(const Arc&) const = default;
};

/// Corners in the order in which a cap passes them, so that its faces point outwards.
struct Loop {
    Index shell;
    std::vector<Index> corners;
};

/// The boundary chain, reversed, as simple loops.
class LoopFinder {
public:
    LoopFinder(const RepairedMesh& mesh, const std::vector<HalfEdge>& halves)
        : place_(mesh.positions.size(), kNoVertex) {
        each_edge(halves, [&](const HalfEdge* begin, const HalfEdge* end) {
            int net = 0;
            for (const HalfEdge* h = begin; h != end; ++h)
                net += h->direction;
            const Index from = net > 0 ? begin->high : begin->low;
            const Index to = net > 0 ? begin->low : begin->high;
            for (int k = 0; k < std::abs(net); ++k)
                arcs_.push_back({mesh.shell_of[begin->face], from, to});
        });
        std::sort(arcs_.begin(), arcs_.end());
        n_used_.resize(arcs_.size(), 0);
        used_.resize(arcs_.size(), 0);
    }

    std::vector<Loop> run() {
        for (std::size_t i = 0; i < arcs_.size(); ++i) {
            if (used_[i])
                continue;
            const Index shell = arcs_[i].shell, start = arcs_[i].from;
            path_.assign(1, start);
            place_[start] = 0;
            for (auto at = leave(shell, start); at; at = leave(shell, *at)) {
                if (place_[*at] != kNoVertex) { // met again: closes a loop; the rest goes on
                    cut(shell, place_[*at]);
                } else {
                    place_[*at] = static_cast<Index>(path_.size());
                    path_.push_back(*at);
                }
            }
            for (const Index v : path_)
                place_[v] = kNoVertex;
        }
        return std::move(loops_);
    }

private:
    /// Where the first arc from `from` goes that was not taken yet, now taken.
    std::optional<Index> leave(Index shell, Index from) {
        const auto first = static_cast<std::size_t>(
            std::lower_bound(arcs_.begin(), arcs_.end(), Arc{shell, from, 0}) - arcs_.begin());
        if (first == arcs_.size())
            return std::nullopt;
        const std::size_t next = first + n_used_[first];
        if (next >= arcs_.size() || arcs_[next].shell != shell || arcs_[next].from != from)
            return std::nullopt;
        ++n_used_[first];
        used_[next] = 1;
        return arcs_[next].to;
    }

    void cut(Index shell, Index from) {
        const auto first = path_.begin() + from;
        if (path_.end() - first > 2) // an edge and its reverse close nothing
            loops_.push_back({shell, {first, path_.end()}});
        for (auto v = first + 1; v != path_.end(); ++v)
            place_[*v] = kNoVertex;
        path_.erase(first + 1, path_.end());
    }

    std::vector<Arc> arcs_;
    std::vector<std::size_t> n_used_; ///< of the arcs from one vertex, at the first of them
    std::vector<char> used_;
    std::vector<Index> path_, place_; ///< place_: where in the path a vertex stands
    std::vector<Loop> loops_;
};

class Caps {
public:
    explicit Caps(RepairedMesh& mesh) : mesh_(mesh) {}

    void cap(const Loop& loop) {
        if (loop.corners.size() == 3)
            return add(loop.shell, loop.corners[0], loop.corners[1], loop.corners[2]);
        const Vec3 middle = info(loop).center;
        std::vector<Triangle> ears;
        if (!seen_whole(loop, middle) && triangulate(mesh_.positions, loop.corners, ears)) {
            for (const Triangle& t : ears)
                add(loop.shell, t[0], t[1], t[2]);
            return;
        }
        const auto m = static_cast<Index>(mesh_.positions.size());
        mesh_.positions.push_back(middle);
        for (std::size_t k = 0; k < loop.corners.size(); ++k)
            add(loop.shell, loop.corners[k], next(loop, k), m);
    }

    /// A wall from the loop to where dot(p, normal) = height, and the base there.
    void wall_and_base(const Loop& loop, const Vec3& normal, double height) {
        Loop base{loop.shell, {}};
        const double flat_m = 1e-12 * info(loop).perimeter_m;
        bool flat = true;
        for (const Index v : loop.corners) {
            const Vec3 p = mesh_.positions[v];
            const double up = height - dot(p, normal);
            flat = flat && std::fabs(up) <= flat_m;
            base.corners.push_back(static_cast<Index>(mesh_.positions.size()));
            mesh_.positions.push_back(p + normal * up);
        }
        if (flat) { // the walls would have no height
            mesh_.positions.resize(mesh_.positions.size() - loop.corners.size());
            return cap(loop);
        }
        for (std::size_t k = 0; k < loop.corners.size(); ++k) {
            const Index a = loop.corners[k], b = next(loop, k);
            add(loop.shell, a, b, next(base, k));
            add(loop.shell, a, next(base, k), base.corners[k]);
        }
        cap(base);
    }

    Vec3 area_vector(const Loop& loop) const {
        const Vec3 first = mesh_.positions[loop.corners[0]];
        Vec3 sum;
        for (std::size_t k = 1; k + 1 < loop.corners.size(); ++k)
            sum += cross(mesh_.positions[loop.corners[k]] - first,
                         mesh_.positions[loop.corners[k + 1]] - first);
        return sum * 0.5;
    }

    CappedLoop info(const Loop& loop) const {
        CappedLoop info;
        info.n_edges = loop.corners.size();
        for (std::size_t k = 0; k < loop.corners.size(); ++k) {
            const Vec3 &p = mesh_.positions[loop.corners[k]], &q = mesh_.positions[next(loop, k)];
            const double l = length(q - p);
            info.center += (p + q) * (0.5 * l);
            info.perimeter_m += l;
        }
        info.center *= 1 / info.perimeter_m;
        return info;
    }

    double farthest(const std::vector<Index>& corners, const Vec3& normal) const {
        double most = -std::numeric_limits<double>::infinity();
        for (const Index v : corners)
            most = std::max(most, dot(mesh_.positions[v], normal));
        return most;
    }

private:
    static Index next(const Loop& loop, std::size_t k) {
        return loop.corners[k + 1 < loop.corners.size() ? k + 1 : 0];
    }

    bool seen_whole(const Loop& loop, const Vec3& middle) const {
        const Vec3 normal = area_vector(loop);
        for (std::size_t k = 0; k < loop.corners.size(); ++k)
            if (!(dot(cross(mesh_.positions[loop.corners[k]] - middle,
                            mesh_.positions[next(loop, k)] - middle),
                      normal) >= 0))
                return false;
        return true;
    }

    void add(Index shell, Index a, Index b, Index c) {
        mesh_.triangles.push_back({a, b, c});
        mesh_.shell_of.push_back(shell);
        mesh_.cap_area_m2[shell] += 0.5 * length(cross(mesh_.positions[b] - mesh_.positions[a],
                                                       mesh_.positions[c] - mesh_.positions[a]));
    }

    RepairedMesh& mesh_;
};

/// Under CloseRule::plane.
class Bases {
public:
    Bases(RepairedMesh& mesh, std::vector<Loop> loops) : caps_(mesh), loops_(std::move(loops)) {
        area_m2_.resize(mesh.cap_area_m2.size(), 0);
        opening_m2_.resize(area_m2_.size(), 0);
        longest_.resize(area_m2_.size(), loops_.size());
        boxes_.resize(area_m2_.size());
        for (std::size_t f = 0; f < mesh.n_given; ++f) {
            const Triangle& t = mesh.triangles[f];
            const Vec3 &a = mesh.positions[t[0]], &b = mesh.positions[t[1]],
                       &c = mesh.positions[t[2]];
            area_m2_[mesh.shell_of[f]] += 0.5 * length(cross(b - a, c - a));
            for (const Vec3& p : {a, b, c})
                boxes_[mesh.shell_of[f]].include(p);
        }
        for (std::size_t i = 0; i < loops_.size(); ++i) {
            const Index s = loops_[i].shell;
            opening_m2_[s] += length(caps_.area_vector(loops_[i]));
            if (longest_[s] == loops_.size() || perimeter(i) > perimeter(longest_[s]))
                longest_[s] = i;
        }
    }

    void run() {
        for (std::size_t i = 0; i < loops_.size(); ++i) {
            const Loop& loop = loops_[i];
            Vec3 normal = normalized(caps_.area_vector(loop));
            const bool sheet = is_sheet(loop.shell);
            if (length_squared(normal) == 0 || (sheet && longest_[loop.shell] != i)) {
                caps_.cap(loop);
                continue;
            }
            double height = caps_.farthest(loop.corners, normal);
            if (sheet)
                height = lowest(loop.shell, normal) +
                         kSheetThickness * length(boxes_[loop.shell].size());
            caps_.wall_and_base(loop, normal, height);
        }
    }

private:
    static constexpr double kSheetThickness = 0.05; ///< of its diagonal

    double perimeter(std::size_t i) const { return caps_.info(loops_[i]).perimeter_m; }

    /// Openings as large as the shell: as closed_mesh.cpp's threshold for what has no inside.
    bool is_sheet(Index shell) const {
        return opening_m2_[shell] > 0.45 * (opening_m2_[shell] + area_m2_[shell]);
    }

    /// How far the shell's box reaches along the normal.
    double lowest(Index shell, const Vec3& normal) const {
        const Box& box = boxes_[shell];
        double most = 0;
        for (int axis = 0; axis < 3; ++axis)
            most += std::max(box.lo[axis] * normal[axis], box.hi[axis] * normal[axis]);
        return most;
    }

    Caps caps_;
    std::vector<Loop> loops_;
    // One per shell.
    std::vector<double> area_m2_, opening_m2_;
    std::vector<std::size_t> longest_;
    std::vector<Box> boxes_;
};

} // namespace

void close_loops(RepairedMesh& mesh, const std::vector<HalfEdge>& halves, bool flat_bases) {
    std::vector<Loop> loops = LoopFinder(mesh, halves).run();
    Caps caps(mesh);
    for (const Loop& loop : loops)
        mesh.diagnosis.loops.push_back(caps.info(loop));
    if (flat_bases)
        return Bases(mesh, std::move(loops)).run();
    for (const Loop& loop : loops)
        caps.cap(loop);
}

} // namespace taihu
