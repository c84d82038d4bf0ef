#pragma once
#include <cstdint>
#include <vector>

#include "mesh_out/extract_certainty_detail.h"
#include "mesh_out/labelled_mesh.h"
#include "stats/core/progress.h"
#include "vdb_ops/field.h"

namespace taihu {

/// More vertices where the tip of a fin reaches far out of the cells that the surface passes
/// between voxels: on rims and in corners that triangles cut off, and in the middle of long edges
/// from these that are farther than `bound_vox` off their face or rim. Where triangles would cross
/// then, they stay as they are. New vertices come after all others. \param mesh  closed; no
/// triangles cross.
/// \return for each new triangle, that it is a part of; new ones come after all others.
std::vector<std::uint32_t> part_long_triangles(LabelledMesh& mesh, const FieldProbe& field,
                                               const Lattice& lattice, double bound_vox,
                                               Certainty& certainty, Progress* progress);

} // namespace taihu
