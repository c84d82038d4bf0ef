#include "vdb_ops/level_set_box.h"

namespace taihu {

Box level_set_box(const openvdb::FloatGrid& grid) {
    const double voxel = grid.voxelSize().x();
    Box box;
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf)
        for (auto v = leaf->cbeginValueOn(); v; ++v)
            if (*v < 0) {
                const openvdb::Coord c = v.getCoord();
                const Vec3 p{double(c.x()), double(c.y()), double(c.z())}, d{1, 1, 1};
                box.include(p + d * (*v / voxel));
                box.include(p - d * (*v / voxel));
            }
    if (box.empty())
        return box;
    const auto world = [&](const Vec3& p) {
        const openvdb::Vec3d w = grid.indexToWorld(openvdb::Vec3d(p.x, p.y, p.z));
        return Vec3{w.x(), w.y(), w.z()};
    };
    Box out;
    out.include(world(box.lo));
    out.include(world(box.hi));
    return out;
}

} // namespace taihu
