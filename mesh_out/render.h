#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "stats/core/image.h"
#include "stats/core/progress.h"
#include "stats/core/tri_mesh.h"
#include "vdb_ops/reflection.h"

namespace taihu {

/// One light far away and no shadows: Eq. 1 of Tsuruoka et al. in every point, times a colour.
struct PlainLight {
    Reflection reflection;
    Vec3 color{0.5, 0.5, 0.5}; ///< linear
    DistantLight light;        ///< x to the right, y up, z towards the viewer
};

/// How render() looks at a mesh; the defaults show stone as stone.
struct RenderSettings {
    int width = 480, height = 640; ///< [pixels], 16..8192
    double turntable_deg = 0;      ///< the mesh turned about +Y, counter-clockwise seen from above
    double elevation_deg = 8;      ///< of the eye above the horizon, -89..89
    int samples = 16;              ///< paths per pixel, 1..4096
    int ao_rays = 5;               ///< sky rays per path, 1..256
    double albedo = 0.56;          ///< linear, 0..1
    /// Or at a place of the mesh [m] where it has this normal, 0..1; asked by many threads at a
    /// time.
    std::function<double(const Vec3& at, const Vec3& normal)> albedo_at = {};
    Vec3 tint{1, 1, 1}; ///< colour that the albedo is multiplied by, linear, 0..1
    /// Or at a place, as albedo_at; of a plain light instead of its colour.
    std::function<Vec3(const Vec3& at, const Vec3& normal)> tint_at = {};
    /// The normal to shade with at a place of the mesh, of the mesh's own there: as a bump map.
    /// Asked by many threads at a time.
    std::function<Vec3(const Vec3& at, const Vec3& normal)> normal_at = {};
    std::optional<PlainLight> plain = {}; ///< instead of sky and key light, without the ground
    bool ground = true;                   ///< a pale plain under the mesh that takes its shadow
    bool wireframe = false;               ///< edges drawn over flat-shaded faces
    bool smooth = true;                   ///< shade with the mesh's normals where it has them
    std::uint64_t seed = 0;
};

/// A picture of the mesh, 3 channels, linear light: one warm key light 55 degrees to the left and
/// 42 up, soft as the sun, and a sky with ambient occlusion (key : sky about 1.9 : 0.9), ground
/// bounce; perspective from 3.2 times the mesh's height (of its largest extent if that is more),
/// aimed at the middle of its box; the whole mesh is in the frame at every turntable angle, with 6
/// % to spare. Behind it a bright gradient that depends on the row alone. Same bytes on any number
/// of threads. Rays by Embree 3, in time O(pixels * samples * ao_rays). \throws Error bad_argument:
/// a setting out of range, a mesh that is empty, has no extent, or has
///               a bad index or position; cancelled.
Image render(const TriMesh& mesh, const RenderSettings& settings = {},
             Progress* progress = nullptr);

/// All `levels` side by side from one camera (so that sizes compare), each with its wireframe as an
/// inset in the lower right corner of its panel, enlarged at one place until the triangles of the
/// first level show; settings are those of one panel. At most 64 levels and 2^28 pixels.
/// \throws as render().
Image render_sheet(std::span<const TriMesh> levels, const RenderSettings& settings = {},
                   Progress* progress = nullptr);

} // namespace taihu
