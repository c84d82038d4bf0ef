#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "stats/core/tri_mesh.h"

namespace taihu {

/// What can be said of a mesh by looking at every face of it, after welding equal positions.
struct Certificate {
    std::size_t n_vertices = 0; ///< after welding, used ones only
    std::size_t n_triangles = 0;
    std::size_t n_merged_positions = 0;     ///< positions that were equal to an earlier one
    std::size_t n_boundary_edges = 0;       ///< edges of one face
    std::size_t n_nonmanifold_edges = 0;    ///< edges of three faces or more
    std::size_t n_misoriented_edges = 0;    ///< edges of two faces that run through it the same way
    std::size_t n_nonmanifold_vertices = 0; ///< vertices whose faces form more than one fan
    std::size_t n_degenerate_faces = 0;     ///< repeated vertex or exactly zero area
    std::size_t n_duplicate_faces = 0;      ///< same three vertices as an earlier face
    std::size_t n_nonfinite_positions = 0;
    std::size_t n_components = 0; ///< connected over edges
    std::size_t n_cavities = 0;   ///< closed components of negative volume
    /// Components inside out: of positive volume but in another, or negative and not in just one.
    std::size_t n_misplaced_pieces = 0;
    std::int64_t euler = 0; ///< V - E + F, without faces that repeat a vertex
    std::int64_t genus = 0; ///< (2 * components - euler) / 2 for a closed mesh, summed
    double volume_m3 = 0, area_m2 = 0;
    Box box;
    std::size_t n_self_intersections = 0; ///< pairs of faces with an area that meet anywhere
                                          ///< but in vertices or an edge they share; exact

    bool closed() const { return n_triangles > 0 && n_boundary_edges == 0; }
    bool manifold() const {
        return n_nonmanifold_edges == 0 && n_nonmanifold_vertices == 0 && n_duplicate_faces == 0;
    }
    bool outward() const {
        return n_misoriented_edges == 0 && n_misplaced_pieces == 0 && volume_m3 > 0;
    }
    /// Closed, 2-manifold, oriented outwards, without degenerate faces or non-finite positions.
    /// Self-intersections and the number of pieces are stated, not judged.
    bool holds() const {
        return closed() && manifold() && outward() && n_degenerate_faces == 0 &&
               n_nonfinite_positions == 0;
    }
};

struct CertifySettings {
    bool self_intersections = true; ///< count crossing pairs too (most of the time it takes)
};

/// Look at every face of `mesh`. Deterministic on any number of threads; O(n log n).
/// Nothing is assumed: indices out of range are an error, everything else is counted. Faces with a
/// position that is not finite are left out of volume, area, box and crossings.
/// \throws Error bad_input: an index past the last position.
Certificate certify(const TriMesh& mesh, const CertifySettings& settings = {});

/// What keeps `certificate` from holding, one short phrase each ("12 boundary edges"); empty if it
/// holds.
std::vector<std::string> faults(const Certificate& certificate);

/// \throws Error numeric with the faults, unless `certificate` holds. \param where  the file, for
/// the
///   message.
void require_certificate(const Certificate& certificate, const std::string& where);

} // namespace taihu
