#include "vdb_ops/mesh_solid.h"

#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

#include "stats/core/error.h"
#include "vdb_ops/closed_mesh.h"
#include "vdb_ops/mesh_field.h"
#include "vdb_ops/placed_level_set_field.h"
#include "vdb_ops/voxelize.h"
#include "vdb_ops/winding_solid_detail.h"
#include "vdb_ops/winding_survey_detail.h"

namespace taihu {
namespace {

MeshSolid solid_of(ClosedMesh closed) {
    MeshSolid solid;
    solid.diagnosis = closed.diagnosis;
    solid.box = bounds({closed.positions, closed.triangles, {}});
    solid.field = std::make_shared<MeshField>(std::move(closed));
    return solid;
}

/// Signs and measures of what the winding number makes of a mesh.
MeshDiagnosis survey(const RepairedMesh& mesh, const std::string& where) {
    constexpr double kMostUndecided = 1, kLeastParting = 0.6;
    MeshDiagnosis d = mesh.diagnosis;
    const WindingSurvey seen = survey_winding(mesh);
    if (seen.n_inside == 0)
        throw Error(Fault::bad_input, where +
                                          ": no inside: the winding number is nowhere above "
                                          "1/2; give the mesh a thickness, or try --close plane");
    d.undecided = double(seen.n_undecided) / double(seen.n_inside);
    const auto refuse = [&](double figure, const char* says) {
        char text[32];
        std::snprintf(text, sizeof text, "%.2g", figure);
        throw Error(Fault::bad_input, where + ": no inside: " + text + says);
    };
    if (d.undecided > kMostUndecided)
        refuse(d.undecided,
               " times as many places are neither in nor out as are inside (1 at most); give the "
               "mesh a thickness, or try --close plane");
    if (seen.parting < kLeastParting)
        refuse(seen.parting,
               " of the area of its faces parts in from out (0.6 at least): they surround "
               "nothing; drop loose faces, or turn all to one side");
    d.n_solids = 1;
    d.n_inverted = seen.mean < 0;
    for (const double area : mesh.cap_area_m2)
        d.cap_area_m2 += area;
    d.area_m2 = area_m2({mesh.positions, mesh.triangles, {}});
    return d;
}

} // namespace

MeshSolid mesh_solid(const TriMesh& mesh, const std::string& where, const CloseSettings& settings,
                     const Lattice& lattice, Progress* progress,
                     std::optional<double> memory_bytes) {
    if (settings.rule != CloseRule::winding)
        return solid_of(close_mesh(mesh, where, settings, progress));
    const RepairedMesh repaired = repair_mesh(mesh, std::nullopt, CloseRule::winding);
    if (repaired.diagnosis.n_open_edges == 0) {
        MeshSolid solid = solid_of(close_mesh(mesh, where, {}, progress));
        solid.diagnosis.rule = CloseRule::winding;
        return solid;
    }
    check_cancelled(progress);
    MeshSolid solid;
    solid.diagnosis = survey(repaired, where);
    // The level in openings hardly leaves the box of the faces and their caps.
    solid.box = bounds({repaired.positions, repaired.triangles, {}});
    refuse_if_too_large(solid.diagnosis.area_m2, solid.box, lattice.voxel_m, memory_bytes);
    solid.field =
        std::make_shared<PlacedLevelSetField>(winding_level_set(repaired, lattice, progress));
    return solid;
}

} // namespace taihu
