#pragma once
#include <filesystem>

#include "tools/console.h"
#include "vdb_ops/shapes.h"

namespace taihu {

/// The nine steps of a fractal rock as nine meshes and nine pictures, in `folder`, which is made:
/// base, first displacement, first damping, second displacement, second damping, re-scaled, lit,
/// textured, bump-mapped. The last is the mesh of the two steps before with the normals of the
/// model that is refined once more, which belongs to it vertex by vertex.
/// Source: Deix, "Real-time rendering of fractal rocks", images at the end.
/// \throws Error bad_argument: settings of another kind, or without interpolating damping (then the
/// finer model has other vertices); io.
void write_stages(const ShapeSettings& settings, const std::filesystem::path& folder,
                  const Console& console);

} // namespace taihu
