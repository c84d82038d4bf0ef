#include "vdb_ops/surface_field.h"

#include "vdb_ops/mesh_field.h"
#include "vdb_ops/placed_level_set_field.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/redistance.h"
#include "vdb_ops/superquadric_field.h"

namespace taihu {

bool is_slow(const Field& field) {
    return dynamic_cast<const MeshField*>(&field) || dynamic_cast<const SuperquadricField*>(&field);
}

std::shared_ptr<const Field> surface_field(std::shared_ptr<const Field> field,
                                           openvdb::FloatGrid::ConstPtr grid) {
    if (!is_slow(*field))
        return field;
    if (const auto* mesh = dynamic_cast<const MeshField*>(field.get())) {
        constexpr double kLeastFace_vox2 = 16;
        const double voxel_m = lattice_of(*grid).voxel_m;
        const auto n_faces = static_cast<double>(mesh->mesh().triangles.size());
        const double area_vox2 = mesh->mesh().diagnosis.area_m2 / (voxel_m * voxel_m);
        if (area_vox2 > n_faces * kLeastFace_vox2 && mesh->n_primitives() > 1)
            return field;
    }
    const auto widen = [field, grid](float half_width) -> openvdb::FloatGrid::ConstPtr {
        constexpr float kWidest = 16; // that rasterize() makes: exact, and the quicker way
        if (half_width > kWidest)
            return widen_band(*grid, half_width);
        Lattice lattice = lattice_of(*grid);
        lattice.half_width_vox = half_width;
        return rasterize(*field, lattice);
    };
    return std::make_shared<PlacedLevelSetField>(grid, Similarity(), widen);
}

} // namespace taihu
