#include "vdb_ops/mesh_repair.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <tuple>
#include <utility>

#include <tbb/parallel_for.h>

namespace taihu {
namespace {

using Index = std::uint32_t;
constexpr Index kNone = ~Index{0};

/// Union-find that also carries whether an element is flipped against its root. The smaller index
/// becomes the root, so the result does not depend on the order of the joins.
class ParityUnion {
public:
    explicit ParityUnion(std::size_t n) : parent_(n), flipped_(n, 0) {
        std::iota(parent_.begin(), parent_.end(), Index{0});
    }
    std::pair<Index, bool> find(Index i) {
        Index root = i;
        char sum = 0;
        while (parent_[root] != root) {
            sum ^= flipped_[root];
            root = parent_[root];
        }
        const bool result = sum != 0;
        for (Index j = i; parent_[j] != root && j != root;) { // path compression
            const Index next = parent_[j];
            const char own = flipped_[j];
            parent_[j] = root;
            flipped_[j] = sum;
            sum ^= own;
            j = next;
        }
        return {root, result};
    }
    /// False when `a` and `b` are already joined the other way round.
    bool join(Index a, Index b, bool flipped) {
        auto ra = find(a), rb = find(b);
        if (ra.first == rb.first)
            return (ra.second != rb.second) == flipped;
        if (ra.first > rb.first)
            std::swap(ra, rb);
        parent_[rb.first] = ra.first;
        flipped_[rb.first] = static_cast<char>((ra.second != rb.second) != flipped);
        return true;
    }

private:
    std::vector<Index> parent_;
    std::vector<char> flipped_;
};

/// Positions welded when equal (tolerance 0) or when within the tolerance of an earlier one.
std::vector<Index> weld(const std::vector<Vec3>& points, double tolerance, std::vector<Vec3>& out) {
    const auto key = [tolerance](const Vec3& p) {
        return tolerance > 0 ? Vec3{std::floor(p.x / tolerance), std::floor(p.y / tolerance),
                                    std::floor(p.z / tolerance)}
                             : p + Vec3{}; // -0 becomes 0
    };
    const auto hash = [](const Vec3& p) {
        std::uint64_t h = 0;
        for (int axis = 0; axis < 3; ++axis)
            h = (h ^ std::bit_cast<std::uint64_t>(p[axis] + 0.0)) * 0x9E3779B97F4A7C15ull,
            h ^= h >> 32;
        return h;
    };
    const std::size_t capacity = std::bit_ceil(2 * points.size() + 16);
    std::vector<Index> slots(capacity, kNone), id(points.size(), kNone);
    const auto find = [&](const Vec3& cell, const Vec3& p) {
        for (std::size_t s = hash(cell) & (capacity - 1); slots[s] != kNone;
             s = (s + 1) & (capacity - 1)) {
            const Vec3& q = out[slots[s]];
            if (tolerance > 0 ? key(q) == cell && length(q - p) <= tolerance : q == p)
                return slots[s];
        }
        return kNone;
    };
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Vec3 p = points[i] + Vec3{}, cell = key(p);
        if (!is_finite(p))
            continue; // faces that use it are dropped
        Index found = kNone;
        for (int n = 0; n < (tolerance > 0 ? 27 : 1) && found == kNone; ++n)
            found = find(tolerance > 0 ? cell + Vec3{double(n % 3 - 1), double(n / 3 % 3 - 1),
                                                     double(n / 9 - 1)}
                                       : p,
                         p);
        if (found == kNone) {
            found = static_cast<Index>(out.size());
            out.push_back(p);
            std::size_t s = hash(tolerance > 0 ? cell : p) & (capacity - 1);
            while (slots[s] != kNone)
                s = (s + 1) & (capacity - 1);
            slots[s] = found;
        }
        id[i] = found;
    }
    return id;
}

/// A face's use of an undirected edge.
struct Half {
    Index low, high; ///< its two vertices
    Index face;
    int direction; ///< +1 when the face runs from low to high
};

/// All halves, grouped by edge, faces ascending in each group.
std::vector<Half> sorted_halves(const std::vector<Triangle>& faces, std::size_t n_vertices) {
    std::vector<Index> first(n_vertices + 1, 0);
    const auto each = [&](auto&& fn) {
        for (Index f = 0; f < faces.size(); ++f)
            for (int k = 0; k < 3; ++k) {
                const Index a = faces[f][static_cast<std::size_t>(k)];
                const Index b = faces[f][static_cast<std::size_t>((k + 1) % 3)];
                fn(Half{std::min(a, b), std::max(a, b), f, a < b ? 1 : -1});
            }
    };
    each([&](const Half& h) { ++first[h.low + 1]; });
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<Half> halves(3 * faces.size());
    std::vector<Index> next(first.begin(), first.end() - 1);
    each([&](const Half& h) { halves[next[h.low]++] = h; });
    tbb::parallel_for(std::size_t{0}, n_vertices, [&](std::size_t v) {
        std::sort(halves.begin() + first[v], halves.begin() + first[v + 1],
                  [](const Half& a, const Half& b) {
                      return std::tie(a.high, a.face) < std::tie(b.high, b.face);
                  });
    });
    return halves;
}

/// Calls fn(begin, end) for the halves of each edge.
template <class Fn>
void each_edge(const std::vector<Half>& halves, Fn&& fn) {
    for (std::size_t i = 0, j = 0; i < halves.size(); i = j) {
        while (j < halves.size() && halves[j].low == halves[i].low &&
               halves[j].high == halves[i].high)
            ++j;
        fn(halves.data() + i, halves.data() + j);
    }
}

Index third_vertex(const Triangle& face, const Half& h) {
    return face[0] ^ face[1] ^ face[2] ^ h.low ^ h.high;
}

class Repair {
public:
    Repair(const TriMesh& mesh, double tolerance) {
        out_.diagnosis.n_faces = mesh.triangles.size();
        out_.diagnosis.weld_tolerance_m = tolerance;
        const std::vector<Index> id = weld(mesh.positions, tolerance, out_.positions);
        for (const Triangle& t : mesh.triangles) {
            Triangle face{};
            bool good = true;
            for (std::size_t k = 0; k < 3; ++k) {
                good = good && t[k] < id.size() && id[t[k]] != kNone;
                face[k] = good ? id[t[k]] : 0;
            }
            if (!good)
                ++out_.diagnosis.n_bad;
            else if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0])
                ++out_.diagnosis.n_repeated;
            else
                out_.triangles.push_back(face);
        }
    }

    RepairedMesh run(CloseRule rule) {
        drop_duplicates();
        orient();
        number_shells();
        if (rule == CloseRule::loops)
            cap_loops();
        return std::move(out_);
    }

