#include "mesh_out/certificate.h"

#include <algorithm>
#include <bit>
#include <cstdio>
#include <numeric>
#include <span>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "mesh_out/crossings_detail.h"
#include "mesh_out/partition_detail.h"
#include "mesh_out/piece_sides_detail.h"
#include "stats/core/error.h"

namespace taihu {
namespace {

constexpr std::size_t kChunk = 4096; // vertices or faces of one task

struct Welded {
    std::vector<Vec3> positions;
    std::vector<Triangle> triangles;
    std::size_t n_merged = 0;
};

void check_indices(const TriMesh& mesh) {
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        for (const std::uint32_t v : mesh.triangles[i])
            if (v >= mesh.positions.size())
                throw Error(Fault::bad_input, "certify: triangles[" + std::to_string(i) +
                                                  "] has the index " + std::to_string(v) +
                                                  ", but there are " +
                                                  std::to_string(mesh.positions.size()) +
                                                  " positions; mend or drop the triangle");
}

/// Bits that are equal when the numbers are (-0 and 0 too), and that order any two numbers, nan
/// included, which `<` does not.
std::uint64_t sort_key(double x) {
    return std::bit_cast<std::uint64_t>(x + 0.0);
}

Welded weld(const TriMesh& mesh) {
    std::vector<std::uint32_t> order; // used positions, equal ones next to each other
    {
        std::vector<bool> used(mesh.positions.size());
        for (const Triangle& t : mesh.triangles)
            for (const std::uint32_t v : t)
                used[v] = true;
        for (std::uint32_t v = 0; v < used.size(); ++v)
            if (used[v])
                order.push_back(v);
    }
    const auto key = [&](std::uint32_t v) {
        const Vec3& p = mesh.positions[v];
        return std::array{sort_key(p.x), sort_key(p.y), sort_key(p.z)};
    };
    tbb::parallel_sort(order, [&](std::uint32_t a, std::uint32_t b) {
        const auto ka = key(a), kb = key(b);
        return ka != kb ? ka < kb : a < b;
    });
    Welded out;
    // The first of equal positions stands for all of them, and the order of positions is kept, so
    // that neighbours stay neighbours in memory.
    std::vector<std::uint32_t> to(mesh.positions.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        const bool repeats = i > 0 && key(order[i]) == key(order[i - 1]);
        to[order[i]] = repeats ? to[order[i - 1]] : order[i];
        out.n_merged += repeats;
    }
    std::sort(order.begin(), order.end());
    std::vector<std::uint32_t> place(mesh.positions.size());
    for (const std::uint32_t v : order)
        if (to[v] == v) {
            place[v] = static_cast<std::uint32_t>(out.positions.size());
            out.positions.push_back(mesh.positions[v]);
        }
    out.triangles.resize(mesh.triangles.size());
    tbb::parallel_for(std::size_t{0}, mesh.triangles.size(), [&](std::size_t i) {
        for (std::size_t k = 0; k < 3; ++k)
            out.triangles[i][k] = place[to[mesh.triangles[i][k]]];
    });
    return out;
}

bool has_place(std::span<const Vec3> positions, const Triangle& t) {
    return is_finite(positions[t[0]]) && is_finite(positions[t[1]]) && is_finite(positions[t[2]]);
}

/// The faces round each vertex, in their own order: those of v are faces[first[v]..first[v + 1]).
struct Incidence {
    std::vector<std::size_t> first;
    std::vector<std::uint32_t> faces;
};

Incidence incidence(std::size_t n_vertices, std::span<const Triangle> triangles) {
    Incidence out;
    out.first.assign(n_vertices + 1, 0);
    for (const Triangle& t : triangles)
        for (const std::uint32_t v : t)
            ++out.first[v + 1];
    std::partial_sum(out.first.begin(), out.first.end(), out.first.begin());
    out.faces.resize(3 * triangles.size());
    std::vector<std::size_t> next(out.first.begin(), out.first.end() - 1);
    for (std::size_t i = 0; i < triangles.size(); ++i)
        for (const std::uint32_t v : triangles[i])
            out.faces[next[v]++] = static_cast<std::uint32_t>(i);
    return out;
}

/// What one chunk of vertices has seen; an edge is counted at its smaller vertex.
struct ChunkCounts {
    std::size_t n_edges = 0, n_boundary = 0, n_nonmanifold_edges = 0, n_misoriented = 0;
    std::size_t n_nonmanifold_vertices = 0, n_duplicates = 0;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> joined; ///< faces with a common edge
    std::vector<std::uint32_t> boundary_faces;
};

/// One edge of a face at the vertex that is looked at.
struct Spoke {
    std::uint32_t other; ///< vertex at its far end
    std::uint32_t local; ///< number of the face among those round the vertex
    bool leaves;         ///< whether the face runs from the vertex to `other`
};

/// Looks at one vertex after the other; the buffers are kept from one to the next.
class VertexScan {
public:
    VertexScan(std::span<const Triangle> triangles, const Incidence& round, ChunkCounts& counts)
        : triangles_(triangles), round_(round), counts_(counts) {}

