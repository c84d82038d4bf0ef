#pragma once
#include <cstdint>
#include <string>

#include <openvdb/openvdb.h>

#include "mesh_out/certificate.h"
#include "mesh_out/io/mesh_file.h"
#include "stats/core/progress.h"
#include "vdb_ops/field.h"

namespace taihu {

struct SurfaceSettings {
    bool uniform = false;          ///< OpenVDB's mesher instead of an adaptive mesh
    double adaptivity = 0;         ///< of that one, 0..1
    double max_error_m = 0;        ///< bound of the adaptive mesh [m], > 0,
    std::uint64_t n_triangles = 0; ///< or how many it is to have
    bool draco = true;             ///< GLB: compressed
    bool openness = true;          ///< GLB: ambient occlusion in its vertex colours
    bool at_foot = false; ///< moved so that the middle of the foot of its box is the origin
};

/// A mesh file that is ready to be written, and what was found by reading its bytes again.
struct SurfaceFile {
    std::string bytes;
    Certificate certificate;       ///< holds
    double bound_m = 0;            ///< error_m <= bound_m
    double error_m = 0;            ///< to the surface, both ways, by closest point
    std::size_t n_unresolved = 0;  ///< places where the bound is not promised
    double unresolved_error_m = 0; ///< there
    std::size_t n_unseen = 0;      ///< LodChain::unseen
    std::string note;              ///< LodChain::note
};

/// The surface of a solid in any mesh format, certified from the bytes themselves.
/// \param field  what the solid was made of; null: the level set is its own.
/// \throws Error as make_lods(); numeric: the certificate would not hold.
SurfaceFile format_surface(const openvdb::FloatGrid& solid, const Field* field, MeshFormat format,
                           const SurfaceSettings& settings, const std::string& recipe,
                           Progress* progress = nullptr);

} // namespace taihu