private:
    void drop_duplicates() {
        std::vector<char> keep(out_.triangles.size(),
                               1); // 2: kept only if every face is given twice
        MeshDiagnosis& d = out_.diagnosis;
        each_edge(sorted_halves(out_.triangles, out_.positions.size()), [&](const Half* begin,
                                                                            const Half* end) {
            for (const Half* a = begin; a != end; ++a)
                for (const Half* b = a + 1; b != end && keep[a->face] == 1; ++b) {
                    if (keep[b->face] != 1 || third_vertex(out_.triangles[a->face], *a) !=
                                                  third_vertex(out_.triangles[b->face], *b))
                        continue;
                    keep[b->face] = 0;
                    if (a->direction == b->direction) {
                        ++d.n_duplicate;
                    } else { // front and back
                        ++d.n_opposite_pairs;
                        keep[a->face] = 2;
                    }
                }
        });
        if (d.n_duplicate + d.n_opposite_pairs == 0)
            return;
        // A pair here and there is a wall without thickness: both sides go.
        d.two_sided = 4 * d.n_opposite_pairs > out_.triangles.size();
        std::size_t n = 0;
        for (std::size_t f = 0; f < out_.triangles.size(); ++f)
            if (keep[f] == 1 || (keep[f] == 2 && d.two_sided))
                out_.triangles[n++] = out_.triangles[f];
        out_.triangles.resize(n);
    }

    /// Neighbours over edges of two faces get one side; the majority of a patch keeps its own.
    void orient() {
        MeshDiagnosis& d = out_.diagnosis;
        ParityUnion sides(out_.triangles.size());
        each_edge(sorted_halves(out_.triangles, out_.positions.size()),
                  [&](const Half* a, const Half* end) {
                      const auto n = end - a;
                      d.n_open_edges += n == 1;
                      d.n_nonmanifold_edges += n > 2;
                      if (n != 2)
                          return;
                      const bool flipped = a[0].direction == a[1].direction;
                      d.n_flipped_edges += flipped;
                      d.n_one_sided += !sides.join(a[0].face, a[1].face, flipped);
                  });
        if (d.n_flipped_edges == 0)
            return;
        std::vector<std::int64_t> votes(out_.triangles.size(), 0);
        for (Index f = 0; f < out_.triangles.size(); ++f) {
            const auto [root, flipped] = sides.find(f);
            votes[root] += flipped ? -1 : 1;
        }
        for (Index f = 0; f < out_.triangles.size(); ++f) {
            const auto [root, flipped] = sides.find(f);
            if ((votes[root] >= 0) == flipped)
                std::swap(out_.triangles[f][1], out_.triangles[f][2]);
        }
    }

    void number_shells() {
        ParityUnion connected(out_.triangles.size());
        halves_ = sorted_halves(out_.triangles, out_.positions.size());
        each_edge(halves_, [&](const Half* begin, const Half* end) {
            for (const Half* h = begin + 1; h < end; ++h)
                connected.join(begin->face, h->face, false);
        });
        std::vector<Index> number(out_.triangles.size(), kNone);
        out_.shell_of.resize(out_.triangles.size());
        for (Index f = 0; f < out_.triangles.size(); ++f) {
            Index& n = number[connected.find(f).first];
            if (n == kNone) {
                n = static_cast<Index>(out_.cap_area_m2.size());
                out_.cap_area_m2.push_back(0);
            }
            out_.shell_of[f] = n;
        }
    }

    /// A directed edge that the faces of a shell leave unbalanced.
    struct Arc {
        Index shell, from, to;
        auto operator<=>(const Arc&) const = default;
    };

    /// The boundary chain, reversed, is a set of closed loops; each simple one gets a fan.
    void cap_loops() {
        std::vector<Arc> arcs;
        each_edge(halves_, [&](const Half* begin, const Half* end) {
            int net = 0;
            for (const Half* h = begin; h != end; ++h)
                net += h->direction;
            const Index from = net > 0 ? begin->high : begin->low;
            const Index to = net > 0 ? begin->low : begin->high;
            for (int k = 0; k < std::abs(net); ++k)
                arcs.push_back({out_.shell_of[begin->face], from, to});
        });
        std::sort(arcs.begin(), arcs.end());
        std::vector<char> used(arcs.size(), 0);
        for (std::size_t i = 0; i < arcs.size(); ++i) {
            if (used[i])
                continue;
            used[i] = 1;
            std::vector<Index> path{arcs[i].from};
            Index at = arcs[i].to;
            for (;;) {
                // A vertex met again closes a simple loop; the rest of the path goes on.
                if (const auto seen = std::find(path.begin(), path.end(), at); seen != path.end()) {
                    cap(arcs[i].shell, {seen, path.end()});
                    path.erase(seen + 1, path.end());
                } else {
                    path.push_back(at);
                }
                auto next = std::lower_bound(arcs.begin(), arcs.end(), Arc{arcs[i].shell, at, 0});
                const auto leaves = [&] {
                    return next != arcs.end() && next->shell == arcs[i].shell && next->from == at;
                };
                while (leaves() && used[static_cast<std::size_t>(next - arcs.begin())])
                    ++next;
                if (!leaves())
                    break;
                used[static_cast<std::size_t>(next - arcs.begin())] = 1;
                at = next->to;
            }
        }
    }

    void cap(Index shell, const std::vector<Index>& loop) {
        if (loop.size() < 3)
            return; // an edge and its reverse: nothing to close
        CappedLoop info;
        info.n_edges = loop.size();
        for (std::size_t k = 0; k < loop.size(); ++k) {
            const Vec3 &p = out_.positions[loop[k]],
                       &q = out_.positions[loop[(k + 1) % loop.size()]];
            const double l = length(q - p);
            info.center += (p + q) * (0.5 * l);
            info.perimeter_m += l;
        }
        info.center *= 1 / info.perimeter_m;
        out_.diagnosis.loops.push_back(info);
        const auto add = [&](Index a, Index b, Index c) {
            out_.triangles.push_back({a, b, c});
            out_.shell_of.push_back(shell);
            out_.cap_area_m2[shell] += 0.5 * length(cross(out_.positions[b] - out_.positions[a],
                                                          out_.positions[c] - out_.positions[a]));
        };
        if (loop.size() == 3)
            return add(loop[0], loop[1], loop[2]);
        const auto middle = static_cast<Index>(out_.positions.size());
        out_.positions.push_back(info.center);
        for (std::size_t k = 0; k < loop.size(); ++k)
            add(loop[k], loop[(k + 1) % loop.size()], middle);
    }

    RepairedMesh out_;
    std::vector<Half> halves_;
};

} // namespace