    void visit(std::uint32_t v) {
        const std::span faces(round_.faces.data() + round_.first[v],
                              round_.first[v + 1] - round_.first[v]);
        spokes_.clear();
        rims_.clear();
        fans_.reset(faces.size());
        for (std::uint32_t i = 0; i < faces.size(); ++i) {
            const Triangle& t = triangles_[faces[i]];
            const std::size_t k = t[0] == v ? 0 : t[1] == v ? 1 : 2;
            const std::uint32_t next = t[(k + 1) % 3], last = t[(k + 2) % 3];
            spokes_.push_back({next, i, true});
            spokes_.push_back({last, i, false});
            if (v < next && v < last)
                rims_.emplace_back(std::min(next, last), std::max(next, last));
        }
        std::sort(spokes_.begin(), spokes_.end(), [](const Spoke& a, const Spoke& b) {
            return std::pair(a.other, a.local) < std::pair(b.other, b.local);
        });
        for (std::size_t i = 0, end = 0; i < spokes_.size(); i = end) {
            while (end < spokes_.size() && spokes_[end].other == spokes_[i].other)
                ++end;
            edge(v, faces, std::span(spokes_).subspan(i, end - i));
        }
        counts_.n_nonmanifold_vertices += fans_.n_classes() > 1;
        std::sort(rims_.begin(), rims_.end());
        for (std::size_t i = 1; i < rims_.size(); ++i)
            counts_.n_duplicates += rims_[i] == rims_[i - 1];
    }

private:
    void edge(std::uint32_t v, std::span<const std::uint32_t> faces,
              std::span<const Spoke> sharing) {
        for (const Spoke& s : sharing)
            fans_.join(sharing[0].local, s.local);
        if (sharing[0].other < v)
            return; // counted at the other end
        ++counts_.n_edges;
        counts_.n_boundary += sharing.size() == 1;
        counts_.n_nonmanifold_edges += sharing.size() > 2;
        counts_.n_misoriented += sharing.size() == 2 && sharing[0].leaves == sharing[1].leaves;
        if (sharing.size() == 1)
            counts_.boundary_faces.push_back(faces[sharing[0].local]);
        for (const Spoke& s : sharing.subspan(1))
            counts_.joined.emplace_back(faces[sharing[0].local], faces[s.local]);
    }

