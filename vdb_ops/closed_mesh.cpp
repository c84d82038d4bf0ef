#include "vdb_ops/closed_mesh.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <numeric>
#include <tuple>
#include <utility>

#include <tbb/parallel_for.h>

#include "stats/core/error.h"

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

/// The work of close_mesh() at one welding tolerance.
class Closing {
public:
    Closing(const TriMesh& mesh, double tolerance) {
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
                faces_.push_back(face);
        }
    }

    ClosedMesh run(CloseRule rule) {
        drop_duplicates();
        orient();
        number_shells();
        if (rule == CloseRule::loops)
            cap_loops();
        measure_shells();
        assign_roles();
        collect();
        return std::move(out_);
    }

private:
    void drop_duplicates() {
        std::vector<char> keep(faces_.size(), 1); // 2: kept only if every face is given twice
        MeshDiagnosis& d = out_.diagnosis;
        each_edge(sorted_halves(faces_, out_.positions.size()),
                  [&](const Half* begin, const Half* end) {
                      for (const Half* a = begin; a != end; ++a)
                          for (const Half* b = a + 1; b != end && keep[a->face] == 1; ++b) {
                              if (keep[b->face] != 1 || third_vertex(faces_[a->face], *a) !=
                                                            third_vertex(faces_[b->face], *b))
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
        d.two_sided = 4 * d.n_opposite_pairs > faces_.size();
        std::size_t n = 0;
        for (std::size_t f = 0; f < faces_.size(); ++f)
            if (keep[f] == 1 || (keep[f] == 2 && d.two_sided))
                faces_[n++] = faces_[f];
        faces_.resize(n);
    }

    /// Neighbours over edges of two faces get one side; the majority of a patch keeps its own.
    void orient() {
        MeshDiagnosis& d = out_.diagnosis;
        ParityUnion sides(faces_.size());
        each_edge(sorted_halves(faces_, out_.positions.size()),
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
        std::vector<std::int64_t> votes(faces_.size(), 0);
        for (Index f = 0; f < faces_.size(); ++f) {
            const auto [root, flipped] = sides.find(f);
            votes[root] += flipped ? -1 : 1;
        }
        for (Index f = 0; f < faces_.size(); ++f) {
            const auto [root, flipped] = sides.find(f);
            if ((votes[root] >= 0) == flipped)
                std::swap(faces_[f][1], faces_[f][2]);
        }
    }

    void number_shells() {
        ParityUnion connected(faces_.size());
        halves_ = sorted_halves(faces_, out_.positions.size());
        each_edge(halves_, [&](const Half* begin, const Half* end) {
            for (const Half* h = begin + 1; h < end; ++h)
                connected.join(begin->face, h->face, false);
        });
        std::vector<Index> number(faces_.size(), kNone);
        out_.shell_of.resize(faces_.size());
        for (Index f = 0; f < faces_.size(); ++f) {
            Index& n = number[connected.find(f).first];
            if (n == kNone) {
                n = static_cast<Index>(out_.shells.size());
                out_.shells.emplace_back();
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
            faces_.push_back({a, b, c});
            out_.shell_of.push_back(shell);
            out_.shells[shell].cap_area_m2 +=
                0.5 * length(cross(out_.positions[b] - out_.positions[a],
                                   out_.positions[c] - out_.positions[a]));
        };
        if (loop.size() == 3)
            return add(loop[0], loop[1], loop[2]);
        const auto middle = static_cast<Index>(out_.positions.size());
        out_.positions.push_back(info.center);
        for (std::size_t k = 0; k < loop.size(); ++k)
            add(loop[k], loop[(k + 1) % loop.size()], middle);
    }

    void measure_shells() {
        if (faces_.empty())
            return;
        const Vec3 origin = out_.positions[faces_[0][0]];
        for (std::size_t f = 0; f < faces_.size(); ++f) {
            Shell& s = out_.shells[out_.shell_of[f]];
            const Vec3 a = out_.positions[faces_[f][0]] - origin,
                       b = out_.positions[faces_[f][1]] - origin,
                       c = out_.positions[faces_[f][2]] - origin;
            s.volume_m3 += dot(a, cross(b, c)) / 6;
            s.area_m2 += 0.5 * length(cross(b - a, c - a));
            ++s.n_faces;
            for (const Index v : faces_[f])
                s.box.include(out_.positions[v]);
        }
    }

    /// Winding number of a shell about `p`: sum of solid angles (Van Oosterom & Strackee 1983).
    double winding(Index shell, const Vec3& p) const {
        double sum = 0;
        for (std::size_t f = 0; f < faces_.size(); ++f) {
            if (out_.shell_of[f] != shell)
                continue;
            const Vec3 a = out_.positions[faces_[f][0]] - p, b = out_.positions[faces_[f][1]] - p,
                       c = out_.positions[faces_[f][2]] - p;
            const double la = length(a), lb = length(b), lc = length(c);
            sum += 2 * std::atan2(dot(a, cross(b, c)),
                                  la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
        }
        return sum / (4 * std::numbers::pi);
    }

    void assign_roles() {
        // Caps as large as the shell itself, or nothing held: no inside.
        for (Shell& s : out_.shells)
            if (s.cap_area_m2 > 0.45 * s.area_m2 ||
                36 * std::numbers::pi * s.volume_m3 * s.volume_m3 <=
                    1e-12 * s.area_m2 * s.area_m2 * s.area_m2)
                s.role = Shell::Role::sheet;
        renumber_by_volume();
        std::vector<Index> first_face(out_.shells.size(), kNone);
        for (Index f = static_cast<Index>(faces_.size()); f-- > 0;)
            first_face[out_.shell_of[f]] = f;
        // Larger shells come first, so the last one that holds a shell is the innermost.
        for (Index i = 0; i < out_.shells.size(); ++i) {
            Shell& inner = out_.shells[i];
            for (Index j = i; inner.role == Shell::Role::solid && j-- > 0;) {
                const Shell& outer = out_.shells[j];
                if (outer.role == Shell::Role::sheet || !outer.box.contains(inner.box.lo) ||
                    !outer.box.contains(inner.box.hi) ||
                    std::fabs(winding(j, out_.positions[faces_[first_face[i]][0]])) <= 0.5)
                    continue;
                const bool turned = (inner.volume_m3 < 0) != (outer.volume_m3 < 0);
                if (turned && outer.role == Shell::Role::solid)
                    inner.role = Shell::Role::cavity;
                break;
            }
        }
    }

    void renumber_by_volume() {
        std::vector<Index> order(out_.shells.size()), number(out_.shells.size());
        std::iota(order.begin(), order.end(), Index{0});
        std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) {
            return std::fabs(out_.shells[a].volume_m3) > std::fabs(out_.shells[b].volume_m3);
        });
        std::vector<Shell> shells;
        for (Index n = 0; n < order.size(); ++n) {
            shells.push_back(out_.shells[order[n]]);
            number[order[n]] = n;
        }
        out_.shells = std::move(shells);
        for (Index& s : out_.shell_of)
            s = number[s];
    }

    /// Faces sorted by shell, sheets left out; totals of the diagnosis.
    void collect() {
        MeshDiagnosis& d = out_.diagnosis;
        for (const Shell& s : out_.shells) {
            d.area_m2 += s.area_m2;
            d.cap_area_m2 += s.cap_area_m2;
            d.n_solids += s.role == Shell::Role::solid;
            d.n_cavities += s.role == Shell::Role::cavity;
            d.n_inverted += s.role == Shell::Role::solid && s.volume_m3 < 0;
            if (s.role == Shell::Role::sheet) {
                ++d.n_sheets;
                d.sheet_area_m2 += s.area_m2 - s.cap_area_m2;
            }
        }
        std::vector<Index> order;
        for (Index f = 0; f < faces_.size(); ++f)
            if (out_.shells[out_.shell_of[f]].role != Shell::Role::sheet)
                order.push_back(f);
        std::stable_sort(order.begin(), order.end(),
                         [&](Index a, Index b) { return out_.shell_of[a] < out_.shell_of[b]; });
        std::vector<Index> shell_of;
        for (const Index f : order) {
            out_.triangles.push_back(faces_[f]);
            shell_of.push_back(out_.shell_of[f]);
        }
        out_.shell_of = std::move(shell_of);
    }

    ClosedMesh out_;
    std::vector<Triangle> faces_;
    std::vector<Half> halves_;
};

} // namespace

ClosedMesh close_mesh(const TriMesh& mesh, const std::string& where, CloseRule rule,
                      Progress* progress) {
    Box box;
    for (const Vec3& p : mesh.positions)
        if (is_finite(p))
            box.include(p);
    const double diagonal = length(box.size());
    ClosedMesh closed;
    for (const double tolerance : {0.0, 1e-6, 1e-5, 1e-4}) {
        check_cancelled(progress);
        closed = Closing(mesh, tolerance * diagonal).run(rule);
        if (closed.diagnosis.n_solids > 0 || closed.diagnosis.n_open_edges == 0)
            break;
    }
    const MeshDiagnosis& d = closed.diagnosis;
    if (rule == CloseRule::none && d.n_open_edges > 0) {
        const auto loops = Closing(mesh, 0).run(CloseRule::loops).diagnosis.loops.size();
        throw Error(Fault::bad_input, where + ": open: " + std::to_string(d.n_open_edges) +
                                          " open edges in " + std::to_string(loops) +
                                          " loops; close them, or cap them with --close loops");
    }
    if (d.n_solids == 0) {
        char share[32];
        std::snprintf(share, sizeof share, "%.0f",
                      d.area_m2 > 0 ? 100 * d.cap_area_m2 / d.area_m2 : 0);
        throw Error(Fault::bad_input,
                    where + ": no inside: " + std::to_string(d.n_sheets) +
                        " sheets without one (caps would be " + share +
                        " % of the surface); give the mesh a thickness or a closed surface");
    }
    return closed;
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
