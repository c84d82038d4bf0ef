#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "mesh_out/certificate.h"
#include "mesh_out/io/glb.h"
#include "mesh_out/position_grid.h"
#include "stats/core/progress.h"
#include "stats/core/tri_mesh.h"

namespace taihu {

struct LodSettings {
    int n_levels = 4;    ///< 1..8
    double bound_m = 0;  ///< of level 0 [m], > 0
    double factor = 2;   ///< level j has bound_m * factor^j; > 1
    bool normals = true; ///< vertex normals from the level set
};

/// One level, as the decoded file holds it.
struct LodLevel {
    EncodedLevel encoded; ///< Draco bytes and what they decode to
    PositionGrid grid;
    Certificate certificate; ///< of the decoded mesh
    double bound_m = 0;      ///< promised: error_m <= bound_m
    double error_m = 0; ///< measured on the decoded mesh, both ways, against the uniform surface
    double rms_m = 0;
    std::int64_t holes_closed = 0; ///< tunnels of level 0 that this level lacks
};

struct LodChain {
    std::vector<LodLevel> levels;          ///< finest first, triangle counts strictly decreasing
    std::size_t n_reference_triangles = 0; ///< of the uniform surface that errors refer to
    std::string note;                      ///< why there are fewer levels than asked for, or empty
};

/// Levels of detail of a solid under world-space bounds. Each is simplified from the one before,
/// moved onto its position grid, Draco-coded, decoded, certified and measured; a level that misses
/// its bound is made again with a tighter inner one. Deterministic on any number of threads. \param
/// solid  level set [m], negative inside. \throws Error bad_argument; numeric: the bound cannot be
/// met (the message says what can), or a level
///   that would break the certificate; cancelled.
LodChain make_lods(const openvdb::FloatGrid& solid, const LodSettings& settings,
                   Progress* progress = nullptr);

/// The chain as one GLB; screen coverages follow from the errors: a level is used until its error
/// would pass one pixel of a screen 1080 pixels high.
std::string format_glb(const LodChain& chain, const GlbSettings& settings = {});

/// report.json of the chain (data/schema/report.schema.json): `levels` [{triangles, bytes, error_m,
/// bound_m, rms_m, genus, holes_closed, screen_coverage, ...}].
std::string format_report(const LodChain& chain, const std::string& file);

} // namespace taihu
