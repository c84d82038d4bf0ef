#include <cmath>
#include <limits>

#include "mesh_out/io/draco_codec_detail.h"
#include "mesh_out/io/glb.h"
#include "mesh_out/io/mesh_formats_detail.h"
#include "mesh_out/io/polygons_detail.h"

namespace taihu {

MeshFile parse_drc(std::string_view bytes, const std::string& where, bool is_own,
                   Progress* progress) {
    constexpr std::size_t kNoLimit = std::numeric_limits<std::size_t>::max(); // but its program's
    const DracoStream whole{bytes, where + ":byte 0"};
    DracoMesh decoded =
        std::move(read_draco(std::span(&whole, 1), where, is_own, kNoLimit, progress).front());
    MeshFile file;
    file.draco = true;
    file.recipe = std::move(decoded.recipe);
    file.levels.resize(1);
    TriMesh& level = file.levels.front();
    level.positions = std::move(decoded.mesh.positions);
    level.normals = std::move(decoded.mesh.normals);
    for (const Triangle& t : decoded.mesh.triangles)
        add_triangle(file, level, t);
    return file;
}

std::string format_drc(const TriMesh& mesh, const std::string& recipe) {
    if (const auto grid = grid_of(mesh))
        return encode_draco(mesh, *grid, recipe).draco;
    const PositionGrid grid = finest_grid(bounds(mesh));
    TriMesh on_grid = mesh;
    for (Vec3& p : on_grid.positions)
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = grid.origin[axis] +
                      std::round((p[axis] - grid.origin[axis]) / grid.step_m) * grid.step_m;
    return encode_draco(on_grid, grid, recipe).draco;
}

} // namespace taihu
