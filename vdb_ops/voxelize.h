#pragma once
#include <memory>
#include <optional>
#include <string>

#include <openvdb/openvdb.h>

#include "stats/core/box.h"
#include "stats/core/progress.h"
#include "stats/core/tri_mesh.h"
#include "vdb_ops/field.h"
#include "vdb_ops/mesh_diagnosis.h"

namespace taihu {

struct VoxelizeSettings {
    double voxel_m = 0;       ///< > 0
    float half_width_vox = 3; ///< 2..16
    CloseSettings close = {};
    std::optional<double> memory_bytes =
        {}; ///< refuse what would need more [what the machine has left]
};

struct VoxelizeResult {
    openvdb::FloatGrid::Ptr solid; ///< narrow-band level set [m], negative inside
    std::shared_ptr<const Field> field; ///< surface_field() of it
    MeshDiagnosis diagnosis;       ///< what was found and closed; lines() wants the voxel
};

/// Any triangle mesh as a level set: mesh_solid() on the lattice of the voxels.
/// \param where  stands for the mesh in messages.
/// \throws Error as mesh_solid(), rasterize() and refuse_if_too_large().
VoxelizeResult voxelize(const TriMesh& mesh, const std::string& where,
                        const VoxelizeSettings& settings, Progress* progress = nullptr);

/// Voxel size that puts `dim` voxels along the longest axis of `box` [m].
/// \throws Error bad_argument: dim outside 4..65536, or an empty box.
double voxel_for(const Box& box, int dim);

/// Refuse what cannot fit before any work: a level set of `area_m2` at `voxel_m`, written, in
/// `memory_bytes` or in what the machine has left. Area 0: unknown, only the voxels are counted.
///
/// \throws Error bad_argument: fewer than 4 voxels along the longest axis; unsupported: more than
///   65536, or as refuse_if_over().
void refuse_if_too_large(double area_m2, const Box& box, double voxel_m,
                         std::optional<double> memory_bytes = std::nullopt);

} // namespace taihu
