#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "mesh_out/bounded_simplify.h"
#include "mesh_out/certificate.h"
#include "mesh_out/io/glb.h"
#include "mesh_out/position_grid.h"
#include "stats/core/progress.h"
#include "stats/core/sphere.h"
#include "stats/core/tri_mesh.h"
#include "vdb_ops/field.h"

namespace taihu {

/// What a level is asked for: a bound of its error, or a number of triangles. One of them is 0.
struct LodGoal {
    double bound_m = 0;
    std::size_t n_triangles = 0; ///< reached within 2 %, at least 4
};

/// \p n_levels bounds, each \p factor times the one before.
std::vector<LodGoal> bounds_by_factor(int n_levels, double bound_m, double factor);

struct LodSettings {
    std::vector<LodGoal> levels; ///< finest first, 1..8: bounds rise, numbers of triangles fall
    bool openness = true;        ///< ambient occlusion of each vertex
};

/// One level, as the decoded file holds it.
struct LodLevel {
    EncodedLevel encoded; ///< Draco bytes and what they decode to
    PositionGrid grid;
    Certificate certificate; ///< of the decoded mesh
    double bound_m = 0;      ///< promised: error_m <= bound_m
    double error_m = 0;      ///< measured as decoded, both ways, off `closed` and `unresolved`
    double rms_m = 0;
    std::int64_t holes_closed = 0; ///< tunnels of level 0 that this level lacks
    /// What it closed on purpose: balls in the voids that it fills, and round ways that it shuts.
    /// What it lacks lies within `bound_m` of them.
    std::vector<Sphere> closed;
    /// Walls and slits thinner than a voxel, spikes and creases, where no bound is promised.
    std::vector<UnresolvedPlace> unresolved;
    double unresolved_error_m = 0; ///< measured there
};

struct LodChain {
    std::vector<LodLevel> levels;          ///< finest first, triangle counts strictly decreasing
    std::size_t n_reference_triangles = 0; ///< of the sharp surface that all levels are made of
    /// About parts of the field's surface that no level has, since no voxel sees them, more than
    /// two voxels from all that is seen: bubbles and specks narrower than a voxel.
    std::vector<Sphere> unseen;
    std::string note; ///< why there are fewer levels or triangles than asked for
};

/// Levels of detail of a solid under world-space bounds, sharp where primitives of the field meet.
/// Each is simplified from the one before under a bound of its true distance to the field's
/// surface. Where that leaves too many triangles, as small holes and their rims do, a level whose
/// bound is a voxel or more is made of coarser_solid() instead: voxels half as wide as the bound,
/// at least the solid's own; grown by a quarter of the bound, so that no wall is lost; without
/// ways narrower than half of it, and what lies behind them. Later levels are then made so, too.
/// What was closed is named. A level is moved onto its position grid, Draco-coded, decoded,
/// certified and measured; a level that misses its bound is made again with a tighter inner one.
/// Normals are those of what it was made of. The same bytes on any number of threads.
/// \param solid  level set [m], negative inside.
/// \param field  what it was made of; null: the level set is its own.
/// \throws Error bad_argument; numeric: the bound cannot be met (the message says what can), or a
///   level that would break the certificate; cancelled.
LodChain make_lods(const openvdb::FloatGrid& solid, const Field* field, const LodSettings& settings,
                   Progress* progress = nullptr);

/// MSFT_screencoverage of each level: the share of a screen of 1920 x 1080 pixels that the box's
/// largest face covers where a pixel is as wide as the error of the *next* level; from there on the
/// next one looks the same. At most 1, each at most half of the one before; the last is the size
/// below which the rock may be dropped: 1e-4, or less where the levels reach that far down.
std::vector<double> screen_coverages(const LodChain& chain);

/// The chain as one GLB.
std::string format_glb(const LodChain& chain, const GlbSettings& settings = {});

/// report.json of the chain (data/schema/report.schema.json): `levels` [{triangles, bytes, error_m,
/// bound_m, rms_m, genus, holes_closed, closed, screen_coverage, ...}].
std::string format_report(const LodChain& chain, const std::string& file);

} // namespace taihu