    std::span<const Triangle> triangles_;
    const Incidence& round_;
    ChunkCounts& counts_;
    std::vector<Spoke> spokes_;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> rims_; // opposite edges: find duplicates
    Partition fans_{0};
};

/// Counts per chunk of vertices, in the order of the chunks.
std::vector<ChunkCounts> scan_vertices(std::size_t n_vertices, std::span<const Triangle> faces) {
    const Incidence round = incidence(n_vertices, faces);
    std::vector<ChunkCounts> chunks((n_vertices + kChunk - 1) / kChunk);
    tbb::parallel_for(std::size_t{0}, chunks.size(), [&](std::size_t c) {
        VertexScan scan(faces, round, chunks[c]);
        for (std::size_t v = c * kChunk; v < std::min(n_vertices, (c + 1) * kChunk); ++v)
            scan.visit(static_cast<std::uint32_t>(v));
    });
    return chunks;
}

/// Pieces, their volumes, area and box; faces that have no place in space count in the pieces only.
void measure_pieces(std::span<const Vec3> positions, std::span<const Triangle> faces,
                    std::span<const ChunkCounts> chunks, Certificate& out) {
    Partition pieces(faces.size());
    for (const ChunkCounts& c : chunks)
        for (const auto& [a, b] : c.joined)
            pieces.join(a, b);
    std::vector<bool> open(faces.size());
    for (const ChunkCounts& c : chunks)
        for (const std::uint32_t f : c.boundary_faces)
            open[pieces.find(f)] = true;
    std::vector<double> volume_x6(faces.size());
    std::vector<const Vec3*> origin(faces.size()); // of the piece itself: nothing cancels far out
    for (std::uint32_t i = 0; i < faces.size(); ++i) {
        if (!has_place(positions, faces[i]))
            continue;
        const std::uint32_t piece = pieces.find(i);
        if (!origin[piece])
            origin[piece] = &positions[faces[i][0]];
        const Vec3 a = positions[faces[i][0]] - *origin[piece],
                   b = positions[faces[i][1]] - *origin[piece],
                   c = positions[faces[i][2]] - *origin[piece];
        volume_x6[piece] += dot(a, cross(b, c));
        out.area_m2 += length(cross(b - a, c - a)) / 2;
        for (const std::uint32_t v : faces[i])
            out.box.include(positions[v]);
    }
    std::vector<std::uint32_t> piece_of(faces.size());
    for (std::uint32_t i = 0; i < faces.size(); ++i) {
        piece_of[i] = pieces.find(i);
        if (piece_of[i] != i)
            continue;
        ++out.n_components;
        out.n_cavities += !open[i] && volume_x6[i] < 0;
        out.volume_m3 += volume_x6[i] / 6;
        if (open[i])
            volume_x6[i] = 0;
    }
    // Where faces are missing or twisted, inside and outside mean little.
    if (out.n_components > 1 && out.closed() && out.manifold() && out.n_misoriented_edges == 0 &&
        out.n_nonfinite_positions == 0)
        out.n_misplaced_pieces = count_misplaced_pieces(positions, faces, piece_of, volume_x6);
}

/// The faces that lie in space and have an area.
std::vector<Triangle> solid_faces(std::span<const Vec3> positions, std::span<const Triangle> faces,
                                  std::size_t& n_flat) {
    enum class Kind : std::uint8_t { solid, flat, nowhere };
    std::vector<Kind> kinds(faces.size());
    tbb::parallel_for(std::size_t{0}, faces.size(), [&](std::size_t i) {
        const auto& [a, b, c] = faces[i];
        kinds[i] = !has_place(positions, faces[i])                     ? Kind::nowhere
                   : is_flat(positions[a], positions[b], positions[c]) ? Kind::flat
                                                                       : Kind::solid;
    });
    std::vector<Triangle> out;
    for (std::size_t i = 0; i < faces.size(); ++i) {
        if (kinds[i] == Kind::solid)
            out.push_back(faces[i]);
        n_flat += kinds[i] == Kind::flat;
    }
    return out;
}

/// "1 boundary edge", "12 boundary edges"; nothing for none.
void add_count(std::vector<std::string>& out, std::size_t n, const std::string& one,
               const std::string& many) {
    if (n > 0)
        out.push_back(std::to_string(n) + ' ' + (n == 1 ? one : many));
}

} // namespace

Certificate certify(const TriMesh& mesh, const CertifySettings& settings) {
    check_indices(mesh);
    const Welded welded = weld(mesh);
    const std::span<const Vec3> positions = welded.positions;
    // A face that repeats a vertex is an edge or a point: leaving it out opens no edge.
    std::vector<Triangle> faces;
    std::vector<bool> used(positions.size());
    for (const Triangle& t : welded.triangles) {
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0])
            continue;
        faces.push_back(t);
        for (const std::uint32_t v : t)
            used[v] = true;
    }
    Certificate out;
    out.n_vertices = positions.size();
    out.n_triangles = mesh.triangles.size();
    out.n_merged_positions = welded.n_merged;
    for (const Vec3& p : mesh.positions)
        out.n_nonfinite_positions += !is_finite(p);
    const std::vector<ChunkCounts> chunks = scan_vertices(positions.size(), faces);
    out.euler = std::count(used.begin(), used.end(), true) + std::ssize(faces);
    for (const ChunkCounts& c : chunks) {
        out.euler -= static_cast<std::int64_t>(c.n_edges);
        out.n_boundary_edges += c.n_boundary;
        out.n_nonmanifold_edges += c.n_nonmanifold_edges;
        out.n_misoriented_edges += c.n_misoriented;
        out.n_nonmanifold_vertices += c.n_nonmanifold_vertices;
        out.n_duplicate_faces += c.n_duplicates;
    }
    measure_pieces(positions, faces, chunks, out);
    if (out.closed())
        out.genus = (2 * static_cast<std::int64_t>(out.n_components) - out.euler) / 2;
    out.n_degenerate_faces = mesh.triangles.size() - faces.size();
    const std::vector<Triangle> solid = solid_faces(positions, faces, out.n_degenerate_faces);
    if (settings.self_intersections)
        out.n_self_intersections = count_crossings(positions, solid);
    return out;
}

