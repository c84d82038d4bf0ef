#pragma once
#include <algorithm>
#include <cmath>
#include <span>

#include <openvdb/openvdb.h>

#include "stats/core/sphere.h"

namespace taihu {

/// A level set (half band 3 voxels) of a ball about the origin minus `holes`: max(f, -g),
/// rasterised by the plainest loop there is. [m]
inline openvdb::FloatGrid::Ptr holed_ball_grid(double radius, double voxel,
                                               std::span<const Sphere> holes) {
    openvdb::initialize();
    const double band = 3 * voxel;
    const auto grid = openvdb::FloatGrid::create(static_cast<float>(band));
    grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    grid->setName("rock");
    auto accessor = grid->getAccessor();
    const int n = static_cast<int>(std::ceil((radius + band) / voxel));
    for (int x = -n; x <= n; ++x)
        for (int y = -n; y <= n; ++y)
            for (int z = -n; z <= n; ++z) {
                const Vec3 p = Vec3{double(x), double(y), double(z)} * voxel;
                double f = length(p) - radius;
                for (const Sphere& hole : holes)
                    f = std::max(f, hole.radius_m - length(p - hole.center));
                if (std::abs(f) < band)
                    accessor.setValue({x, y, z}, static_cast<float>(f));
                else if (f < 0)
                    accessor.setValueOff({x, y, z}, static_cast<float>(-band));
            }
    return grid;
}

inline openvdb::FloatGrid::Ptr ball_grid(double radius, double voxel) {
    return holed_ball_grid(radius, voxel, {});
}

} // namespace taihu
