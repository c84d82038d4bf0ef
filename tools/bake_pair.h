#pragma once
#include <filesystem>
#include <string>

#include "tools/baked_files.h"
#include "tools/console.h"
#include "tools/solid_files.h"

namespace taihu {

/// One surface baked onto a mesh that the user brings.
struct BakePair {
    SolidOptions high; ///< a level set, or a mesh
    std::filesystem::path low;
    BakedFiles files;
    RecipeMaps maps; ///< but for the lengths, which are
    std::string cage, grain;
    bool occlusion = true, at_foot = false;
    double crease_deg = 60;
};

/// Bakes and writes it. Returns the figures. What is not closed is said, and written as it is.
/// \throws Error bad_argument: the two lie far apart and no cage is given; as with_creases(),
/// mesh_solid() and bake_mesh().
nlohmann::ordered_json write_baked_pair(const BakePair& pair, const Console& console);

} // namespace taihu
