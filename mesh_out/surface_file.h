#pragma once
#include <string>

#include <openvdb/openvdb.h>

#include "mesh_out/certificate.h"
#include "mesh_out/io/mesh_file.h"
#include "stats/core/progress.h"

namespace taihu {

struct SurfaceSettings {
    bool uniform = false;   ///< the plain extraction instead of an adaptive mesh
    double max_error_m = 0; ///< bound of the adaptive mesh [m], > 0
    bool draco = true;      ///< GLB: compressed
};

/// A mesh file that is ready to be written, and what was found by reading its bytes again.
struct SurfaceFile {
    std::string bytes;
    Certificate certificate; ///< holds
    double bound_m = 0;      ///< error_m <= bound_m
    double error_m = 0;      ///< to the uniform surface, both ways, by closest point
};

/// The surface of a solid in any mesh format, certified from the bytes themselves.
/// \throws Error as make_lods(); numeric: the certificate would not hold.
SurfaceFile format_surface(const openvdb::FloatGrid& solid, MeshFormat format,
                           const SurfaceSettings& settings, const std::string& recipe,
                           Progress* progress = nullptr);

} // namespace taihu
