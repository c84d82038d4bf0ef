#pragma once
#include <array>
#include <string>

#include <openvdb/openvdb.h>

#include "stats/core/sha256.h"
#include "stats/core/sphere.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/rasterize.h"

namespace taihu {

/// Level set of a ball about the origin; radius 1 m and voxel 5 cm unless said otherwise.
inline openvdb::FloatGrid::Ptr ball_rock(double radius_m = 1, double voxel_m = 0.05) {
    const BallsField field(std::array<Sphere, 1>{{{{}, radius_m}}});
    return rasterize(field, {voxel_m, {}, 3});
}

/// A hash of everything that a level set says: topology, active states and values.
inline std::string grid_hash(const openvdb::FloatGrid& grid) {
    std::string bytes;
    const auto add = [&bytes](const auto& value) {
        bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    };
    add(grid.background());
    for (auto it = grid.tree().cbeginValueAll(); it; ++it) {
        const openvdb::Coord c = it.getCoord();
        if (!it.isVoxelValue() && it.getValue() > 0)
            continue; // outside tiles: how they are split says nothing
        add(c.x()), add(c.y()), add(c.z());
        add(it.getValue());
        add(it.isValueOn());
    }
    return sha256_hex(bytes);
}

} // namespace taihu
