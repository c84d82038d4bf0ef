// Apart from peers.cpp, because this header of OpenVDB 10 compiles as C++20 only when what it holds
// comes out of the library's package.
#include "tests/bench/peers.h"

#include <openvdb/tools/Composite.h>
#include <openvdb/tools/LevelSetSphere.h>

namespace taihu {

openvdb::FloatGrid::Ptr naive_carve(const openvdb::FloatGrid& base, std::span<const Sphere> holes) {
    auto result = base.deepCopy();
    for (const Sphere& hole : holes) {
        const auto ball = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
            static_cast<float>(hole.radius_m),
            openvdb::Vec3f(openvdb::Vec3d(hole.center.x, hole.center.y, hole.center.z)),
            static_cast<float>(base.voxelSize().x()), 3);
        openvdb::tools::csgDifference(*result, *ball);
    }
    return result;
}

} // namespace taihu
