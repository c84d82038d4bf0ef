#pragma once
#include <memory>
#include <optional>
#include <string>

#include "stats/core/box.h"
#include "stats/core/progress.h"
#include "stats/core/tri_mesh.h"
#include "vdb_ops/field.h"
#include "vdb_ops/mesh_diagnosis.h"

namespace taihu {

struct MeshSolid {
    std::shared_ptr<const Field> field;
    MeshDiagnosis diagnosis;
    Box box; ///< of its faces [m]
};

/// Any triangle mesh as a solid, closed as the settings say, or refused by name. A MeshField, but
/// under CloseRule::winding, whose surface in openings is found on a lattice: a level set on that
/// one, and between its voxels elsewhere. A mesh without open edges needs no such rule: it is the
/// same solid as under `loops` then.
///
/// \param where         stands for the mesh in messages.
/// \param memory_bytes  of the level set under `winding`, as refuse_if_too_large() takes it.
/// \throws Error bad_input: as close_mesh(); under `winding` when more places are neither in nor
///   out (w farther than 1/4 from a whole number) than inside. Measured: a boulder with 1 % of its
///   faces missing 0.001, 20 % 0.04, 30 % 0.9, half of them 1.5; half a ball 0.6, a bowl of a
///   quarter of its width 1.4; a tray as high as half its width 0.4, a flat one 1.0; a tube open at
///   both ends 0.15 when three times as long as wide, 0.9 at once, 2.2 at half; terrain 4 to 6;
///   two to a hundred loose triangles 1.2 to 10. And when less than 0.6 of the area of its faces
///   parts in from out (WindingSurvey::parting): of all those above 0.9 does, of 100 to 10,000
///   loose triangles in a box 0 to 0.46.
///   unsupported and bad_argument, under `winding` too: as refuse_if_too_large() and
///   winding_level_set(); cancelled.
MeshSolid mesh_solid(const TriMesh& mesh, const std::string& where, const CloseSettings& settings,
                     const Lattice& lattice, Progress* progress = nullptr,
                     std::optional<double> memory_bytes = std::nullopt);

} // namespace taihu
