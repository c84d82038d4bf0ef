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
    ShellRule rule = ShellRule::unite;   ///< under `parity` roles are for the diagnosis alone
    MeshDiagnosis diagnosis;
};

/// Make a solid of any triangle mesh, or refuse it by name: repair_mesh(), then a role for each
/// shell, sheets left out. Cracks are welded at the first of weld_shares() that closes more than
/// half of the open edges; when nothing has an inside, at the others too. Costs what repair_mesh()
/// does, and a 64th of the columns of a level set.
///
/// A shell is a sheet when its caps are more than 45 % of its area with caps (under `plane` they
/// are as large as they need be, and do not count), or when it holds less than 1e-12 of what its
/// area could. Measured on solids: an opened bunny 2 to 13 %, the teapot's shells 19, half a ball
/// 36, trays (boxes without a lid) 25 at half as high as wide, 40 at an eighth, 43 at a twelfth;
/// between: a tray of a twentieth 45, a bowl of a ball of a quarter of its width 46 to 48; on
/// sheets: a tray of a fiftieth 48, terrain 46 to 50, a car of loose panels 48, single polygons and
/// loose triangles 50 and more. With a share of a boulder's faces missing at random: 22 % at 0.2,
/// 45 at 0.3, so that beyond it is no solid that caps can close.
///
/// \param where  stands for the mesh in messages.
///
/// \throws Error bad_input: no face at all, open edges under CloseRule::none, or no shell with an
///   inside; bad_argument: CloseRule::winding, which mesh_solid() is for.
ClosedMesh close_mesh(const TriMesh& mesh, const std::string& where,
                      const CloseSettings& settings = {}, Progress* progress = nullptr);

} // namespace taihu
