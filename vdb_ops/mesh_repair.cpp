#include "vdb_ops/mesh_repair.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <numeric>
#include <utility>

#include "vdb_ops/mesh_caps_detail.h"
#include "vdb_ops/mesh_edges_detail.h"

namespace taihu {
namespace {

using Index = std::uint32_t;

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

Index third_vertex(const Triangle& face, const HalfEdge& h) {
    return face[0] ^ face[1] ^ face[2] ^ h.low ^ h.high;
}

/// Edges of one face.
struct OpenEdges {
    std::vector<std::array<Index, 2>> edges; ///< of corners
    std::vector<Vec3> corners;
    std::vector<Index> vertices; ///< of the mesh, one per corner

    /// Those that are left when the corners are welded.
    std::size_t n_left(double tolerance) const {
        std::vector<Vec3> welded;
        const std::vector<Index> id = weld(corners, tolerance, welded);
        std::vector<std::array<Index, 2>> moved;
        for (const auto& [a, b] : edges)
            if (id[a] != id[b])
                moved.push_back({std::min(id[a], id[b]), std::max(id[a], id[b])});
        std::sort(moved.begin(), moved.end());
        std::size_t n = 0;
        for (std::size_t i = 0, j = 0; i < moved.size(); i = j) {
            while (j < moved.size() && moved[j] == moved[i])
                ++j;
            n += j - i == 1;
        }
        return n;
    }

    /// The first of weld_shares() that closes more than half of them; 0: no cracks.
    double crack_share(double diagonal_m) const {
        for (const double share : weld_shares())
            if (2 * n_left(share * diagonal_m) < edges.size())
                return share;
        return 0;
    }
};

class Repair {
public:
    explicit Repair(const TriMesh& mesh) {
        out_.diagnosis.n_faces = mesh.triangles.size();
        const std::vector<Index> id = weld(mesh.positions, 0, out_.positions);
        for (const Triangle& t : mesh.triangles) {
            Triangle face{};
            bool good = true;
            for (std::size_t k = 0; k < 3; ++k) {
                good = good && t[k] < id.size() && id[t[k]] != kNoVertex;
                face[k] = good ? id[t[k]] : 0;
            }
            if (!good)
                ++out_.diagnosis.n_bad;
            else
                add(face);
        }
        diagonal_m_ = length(bounds({out_.positions, out_.triangles, {}}).size());
    }

    RepairedMesh run(std::optional<double> weld_share, CloseRule rule) {
        drop_duplicates();
        const OpenEdges open = find_open_edges();
        const double share = weld_share.value_or(open.crack_share(diagonal_m_));
        if (share > 0 && !open.edges.empty()) {
            weld_open_corners(open, share);
            drop_duplicates();
        }
        orient();
        number_shells();
        out_.n_given = out_.triangles.size();
        out_.diagnosis.rule = rule;
        if (rule != CloseRule::none)
            close_loops(out_, halves_, rule == CloseRule::plane);
        return std::move(out_);
    }

private:
    void add(const Triangle& face) {
        if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0])
            ++out_.diagnosis.n_repeated;
        else
            out_.triangles.push_back(face);
    }

    void drop_duplicates() {
        std::vector<char> keep(out_.triangles.size(),
                               1); // 2: kept only if every face is given twice
        MeshDiagnosis& d = out_.diagnosis;
        any_open_ = false;
        std::vector<const HalfEdge*> order;
        each_edge(sorted_halves(out_.triangles, out_.positions.size()),
                  [&](const HalfEdge* begin, const HalfEdge* end) {
                      any_open_ = any_open_ || end - begin == 1;
                      if (end - begin < 2)
                          return;
                      // Equal faces side by side, the first of them first.
                      order.clear();
                      for (const HalfEdge* h = begin; h != end; ++h)
                          order.push_back(h);
                      const auto third = [this](const HalfEdge* h) {
                          return third_vertex(out_.triangles[h->face], *h);
                      };
                      std::stable_sort(order.begin(), order.end(),
                                       [&](auto* a, auto* b) { return third(a) < third(b); });
                      for (std::size_t i = 1, first = 0; i < order.size(); ++i) {
                          const HalfEdge &a = *order[first], &b = *order[i];
                          if (third(&a) != third(&b) || keep[a.face] != 1) {
                              first = i;
                              continue;
                          }
                          if (keep[b.face] != 1)
                              continue;
                          keep[b.face] = 0;
                          if (a.direction == b.direction) {
                              ++d.n_duplicate;
                          } else { // front and back
                              ++d.n_opposite_pairs;
                              keep[a.face] = 2;
                          }
                      }
                  });
        if (std::count(keep.begin(), keep.end(), 1) == std::ssize(keep))
            return;
        // A pair here and there is a wall without thickness: both sides go.
        any_open_ = true; // or not: what goes may open what was closed
        d.two_sided = 4 * d.n_opposite_pairs > out_.triangles.size();
        std::size_t n = 0;
        for (std::size_t f = 0; f < out_.triangles.size(); ++f)
            if (keep[f] == 1 || (keep[f] == 2 && d.two_sided))
                out_.triangles[n++] = out_.triangles[f];
        out_.triangles.resize(n);
    }

