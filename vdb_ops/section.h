#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "stats/core/progress.h"
#include "stats/core/sphere.h"
#include "stats/core/vec3.h"

namespace taihu {

/// Which planes cut a solid.
struct SectionSettings {
    int n_planes = 20; ///< 1..10000
    /// Their normal, not 0: parallel planes at equal distances, the first at a random one. Nothing:
    /// random planes, uniform and of all directions, of which those that miss the solid are drawn
    /// again.
    std::optional<Vec3> direction;
    std::uint64_t seed = 0;
};

/// What is known besides the solid.
struct SectionKnown {
    const openvdb::FloatGrid* base = nullptr;     ///< the solid before holes were cut
    std::optional<std::span<const Sphere>> holes; ///< every hole there is [m]
};

/// A plane: `origin` is the point nearest to the middle of the solid's box; u, v and the normal are
/// right-handed, of length 1.
struct SectionPlane {
    Vec3 origin, u, v, normal; ///< origin [m]
    double area_m2 = 0;        ///< searched: of the base, or of the filled outline of the solid
};

/// The section of a hole by a plane.
struct Profile {
    int plane = 0;
    double u_m = 0, v_m = 0; ///< centre, from the plane's origin
    double diameter_m = 0;   ///< of the circle of the same area
    double major_m = 0;      ///< major axis of the ellipse with the same second moments
    bool clipped = false;    ///< it is open to the air: only a part of it was seen
};

struct Section {
    std::vector<SectionPlane> planes;
    std::vector<Profile> profiles; ///< by plane; in the order of the holes, or of their first pixel
    double area_m2 = 0;            ///< of all planes
    double volume_m3 = 0;          ///< of the base, or of the solid
    double resolution_m = 0;       ///< smaller profiles are left out; 0 with a list of holes
    std::uint64_t n_small = 0;     ///< how many were
};

/// Cut a solid by planes and measure what is seen of its holes.
///
/// With the list of holes, profiles are the exact circles whose centre lies in the searched part of
/// the plane, also where they are hidden in others: counts per area and sizes have no edge effect.
/// Otherwise they are the face-connected void regions of the plane's image, sampled at half a
/// voxel, or at 1/2000 of a large solid; merged holes are one profile, and regions below two voxels
/// (four samples) across are left out.
///
/// Areas are counted on the same image, whose lattice lies at random: no bias, and an sd below
/// 0.3 pixels^1.5 * perimeter^0.5. Large holes may be cut by several planes: profiles are then not
/// independent, and intervals of a fit a little too narrow; many holes and few planes avoid that.
///
/// The same on any number of threads. Time O(planes * (samples + holes)).
/// \throws Error bad_argument: a setting; the solid or the base is no level set, or empty;
///         numeric: a thousand random planes in turn miss the solid; cancelled: within one plane.
Section section(const openvdb::FloatGrid& solid, const SectionKnown& known = {},
                const SectionSettings& settings = {}, Progress* progress = nullptr);

/// `profiles.csv`: the planes as comments, `# planes=`, `# volume_m3=`, `# area_m2=`, then plane,u_m,v_m,diameter_m.
/// \param major  the major axis in place of the equivalent diameter.
std::string format_profiles(const Section& section, bool major = false);

} // namespace taihu