std::vector<std::string> faults(const Certificate& certificate) {
    std::vector<std::string> out;
    if (certificate.n_triangles == 0)
        out.push_back("no triangles");
    add_count(out, certificate.n_nonfinite_positions, "position that is not finite",
              "positions that are not finite");
    add_count(out, certificate.n_degenerate_faces, "face without area", "faces without area");
    add_count(out, certificate.n_duplicate_faces, "duplicate face", "duplicate faces");
    add_count(out, certificate.n_boundary_edges, "boundary edge", "boundary edges");
    add_count(out, certificate.n_nonmanifold_edges, "edge of three faces or more",
              "edges of three faces or more");
    add_count(out, certificate.n_nonmanifold_vertices, "vertex where separate fans of faces meet",
              "vertices where separate fans of faces meet");
    add_count(out, certificate.n_misoriented_edges, "edge between faces of opposite orientation",
              "edges between faces of opposite orientation");
    add_count(out, certificate.n_misplaced_pieces, "piece that faces the wrong way",
              "pieces that face the wrong way");
    // Of a mesh that is open or twisted the volume says nothing.
    if (out.empty() && !(certificate.volume_m3 > 0 && std::isfinite(certificate.volume_m3))) {
        char text[64];
        std::snprintf(text, sizeof text, "a volume of %.6g m^3, not %s", certificate.volume_m3,
                      std::isfinite(certificate.volume_m3) ? "above 0" : "finite");
        out.emplace_back(text);
    }
    return out;
}

void require_certificate(const Certificate& certificate, const std::string& where) {
    if (certificate.holds())
        return;
    std::string what;
    for (const std::string& fault : faults(certificate))
        what += (what.empty() ? "" : ", ") + fault;
    throw Error(Fault::numeric, where + ": the surface did not come out closed (" + what +
                                    "); use another voxel size");
}

} // namespace taihu
