#pragma once
#include <filesystem>
#include <memory>

#include "stats/core/file_set.h"
#include "tools/console.h"
#include "vdb_ops/shapes.h"

namespace taihu {

/// Where the last step's normals come from.
enum class StageBump {
    dynamic,   ///< the model itself, refined once more
    static_map ///< a bump map that knows nothing of the model
};

/// The nine steps of a fractal rock as nine meshes and nine pictures, for `folder`, not yet
/// published: base, first displacement, first damping, second displacement, second damping,
/// re-scaled, lit, textured, bump-mapped. The last is the mesh of the two steps before, its faces
/// cut in 16 flat ones, with the normals of the model that is refined once more, which belongs to
/// it vertex by vertex, or of a static bump map. Source: Deix, "Real-time rendering of fractal
/// rocks", images at the end. \throws Error bad_argument: settings of another kind, or without
/// interpolating damping (then the finer model has other vertices); io.
std::unique_ptr<FileSet> make_stages(const ShapeSettings& settings, StageBump bump,
                                     const std::filesystem::path& folder, const Console& console);

} // namespace taihu
