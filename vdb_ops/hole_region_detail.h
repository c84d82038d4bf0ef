#pragma once
#include <memory>

#include <openvdb/openvdb.h>

#include "stats/core/box.h"
#include "stats/core/sphere.h"

namespace taihu {

/// Where holes go. For one thread: a level set is read through a cache.
class HoleRegion {
public:
    virtual ~HoleRegion() = default;
    virtual Box box() const = 0;   ///< holds it, with a margin; random centres are drawn here
    virtual Box tight() const = 0; ///< holds it, and no more
    virtual double volume_m3() const = 0;
    virtual bool inside(const Vec3& p) const = 0;
    virtual bool meets(const Sphere& ball) const = 0;
};

/// \throws Error bad_argument: a box without volume.
std::unique_ptr<HoleRegion> hole_region(const Box& box);
/// \throws Error bad_argument: as lattice_of(), or an empty solid.
std::unique_ptr<HoleRegion> hole_region(const openvdb::FloatGrid& solid);

} // namespace taihu