    OpenEdges find_open_edges() const {
        OpenEdges open;
        if (!any_open_)
            return open;
        std::vector<Index> number(out_.positions.size(), kNoVertex);
        const auto corner = [&](Index v) {
            if (number[v] == kNoVertex) {
                number[v] = static_cast<Index>(open.vertices.size());
                open.vertices.push_back(v);
                open.corners.push_back(out_.positions[v]);
            }
            return number[v];
        };
        each_edge(sorted_halves(out_.triangles, out_.positions.size()),
                  [&](const HalfEdge* h, const HalfEdge* end) {
                      if (end - h == 1) {
                          const Index low = corner(h->low), high = corner(h->high);
                          open.edges.push_back({low, high});
                      }
                  });
        return open;
    }

    /// Cracks: only corners on open edges move, so detail finer than the tolerance stays.
    void weld_open_corners(const OpenEdges& open, double share) {
        out_.diagnosis.weld_share = share;
        out_.diagnosis.weld_tolerance_m = share * diagonal_m_;
        std::vector<Vec3> welded;
        const std::vector<Index> onto = weld(open.corners, share * diagonal_m_, welded);
        std::vector<Index> first(welded.size(), kNoVertex), id(out_.positions.size());
        std::iota(id.begin(), id.end(), Index{0});
        for (std::size_t i = 0; i < onto.size(); ++i) {
            Index& target = first[onto[i]];
            target = target == kNoVertex ? open.vertices[i] : target;
            id[open.vertices[i]] = target;
        }
        for (const Triangle& t : std::exchange(out_.triangles, {}))
            add({id[t[0]], id[t[1]], id[t[2]]});
    }

    /// Neighbours over edges of two faces get one side; the majority of a patch keeps its own.
    void orient() {
        MeshDiagnosis& d = out_.diagnosis;
        ParityUnion sides(out_.triangles.size());
        each_edge(sorted_halves(out_.triangles, out_.positions.size()),
                  [&](const HalfEdge* a, const HalfEdge* end) {
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
        each_edge(halves_, [&](const HalfEdge* begin, const HalfEdge* end) {
            for (const HalfEdge* h = begin + 1; h < end; ++h)
                connected.join(begin->face, h->face, false);
        });
        std::vector<Index> number(out_.triangles.size(), kNoVertex);
        out_.shell_of.resize(out_.triangles.size());
        for (Index f = 0; f < out_.triangles.size(); ++f) {
            Index& n = number[connected.find(f).first];
            if (n == kNoVertex) {
                n = static_cast<Index>(out_.cap_area_m2.size());
                out_.cap_area_m2.push_back(0);
            }
            out_.shell_of[f] = n;
        }
    }

    RepairedMesh out_;
    std::vector<HalfEdge> halves_;
    double diagonal_m_ = 0;
    bool any_open_ = false; ///< edges of one face, perhaps
};

} // namespace

std::vector<double> weld_shares() {
    return {1e-6, 1e-5, 1e-4};
}

RepairedMesh repair_mesh(const TriMesh& mesh, std::optional<double> weld_share, CloseRule rule) {
    return Repair(mesh).run(weld_share, rule);
}

} // namespace taihu
