#include "vdb_ops/carve.h"

#include <cmath>
#include <memory>

#include "vdb_ops/balls_field.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/level_set_field.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/volume.h"

namespace taihu {

CarveResult carve(const openvdb::FloatGrid& rock, std::span<const Sphere> holes,
                  Progress* progress) {
    const Lattice lattice = lattice_of(rock);
    // Fields share what they are made of; the caller's grid outlives this call.
    const openvdb::FloatGrid::ConstPtr borrowed(&rock, [](const openvdb::FloatGrid*) {});
    const DifferenceField difference(std::make_shared<LevelSetField>(borrowed),
                                     std::make_shared<BallsField>(holes));
    CarveResult result;
    result.rock = rasterize(difference, lattice, progress);
    for (const Sphere& hole : holes)
        result.n_unresolved += hole.radius_m < 1.5 * lattice.voxel_m;
    return result;
}

CarvedVolume carved_volume(const openvdb::FloatGrid& base, const openvdb::FloatGrid& rock) {
    CarvedVolume volume{volume_m3(base), 0};
    volume.removed_m3 = volume.base_m3 - volume_m3(rock);
    if (std::fabs(volume.removed_m3) < 1e-12 * volume.base_m3)
        volume.removed_m3 = 0; // the two sums are over other leaves
    return volume;
}

} // namespace taihu
