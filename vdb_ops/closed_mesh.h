#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "stats/core/box.h"
#include "stats/core/progress.h"
#include "vdb_ops/mesh_repair.h"

namespace taihu {

/// A set of faces connected over edges.
struct Shell {
    enum class Role {
        solid,  ///< adds its inside
        cavity, ///< opposite orientation inside a larger shell: removes its inside
        sheet   ///< has no inside; left out
    };
    Role role = Role::solid;
    std::size_t n_faces = 0; ///< caps included
    double volume_m3 = 0;    ///< signed as the faces are turned
    double area_m2 = 0;      ///< caps included
    double cap_area_m2 = 0;
    Box box;
};

/// A mesh whose signed edge count is balanced everywhere, so that its winding number is an integer.
struct ClosedMesh {
    std::vector<Vec3> positions;         ///< [m], welded
    std::vector<Triangle> triangles;     ///< sorted by shell, sheets left out
    std::vector<std::uint32_t> shell_of; ///< one per triangle
    std::vector<Shell> shells;           ///< from the largest volume to the smallest
    MeshDiagnosis diagnosis;
};

/// Make a solid of any triangle mesh, or refuse it by name: repair_mesh(), then a role for each
/// shell, sheets left out. When nothing has an inside, cracks are welded at 1e-6, 1e-5 and 1e-4 of
/// the diagonal. Costs what repair_mesh() does.
///
/// \param where  stands for the mesh in messages.
///
/// \throws Error bad_input: no face at all, open edges under CloseRule::none, or no shell with an
///   inside (a sheet: caps above 45 % of its area, or no volume).
ClosedMesh close_mesh(const TriMesh& mesh, const std::string& where,
                      CloseRule rule = CloseRule::loops, Progress* progress = nullptr);

} // namespace taihu