RepairedMesh repair_mesh(const TriMesh& mesh, double weld_tolerance_m, CloseRule rule) {
    return Repair(mesh, weld_tolerance_m).run(rule);
}

std::vector<std::string> MeshDiagnosis::lines() const {
    std::vector<std::string> out;
    const auto say = [&out](const char* format, auto... values) {
        char text[256];
        std::snprintf(text, sizeof text, format, values...);
        out.emplace_back(text);
    };
    if (n_bad + n_repeated > 0)
        say("%zu faces dropped: %zu not finite or out of range, %zu with a repeated vertex",
            n_bad + n_repeated, n_bad, n_repeated);
    if (weld_tolerance_m > 0)
        say("cracks welded at %.3g m", weld_tolerance_m);
    if (n_duplicate > 0)
        say("%zu duplicate faces merged", n_duplicate);
    if (two_sided)
        say("every face is given twice (two-sided): one copy kept");
    else if (n_opposite_pairs > 0)
        say("%zu walls without thickness (a face and its back) dropped", n_opposite_pairs);
    if (!loops.empty()) {
        const double share = 100 * cap_area_m2 / area_m2;
        say("open: %zu edges in %zu loops, closed with caps = %.2g %% of the surface%s",
            n_open_edges, loops.size(), share, share > 10 ? " (doubtful)" : "");
        constexpr std::size_t kNamed = 8;
        for (std::size_t i = 0; i < std::min(loops.size(), kNamed); ++i)
            say("  loop %zu: %zu edges, %.4g m around, at (%.4g, %.4g, %.4g)", i + 1,
                loops[i].n_edges, loops[i].perimeter_m, loops[i].center.x, loops[i].center.y,
                loops[i].center.z);
        if (loops.size() > kNamed)
            say("  and %zu more", loops.size() - kNamed);
    }
    if (n_nonmanifold_edges > 0)
        say("%zu edges of three faces or more", n_nonmanifold_edges);
    if (n_flipped_edges > 0)
        say("%zu edges disagreed on the side: made consistent", n_flipped_edges);
    if (n_one_sided > 0)
        say("%zu edges of a one-sided surface: no side is right there", n_one_sided);
    if (n_inverted > 0)
        say("%zu of %zu solid shells had their faces pointing inward", n_inverted, n_solids);
    if (n_solids + n_cavities + n_sheets > 1)
        say("%zu shells: %zu solid, %zu cavities, %zu sheets without an inside left out (%.3g m^2)",
            n_solids + n_cavities + n_sheets, n_solids, n_cavities, n_sheets, sheet_area_m2);
    return out;
}

} // namespace taihu
